// A recording on its way to the disk. Pure: who takes messages from the bus adds them here.
#pragma once
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>

#include "common/recording/mcap/file_writer.h"
#include "common/recording/mcap/format/chunk_builder.h"

namespace fivepipe::recording {

// What changed of a key, where it is no message.
enum class KeyChange { disposed, unregistered };

struct WriterOptions {
  mcap::Compression compression = mcap::Compression::lz4;
  std::size_t chunk_bytes = std::size_t(2) << 20;  // a chunk is closed at this size,
  double chunk_s = 0.5;  // or at this age, and is on the disk soon after: what a crash may cost
  bool sync = true;      // .. on the disk itself; else with the kernel: a power cut costs more
  std::size_t max_queued_bytes = std::size_t(256) << 20;  // for the disk; more is lost, and counted
};

struct TopicCounts {
  std::uint64_t received = 0, lost = 0,
                bytes =
                    0;  // lost: received, but the disk did not keep up; bytes: of payload received
  std::uint64_t written = 0;  // are in the file
  std::uint64_t
      sent = 0,
      missing = 0;  // as far as its writers told: what they sent, and what of it was never received
};

// One thread calls; compressing and writing go on in another. A full disk, or one that fails, ends
// the writing, not the process: what comes then is lost and counted, and what was written stays
// readable.
class RecordingWriter {
 public:
  // Throws std::system_error where the file can't be made.
  RecordingWriter(const std::filesystem::path& file, const std::string& library,
                  const WriterOptions& options);
  ~RecordingWriter();  // finishes
  RecordingWriter(const RecordingWriter&) = delete;
  RecordingWriter& operator=(const RecordingWriter&) = delete;

  void attach(mcap::Attachment attachment);
  void add(mcap::Metadata metadata);

  // One writer of a topic. `schema`: self-contained IDL of its type.
  mcap::Id add_channel(const std::string& topic, const std::string& type, const std::string& schema,
                       const std::map<std::string, std::string>& metadata);
  // Stamps: CLOCK_REALTIME [ns]. The payload is copied.
  void add(mcap::Id channel, std::int64_t log_stamp_ns, std::int64_t source_stamp_ns,
           std::span<const std::byte> cdr);
  void add(mcap::Id channel, std::int64_t log_stamp_ns, std::int64_t source_stamp_ns,
           KeyChange change, std::span<const std::byte> key_cdr);
  // To be called now and then: closes a chunk that has become old.
  void tick(std::int64_t now_ns);

  // By topic; `written` is the disk's count so far.
  std::map<std::string, TopicCounts> counts() const;
  std::uint64_t bytes_written() const { return bytes_written_; }
  // Why the disk takes no more; empty while it does.
  std::string failure() const;
  // Why messages were lost that were received; empty: none were.
  std::string loss_reason() const;

  // As the topic's writers count; goes into the file with the other counts.
  void add_sent(const std::string& topic, std::uint64_t sent, std::uint64_t missing);
  // Waits for the disk, writes the counts and the summary, and closes the file. Nothing may be
  // added after it. What still waits when `should_abort` first says so is lost, and counted.
  void finish(const std::function<bool()>& should_abort = {});

 private:
  struct QueuedChunk {
    mcap::Chunk chunk;
    std::size_t bytes;
    std::map<mcap::Id, std::uint64_t> messages;
  };
  struct ChannelState {
    std::string topic;
    std::uint32_t next_sequence = 0;
    std::optional<mcap::Id> key_states;  // the channel that tells of its keys
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

  mutable std::mutex mutex_;  // of what follows
  std::condition_variable changed_;
  std::deque<QueuedChunk> queue_;
  std::size_t queued_bytes_ = 0;
  std::map<std::string, TopicCounts> counts_;
  std::map<mcap::Id, std::string> topic_of_channel_;
  std::string failure_;
  bool finishing_ = false, aborted_ = false;

  std::mutex file_mutex_;  // of the file
  std::optional<mcap::FileWriter> file_;
  std::chrono::steady_clock::time_point synced_{};
  std::atomic<std::uint64_t> bytes_written_{0};
  std::thread writer_thread_;
};

}  // namespace fivepipe::recording
