// Writes a recording to the disk. Independent of DDS: the recorder passes messages to add().
#pragma once
#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>

#include "common/base/bounded_queue.h"
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
  bool sync = true;  // force chunks to the disk; without it a power cut may cost more
  std::size_t max_queued_bytes = std::size_t(256) << 20;  // messages beyond this are lost
};

struct TopicCounts {
  // lost: received, but not written; bytes: received payload.
  std::uint64_t received = 0, lost = 0, bytes = 0;
  std::uint64_t written = 0;
  // According to the send counts of the topic's writers; missing: sent, but never received.
  std::uint64_t sent = 0, missing = 0;
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
  // Throws std::length_error when 65535 channels or schemas exist.
  mcap::Id add_channel(const std::string& topic, const std::string& type, const std::string& schema,
                       const std::map<std::string, std::string>& metadata);
  // Stamps are CLOCK_REALTIME. Both copy the payload and throw std::out_of_range if the channel was
  // not added.
  void add(mcap::Id channel, std::int64_t log_stamp_ns, std::int64_t source_stamp_ns,
           std::span<const std::byte> cdr);
  void add(mcap::Id channel, std::int64_t log_stamp_ns, std::int64_t source_stamp_ns,
           KeyChange change, std::span<const std::byte> key_cdr);
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
  // Waits for the disk, writes the counts and the summary and closes the file. No message may be
  // added afterwards. When `should_abort` first returns true, the queued chunks are dropped and
  // counted as lost.
  void finish(const std::function<bool()>& should_abort = {});

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
  void drop(const QueuedChunk& queued);
  void add_counts();
  mcap::Id schema_of(const std::string& type, const std::string& text);

  WriterOptions options_;
  mcap::ChunkBuilder open_;
  std::map<mcap::Id, std::uint64_t> open_messages_;
  std::int64_t open_since_ns_ = 0;
  std::map<std::string, mcap::Id> schemas_;
  std::map<mcap::Id, ChannelState> channels_;

  mutable std::mutex mutex_;  // guards the members up to aborted_
  std::map<std::string, TopicCounts> counts_;
  std::map<mcap::Id, std::string> topic_of_channel_;
  std::string failure_;
  bool aborted_ = false;

  std::mutex file_mutex_;  // guards file_ and synced_
  std::optional<mcap::FileWriter> file_;
  std::chrono::steady_clock::time_point synced_{};
  std::atomic<std::uint64_t> bytes_written_{0};
  // Its cost is the size of uncompressed chunks. It has no limit of its own: add_counted() enforces
  // max_queued_bytes, which includes the open chunk.
  base::BoundedQueue<QueuedChunk> queue_{std::numeric_limits<std::size_t>::max()};
  std::thread writer_thread_;
};

}  // namespace fivepipe::recording
