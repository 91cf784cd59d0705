#include "common/recording/mcap/scan.h"

#include <algorithm>
#include <utility>

#include "common/recording/mcap/format/chunk_records.h"

namespace fivepipe::mcap {
namespace {

// Consecutive unchunked records are merged into one entry up to this size, which is read at once.
constexpr std::uint64_t kMaxUnchunkedBytes = 16 << 20;

bool same_entries(ByteView record, std::span<const MessageIndexEntry> entries) {
  const ByteView expected = std::as_bytes(entries);
  const std::size_t head_bytes = sizeof(Id) + sizeof(std::uint32_t);
  return record.size() == head_bytes + expected.size() &&
         std::equal(expected.begin(), expected.end(), record.begin() + std::ptrdiff_t(head_bytes));
}

// True if both maps hold an id with different values.
template <typename T>
bool differ(const std::map<Id, T>& some, const std::map<Id, T>& others) {
  return std::any_of(some.begin(), some.end(), [&](const auto& one) {
    const auto found = others.find(one.first);
    return found != others.end() && found->second != one.second;
  });
}

class Scanner {
 public:
  explicit Scanner(const File& file) : file_(file) {}

  Scan run() {
    check_magic(file_);
    std::uint64_t at = kMagic.size();
    scan_.damage.intact_bytes = at;
    while (const std::uint64_t length_bytes = record_at(at)) {
      take(at, length_bytes);
      at += length_bytes;
    }
    end_chunk();
    // Cuts off an incomplete index after the last chunk, which recover() rebuilds.
    if (unindexed_until_ == scan_.damage.intact_bytes)
      scan_.damage.intact_bytes =
          scan_.summary.chunks.back().offset + scan_.summary.chunks.back().length_bytes;
    scan_.damage.truncated_bytes = file_.size_bytes() - scan_.damage.intact_bytes;
    count_records(scan_.summary);
    return std::move(scan_);
  }

 private:
  // Length of the complete record at `at`; 0 if the data section or the file ends there.
  std::uint64_t record_at(std::uint64_t at) {
    if (file_.size_bytes() - at < kRecordHeaderBytes) return 0;
    const Buffer head = file_.read(at, kRecordHeaderBytes);
    ByteReader fields(head.view(), {file_.name(), at});
    op_ = Op(fields.take<std::uint8_t>());
    const std::uint64_t content_bytes = fields.take<std::uint64_t>();
    if (op_ == Op(0) || op_ == Op::data_end || op_ == Op::footer ||
        content_bytes > file_.size_bytes() - at - kRecordHeaderBytes)
      return 0;
    return kRecordHeaderBytes + content_bytes;
  }

  void take(std::uint64_t at, std::uint64_t length_bytes) {
    if (op_ != Op::message_index) end_chunk();
    try {
      switch (op_) {
        case Op::header: scan_.has_header = true; break;
        case Op::schema:
        case Op::channel:
        case Op::message: take_unchunked(at, length_bytes); break;
        case Op::chunk: take_chunk(at, length_bytes); break;
        case Op::message_index: take_message_index(at, length_bytes); break;
        case Op::attachment: take_attachment(at, length_bytes); break;
        case Op::metadata: take_metadata(at, length_bytes); break;
        default: break;  // unknown, or quarantined
      }
    } catch (const McapError& error) {
      ++scan_.damage.damaged_records;
      if (scan_.damage.damage_reports.size() < Damage::kMaxReported)
        scan_.damage.damage_reports.push_back(error.what());
      scan_.damaged_bytes.push_back(at);
      damaged_ = true;
      return;
    }
    // The message index records of a damaged chunk do not count as intact.
    if (op_ == Op::message_index && damaged_) return;
    damaged_ = false;
    scan_.damage.intact_bytes = at + length_bytes;
  }

  // Adds all of the content, or throws and adds nothing.
  void add(ChunkContent content, ChunkIndex index, const FileOffset& location) {
    Summary& summary = scan_.summary;
    if (differ(content.schemas, summary.schemas))
      location.fail("a schema differs from an earlier one of the same id");
    if (differ(content.channels, summary.channels))
      location.fail("a channel differs from an earlier one of the same id");
    summary.schemas.merge(content.schemas);
    summary.channels.merge(content.channels);
    for (const auto& [channel, messages] : content.messages) {
      if (summary.channels.contains(channel))
        add_messages(summary.statistics, channel, messages.size(), content.start_ns,
                     content.end_ns);
      else
        scan_.damage.orphaned_messages += messages.size();
    }
    summary.chunks.push_back(std::move(index));
  }

  void take_chunk(std::uint64_t at, std::uint64_t length_bytes) {
    const FileOffset location{file_.name(), at};
    ChunkIndex index = read_chunk_index_at(file_, at, length_bytes);
    const Buffer records = read_chunk(file_, index);
    ChunkContent content = content_of(records.view(), location);
    if (content.start_ns != index.start_ns || content.end_ns != index.end_ns)
      location.fail("a message is outside the time range of its chunk");
    MessageIndex entries = content.messages;
    add(std::move(content), std::move(index), location);
    index_missing_ = std::move(entries);
  }

