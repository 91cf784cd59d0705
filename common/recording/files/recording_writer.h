// Writes a recording to the disk. Independent of DDS: the recorder passes messages to add().
#pragma once
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>

#include "common/base/containers/bounded_queue.h"
#include "common/recording/mcap/file_writer.h"
#include "common/recording/mcap/format/chunk_builder.h"

namespace fivepipe::recording {

// How the state of a key changed without a message.
enum class KeyChange { disposed, unregistered };

struct WriterOptions {
  mcap::Compression compression = mcap::Compression::lz4;
  // The writer closes a chunk at this size or at this age and then writes it, so a crash costs at
  // most that much.
  std::size_t chunk_bytes = std::size_t(2) << 20;
  double chunk_s = 0.5;
  double counts_s = 2;  // time between two records of the counts so far, of some 2 kB each
  bool sync = true;     // force chunks to the disk; without it a power cut may cost more
  std::size_t max_queued_bytes = std::size_t(256) << 20;  // messages beyond this are lost
};

struct TopicCounts {
  // lost: received, but not written; bytes: received payload.
  std::uint64_t received = 0, lost = 0, bytes = 0;
  std::uint64_t written = 0;
  // According to the send counts of the topic's writers; missing: sent, but never received.
  std::uint64_t sent = 0, missing = 0;
};

// Why messages are lost once no channel is left for their writer.
inline constexpr const char* kFullReason =
    "too many writers: an MCAP file has at most 65535 channels";

// Conditions that end finish() although the disk has not taken everything. Empty functions never
// do.
struct FinishLimits {
  // Returns why the remaining messages are dropped now; empty: not yet.
  std::function<std::string()> why_drop;
  // Returns whether to stop writing the index and waiting for the disk.
  mcap::StopCondition is_over;
};

// One thread calls the member functions; a second thread compresses and writes. If the disk is full
// or fails, the process continues: later messages are counted as lost, and what was written stays
// readable.
class RecordingWriter {
 public:
  // Throws std::system_error if the file cannot be created.
  RecordingWriter(const std::filesystem::path& file, const std::string& library,
                  const WriterOptions& options);
  ~RecordingWriter();  // calls finish()
  RecordingWriter(const RecordingWriter&) = delete;
  RecordingWriter& operator=(const RecordingWriter&) = delete;

  // Both write immediately and throw std::system_error if the disk is full or fails.
  void attach(mcap::Attachment attachment);
  void add(mcap::Metadata metadata);

  // Adds one writer of a topic. `schema` is the self-contained IDL of its type.
  // Throws std::length_error when 65535 channels (is_full()) or schemas exist.
  mcap::Id add_channel(const std::string& topic, const std::string& type, const std::string& schema,
                       const std::map<std::string, std::string>& metadata);
  bool is_full() const { return open_.is_full(); }
  // Counts a message as received and lost because no channel is left for its writer. `why` states
  // the reason, for loss_reason().
  void add_lost(const std::string& topic, std::size_t bytes, const std::string& why);
  // Stamps are CLOCK_REALTIME. Both copy the payload and throw std::out_of_range if the channel was
  // not added.
  void add(mcap::Id channel, std::int64_t log_stamp_ns, std::int64_t source_stamp_ns,
           std::span<const std::byte> cdr);
  void add(mcap::Id channel, std::int64_t log_stamp_ns, std::int64_t source_stamp_ns,
           KeyChange change, std::span<const std::byte> key_cdr);  // lost if no channel is left
  // Closes the open chunk if it has reached its maximum age. `now_ns` is CLOCK_REALTIME. Call it
  // several times per chunk_s.
  void tick(std::int64_t now_ns);

  // Counts by topic; `written` counts what the writing thread has finished so far.
  std::map<std::string, TopicCounts> counts() const;
  std::uint64_t bytes_written() const { return bytes_written_; }
  // Why the writer has stopped writing; empty if it has not.
  std::string failure() const;
  // Why received messages were lost; empty if none were.
  std::string loss_reason() const;

  // Adds send counts of the topic's writers. finish() stores them with the other counts.
  void add_sent(const std::string& topic, std::uint64_t sent, std::uint64_t missing);
  // Waits for the disk, writes the counts and the summary. No message may be added afterwards. When
  // the limits require it, drops the messages that are not written and counts them as lost, and
  // then stops writing the summary.
  void finish(const FinishLimits& limits = {});
  // After finish(): whether the file has its summary, and whether the disk has confirmed all of it.
  bool is_finished() const { return is_finished_; }
  bool is_synced() const { return is_synced_; }

 private:
  struct QueuedChunk {
    mcap::Chunk chunk;
    std::map<mcap::Id, std::uint64_t> messages;
  };
  struct ChannelState {
    std::string topic;
    std::uint32_t next_sequence = 0;
    std::optional<mcap::Id> key_states;  // the channel of the topic's key changes
    std::map<std::string, std::string> metadata;
  };
  void add_counted(mcap::Id channel, std::int64_t log_stamp_ns, std::int64_t source_stamp_ns,
                   std::span<const std::byte> payload);
  void close_chunk();
  void write_until_finished();
  void write(QueuedChunk& queued, bool is_last);
  bool write_to_file(const QueuedChunk& queued, bool is_last);
  void drop(const QueuedChunk& queued);
  void drop_remaining(const std::string& why);
  mcap::Metadata counts_metadata(const char* name) const;
  void wait_for_writer(const FinishLimits& limits);
  mcap::Id schema_of(const std::string& type, const std::string& text);

  WriterOptions options_;
  mcap::ChunkBuilder open_;
  std::map<mcap::Id, std::uint64_t> open_messages_;
  std::int64_t open_since_ns_ = 0;
  std::map<std::string, mcap::Id> schemas_;
  std::map<mcap::Id, ChannelState> channels_;

  mutable std::mutex mutex_;  // guards the members up to writer_ended_
  std::map<std::string, TopicCounts> counts_;
  std::map<mcap::Id, std::string> topic_of_channel_;
  std::string failure_, drop_reason_, full_reason_;
  bool writer_ended_ = false;
  std::condition_variable ended_;

  std::mutex file_mutex_;  // guards the members up to counted_
  std::optional<mcap::FileWriter> file_;
  std::chrono::steady_clock::time_point synced_{}, counted_ = std::chrono::steady_clock::now();
  std::atomic<bool> dropping_{false};  // the remaining messages are dropped
  bool is_finished_ = false, is_synced_ = false;
  std::atomic<std::uint64_t> bytes_written_{0};
  // Its cost is the size of uncompressed chunks. It has no limit of its own: add_counted() enforces
  // max_queued_bytes, which includes the open chunk.
  base::BoundedQueue<QueuedChunk> queue_{std::numeric_limits<std::size_t>::max()};
  std::thread writer_thread_;
};

}  // namespace fivepipe::recording
