#include "common/recording/files/recording_writer.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "common/base/realtime.h"
#include "common/recording/files/format.h"

namespace fivepipe::recording {
namespace {

void append_uint32(std::vector<std::byte>& to, std::uint32_t value) {
  for (int shift = 0; shift < 32; shift += 8) to.push_back(std::byte(value >> shift));
}

// Plain CDR, little endian.
std::vector<std::byte> key_state_cdr(KeyChange change, std::span<const std::byte> key) {
  std::vector<std::byte> cdr{std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}};
  append_uint32(cdr, change == KeyChange::disposed ? 0 : 1);
  append_uint32(cdr, std::uint32_t(key.size()));
  cdr.insert(cdr.end(), key.begin(), key.end());
  return cdr;
}

}  // namespace

RecordingWriter::RecordingWriter(const std::filesystem::path& file, const std::string& library,
                                 const WriterOptions& options)
    : options_(options) {
  file_.emplace(file, options.compression, library);
  writer_thread_ = std::thread([this] { write_until_finished(); });
}

RecordingWriter::~RecordingWriter() { finish(); }

void RecordingWriter::attach(mcap::Attachment attachment) {
  const std::scoped_lock lock(file_mutex_);
  file_->attach(attachment);
}

void RecordingWriter::add(mcap::Metadata metadata) {
  const std::scoped_lock lock(file_mutex_);
  file_->add(metadata);
}

mcap::Id RecordingWriter::schema_of(const std::string& type, const std::string& text) {
  const auto [known, is_new] = schemas_.try_emplace(type, mcap::Id(0));
  if (is_new) known->second = open_.add_schema({type, kSchemaEncoding, text});
  return known->second;
}

mcap::Id RecordingWriter::add_channel(const std::string& topic, const std::string& type,
                                      const std::string& schema,
                                      const std::map<std::string, std::string>& metadata) {
  const mcap::Id id =
      open_.add_channel({schema_of(type, schema), topic, kMessageEncoding, metadata});
  channels_[id] = {topic, 0, std::nullopt, metadata};
  const std::scoped_lock lock(mutex_);
  topic_of_channel_[id] = topic;
  counts_[topic];
  return id;
}

void RecordingWriter::add(mcap::Id channel, std::int64_t log_stamp_ns, std::int64_t source_stamp_ns,
                          std::span<const std::byte> cdr) {
  add_counted(channel, log_stamp_ns, source_stamp_ns, cdr);
}

void RecordingWriter::add(mcap::Id channel, std::int64_t log_stamp_ns, std::int64_t source_stamp_ns,
                          KeyChange change, std::span<const std::byte> key_cdr) {
  ChannelState& of = channels_.at(channel);
  if (!of.key_states && is_full())
    return add_lost(of.topic + kKeyStateSuffix, key_cdr.size(), kFullReason);
  if (!of.key_states)
    of.key_states =
        add_channel(of.topic + kKeyStateSuffix, kKeyStateType, kKeyStateIdl, of.metadata);
  add_counted(*of.key_states, log_stamp_ns, source_stamp_ns, key_state_cdr(change, key_cdr));
}

void RecordingWriter::add_lost(const std::string& topic, std::size_t bytes,
                               const std::string& why) {
  const std::scoped_lock lock(mutex_);
  TopicCounts& counts = counts_[topic];
  ++counts.received;
  ++counts.lost;
  counts.bytes += bytes;
  full_reason_ = why;
}

void RecordingWriter::add_counted(mcap::Id channel, std::int64_t log_stamp_ns,
                                  std::int64_t source_stamp_ns,
                                  std::span<const std::byte> payload) {
  ChannelState& state = channels_.at(channel);
  {
    const std::scoped_lock lock(mutex_);
    TopicCounts& counts = counts_[state.topic];
    ++counts.received;
    counts.bytes += payload.size();
    if (!failure_.empty() ||
        queue_.cost() + open_.size_bytes() + payload.size() > options_.max_queued_bytes) {
      ++counts.lost;
      ++state.next_sequence;  // leaves a visible gap in the file
      return;
    }
  }
  if (open_.empty()) open_since_ns_ = log_stamp_ns;
  open_.add({channel, state.next_sequence++, std::uint64_t(log_stamp_ns),
             std::uint64_t(source_stamp_ns), payload});
  ++open_messages_[channel];
  if (open_.size_bytes() >= options_.chunk_bytes) close_chunk();
}

void RecordingWriter::tick(std::int64_t now_ns) {
  if (!open_.empty() && 1e-9 * double(now_ns - open_since_ns_) >= options_.chunk_s) close_chunk();
}

void RecordingWriter::close_chunk() {
  if (open_.empty()) return;
  const std::size_t bytes = open_.size_bytes();
  queue_.push({open_.take(), std::exchange(open_messages_, {})}, bytes);
}