  void take_message_index(std::uint64_t at, std::uint64_t length_bytes) {
    if (index_missing_.empty()) return;
    const Buffer bytes = file_.read(at + kRecordHeaderBytes, length_bytes - kRecordHeaderBytes);
    ByteReader fields(bytes.view(), {file_.name(), at});
    const Id channel = fields.take<Id>();
    const auto entries = index_missing_.find(channel);
    if (entries == index_missing_.end() || !same_entries(bytes.view(), entries->second)) return;
    ChunkIndex& chunk = scan_.summary.chunks.back();
    chunk.message_index_offsets[channel] = at;
    chunk.message_index_bytes += length_bytes;
    index_missing_.erase(entries);
  }

  // Discards an index that does not cover all messages of its chunk.
  void end_chunk() {
    if (index_missing_.empty()) return;
    scan_.summary.chunks.back().message_index_offsets.clear();
    scan_.summary.chunks.back().message_index_bytes = 0;
    index_missing_.clear();
    unindexed_until_ = scan_.damage.intact_bytes;
  }

  void take_unchunked(std::uint64_t at, std::uint64_t length_bytes) {
    const FileOffset location{file_.name(), at};
    if (length_bytes > kMaxUnchunkedBytes)
      location.fail("a record outside of chunks exceeds 16 MiB");
    const Buffer record = file_.read(at, length_bytes);
    ChunkContent content = content_of(record.view(), location);
    auto& chunks = scan_.summary.chunks;
    ChunkIndex piece;
    piece.unchunked = true;
    piece.offset = at;
    piece.start_ns = content.start_ns;
    piece.end_ns = content.end_ns;
    const bool has_message = !content.messages.empty();
    if (!chunks.empty() && chunks.back().unchunked &&
        chunks.back().offset + chunks.back().length_bytes == at &&
        chunks.back().length_bytes + length_bytes <= kMaxUnchunkedBytes) {
      piece = chunks.back();
      if (has_message) {
        const bool first = !unchunked_has_message_;
        piece.start_ns = first ? content.start_ns : std::min(piece.start_ns, content.start_ns);
        piece.end_ns = first ? content.end_ns : std::max(piece.end_ns, content.end_ns);
      }
      unchunked_has_message_ = unchunked_has_message_ || has_message;
      piece.length_bytes += length_bytes;
      add(std::move(content), piece, location);
      chunks.erase(std::prev(chunks.end(), 2));
      return;
    }
    unchunked_has_message_ = has_message;
    piece.length_bytes = length_bytes;
    add(std::move(content), piece, location);
  }

  void take_attachment(std::uint64_t at, std::uint64_t length_bytes) {
    const Buffer bytes = file_.read(at + kRecordHeaderBytes, length_bytes - kRecordHeaderBytes);
    const Attachment attachment = read_attachment({bytes.view(), {file_.name(), at}});
    scan_.summary.attachments.push_back({at, length_bytes, attachment.log_stamp_ns,
                                         attachment.create_stamp_ns, attachment.content.size(),
                                         attachment.name, attachment.media_type});
  }

  void take_metadata(std::uint64_t at, std::uint64_t length_bytes) {
    const Buffer bytes = file_.read(at + kRecordHeaderBytes, length_bytes - kRecordHeaderBytes);
    scan_.summary.metadata.push_back(
        {at, length_bytes, read_metadata({bytes.view(), {file_.name(), at}}).name});
  }

  const File& file_;
  Scan scan_;
  Op op_ = Op(0);
  MessageIndex index_missing_;  // entries of the last chunk whose index record has not appeared yet
  // End of the index records of the last chunk whose index is incomplete.
  std::uint64_t unindexed_until_ = 0;
  bool damaged_ = false;                // the last record that is not a message index
  bool unchunked_has_message_ = false;  // the entry of unchunked records at the end of the list
};

}  // namespace

Scan scan(const File& file) { return Scanner(file).run(); }

ChunkContent content_of(ByteView records, const FileOffset& location) {
  ChunkContent content;
  bool has_message = false;
  std::uint64_t definition_bytes = 0;
  RecordSequence sequence(records, location);
  while (const auto record = sequence.next()) {
    const ByteReader fields(record->content, location);
    if (record->op == Op::schema || record->op == Op::channel)
      definition_bytes += record->content.size();
    if (definition_bytes > kMaxDefinitionBytes)
      location.fail("the schemas and channels of a chunk exceed 64 MiB");
    if (record->op == Op::schema) {
      auto [id, schema] = read_schema(fields);
      if (id == 0) continue;  // the specification declares id 0 invalid: ignore it
      const auto [found, is_new] = content.schemas.try_emplace(id, schema);
      if (!is_new && found->second != schema)
        location.fail("a schema differs from an earlier one of the same id");
    } else if (record->op == Op::channel) {
      auto [id, channel] = read_channel(fields);
      const auto [found, is_new] = content.channels.try_emplace(id, channel);
      if (!is_new && found->second != channel)
        location.fail("a channel differs from an earlier one of the same id");
    } else if (record->op == Op::message) {
      const Message message = read_message(fields);
      content.messages[message.channel].push_back({message.log_stamp_ns, record->offset});
      content.start_ns =
          has_message ? std::min(content.start_ns, message.log_stamp_ns) : message.log_stamp_ns;
      content.end_ns =
          has_message ? std::max(content.end_ns, message.log_stamp_ns) : message.log_stamp_ns;
      has_message = true;
    }
  }
  return content;
}

}  // namespace fivepipe::mcap
