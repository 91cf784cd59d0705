#include "common/recording/mcap/cursor.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "common/recording/mcap/format/chunk_records.h"

namespace fivepipe::mcap {

struct Cursor::OpenChunk {
  Buffer records;
  std::uint64_t offset = 0;                 // of the chunk, in the file
  std::vector<MessageIndexEntry> messages;  // the wanted ones, by stamp
  std::size_t next = 0;

  auto order() const { return std::tuple(messages[next].log_stamp_ns, offset); }
  // std::push_heap keeps the greatest element first, so `later` inverts the order.
  static bool later(const std::unique_ptr<OpenChunk>& a, const std::unique_ptr<OpenChunk>& b) {
    return a->order() > b->order();
  }
};

Cursor::Cursor(std::shared_ptr<const File> file, const std::vector<ChunkIndex>& chunks,
               std::uint64_t start_ns, std::uint64_t end_ns, std::vector<bool> wanted)
    : file_(std::move(file)), start_ns_(start_ns), end_ns_(end_ns), wanted_(std::move(wanted)) {
  const auto has_wanted = [&](const ChunkIndex& chunk) {
    const auto& channels = chunk.message_index_offsets;
    return channels.empty() ||
           std::any_of(channels.begin(), channels.end(),
                       [&](const auto& channel) { return wanted_[channel.first]; });
  };
  for (const ChunkIndex& chunk : chunks)
    if (chunk.start_ns <= end_ns_ && chunk.end_ns >= start_ns_ && has_wanted(chunk))
      pending_.push_back(chunk);
  std::sort(pending_.begin(), pending_.end(), [](const ChunkIndex& a, const ChunkIndex& b) {
    return std::tuple(a.start_ns, a.offset) > std::tuple(b.start_ns, b.offset);
  });
}
Cursor::Cursor(Cursor&&) noexcept = default;
Cursor::~Cursor() = default;

void Cursor::open(const ChunkIndex& chunk) {
  const FileOffset location{file_->name(), chunk.offset};
  const std::uint64_t records_bytes =
      chunk.unchunked ? chunk.length_bytes : chunk.uncompressed_bytes;
  if (records_bytes > kMaxOpenBytes - open_bytes_)
    location.fail("more than 2 GiB of chunks overlap in time");
  auto opened = std::make_unique<OpenChunk>();
  opened->records = read_chunk(*file_, chunk);
  opened->offset = chunk.offset;
  RecordSequence records(opened->records.view(), location);
  while (const auto record = records.next()) {
    if (record->op != Op::message) continue;
    const Message message = read_message({record->content, location});
    // Otherwise messages would be returned out of order.
    if (message.log_stamp_ns < chunk.start_ns || message.log_stamp_ns > chunk.end_ns)
      location.fail("a message is outside the time range of its chunk");
    if (wanted_[message.channel] && message.log_stamp_ns >= start_ns_ &&
        message.log_stamp_ns <= end_ns_)
      opened->messages.push_back({message.log_stamp_ns, record->offset});
  }
  if (opened->messages.empty()) return;
  std::stable_sort(opened->messages.begin(), opened->messages.end(),
                   [](const MessageIndexEntry& a, const MessageIndexEntry& b) {
                     return a.log_stamp_ns < b.log_stamp_ns;
                   });
  open_bytes_ += opened->records.view().size();
  open_.push_back(std::move(opened));
  std::push_heap(open_.begin(), open_.end(), OpenChunk::later);
}

void Cursor::advance() {
  if (!current_) return;
  if (++current_->next < current_->messages.size()) {
    open_.push_back(std::move(current_));
    std::push_heap(open_.begin(), open_.end(), OpenChunk::later);
  } else {
    open_bytes_ -= current_->records.view().size();
  }
  current_.reset();
}

std::optional<Message> Cursor::next() {
  advance();
  // A chunk that starts at or before the stamp of the next message may hold an earlier message.
  while (!pending_.empty() &&
         (open_.empty() || pending_.back().start_ns <= std::get<0>(open_.front()->order()))) {
    const ChunkIndex chunk = std::move(pending_.back());
    pending_.pop_back();
    open(chunk);
  }
  if (open_.empty()) return std::nullopt;
  std::pop_heap(open_.begin(), open_.end(), OpenChunk::later);
  current_ = std::move(open_.back());
  open_.pop_back();
  const ByteView from_message =
      current_->records.view().subspan(current_->messages[current_->next].offset);
  return read_message(
      {RecordSequence(from_message, {file_->name(), current_->offset}).next()->content,
       {file_->name(), current_->offset}});
}

}  // namespace fivepipe::mcap