void RecordingWriter::write_until_finished() {
  while (auto next = queue_.pop()) write(*next, queue_.size() == 0);
  const std::scoped_lock lock(mutex_);
  writer_ended_ = true;
  ended_.notify_all();
}

// Returns false if finish() drops the remaining messages meanwhile.
bool RecordingWriter::write_to_file(const QueuedChunk& queued, bool is_last) {
  const auto now = [] { return std::chrono::steady_clock::now(); };
  const auto dropping = [this] { return dropping_.load(); };
  const std::scoped_lock lock(file_mutex_);
  if (!file_->write(queued.chunk, dropping)) return false;
  if (now() - counted_ >= std::chrono::duration<double>(options_.counts_s)) {
    mcap::Metadata counts = counts_metadata(kCountsSoFarMetadata);
    counts.values[kCountsStampKey] = std::to_string(base::now_realtime_ns());
    file_->add(counts);
    counted_ = now();
  }
  bytes_written_ = file_->bytes_written();
  // If the disk lags behind, several chunks share one sync.
  if (options_.sync &&
      (is_last || now() - synced_ >= std::chrono::duration<double>(options_.chunk_s))) {
    file_->sync(dropping);
    synced_ = now();
  }
  return true;
}

void RecordingWriter::write(QueuedChunk& queued, bool is_last) {
  std::string why = failure();
  bool written = false;
  if (why.empty()) try {
      written = write_to_file(queued, is_last);
    } catch (const std::exception& error) {
      why = error.what();
    }
  const std::scoped_lock lock(mutex_);
  if (failure_.empty()) failure_ = why;
  if (!written) return drop(queued);
  for (const auto& [channel, count] : queued.messages)
    counts_[topic_of_channel_.at(channel)].written += count;
}

void RecordingWriter::drop(const QueuedChunk& queued) {
  for (const auto& [channel, count] : queued.messages)
    counts_[topic_of_channel_.at(channel)].lost += count;
}

std::map<std::string, TopicCounts> RecordingWriter::counts() const {
  const std::scoped_lock lock(mutex_);
  return counts_;
}

std::string RecordingWriter::failure() const {
  const std::scoped_lock lock(mutex_);
  return failure_;
}

std::string RecordingWriter::loss_reason() const {
  const std::scoped_lock lock(mutex_);
  const bool none = std::all_of(counts_.begin(), counts_.end(),
                                [](const auto& count) { return count.second.lost == 0; });
  return none                    ? ""
         : !failure_.empty()     ? failure_
         : !full_reason_.empty() ? full_reason_
         : !drop_reason_.empty() ? drop_reason_
                                 : "the disk was too slow";
}

void RecordingWriter::add_sent(const std::string& topic, std::uint64_t sent,
                               std::uint64_t missing) {
  const std::scoped_lock lock(mutex_);
  counts_[topic].sent += sent;
  counts_[topic].missing += missing;
}

mcap::Metadata RecordingWriter::counts_metadata(const char* name) const {
  const std::string why = loss_reason();
  mcap::Metadata metadata{name, {}};
  for (const auto& [topic, count] : counts()) {
    metadata.values[topic + " received"] = std::to_string(count.received);
    metadata.values[topic + " written"] = std::to_string(count.written);
    metadata.values[topic + " lost"] = std::to_string(count.lost);
    if (count.sent == 0) continue;
    metadata.values[topic + " sent"] = std::to_string(count.sent);
    metadata.values[topic + " missing"] = std::to_string(count.missing);
  }
  if (!why.empty()) metadata.values[kLossReasonKey] = why;
  return metadata;
}

void RecordingWriter::drop_remaining(const std::string& why) {
  dropping_ = true;
  const auto dropped = queue_.clear();
  const std::scoped_lock lock(mutex_);
  drop_reason_ = why;
  for (const QueuedChunk& queued : dropped) drop(queued);
}

void RecordingWriter::wait_for_writer(const FinishLimits& limits) {
  constexpr std::chrono::milliseconds kPollPeriod{20};
  std::unique_lock lock(mutex_);
  while (!ended_.wait_for(lock, kPollPeriod, [this] { return writer_ended_; })) {
    lock.unlock();
    if (!dropping_ && limits.why_drop)
      if (const std::string why = limits.why_drop(); !why.empty()) drop_remaining(why);
    lock.lock();
  }
  lock.unlock();
  writer_thread_.join();
}

void RecordingWriter::finish(const FinishLimits& limits) {
  if (!writer_thread_.joinable()) return;
  close_chunk();
  queue_.close();
  wait_for_writer(limits);
  if (!failure_.empty()) return;
  try {
    file_->add(counts_metadata(kCountsMetadata));
    is_finished_ = file_->finish(limits.is_over);
    if (options_.sync) is_synced_ = file_->sync(limits.is_over);
    bytes_written_ = file_->bytes_written();
  } catch (const std::exception& error) {
    failure_ = error.what();
  }
}

}  // namespace fivepipe::recording
