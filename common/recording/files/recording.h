// A recording to read: the topics, their writers, and messages in the order in which they were
// taken. Pure.
#pragma once
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "common/recording/files/recording_writer.h"
#include "common/recording/mcap/reader.h"
#include "common/recording/schema/idl.h"

namespace fivepipe::recording {

// Not a recording of fivepipe, or not what was asked of it. The message names the file.
struct RecordingError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// One writer of one topic.
struct RecordedChannel {
  mcap::Id id = 0;
  std::string topic, type;  // of key states: the topic whose keys they are
  bool key_states = false;
  std::string writer,
      node;  // GUID, and what its process calls itself; empty where it was not known
  std::map<std::string, std::string> metadata;
  std::uint64_t messages = 0;
};

struct RecordedMessage {
  const RecordedChannel* channel = nullptr;
  std::uint32_t sequence = 0;
  std::int64_t log_stamp_ns = 0,
               source_stamp_ns = 0;  // CLOCK_REALTIME: taken by the recorder, written by its source
  std::optional<KeyChange> key_change;  // `cdr` then holds the key alone
  std::span<const std::byte> cdr;       // lives until the cursor goes on
};

class Recording {
 public:
  // Throws mcap::McapError or std::system_error.
  explicit Recording(const std::filesystem::path& file);

  const std::filesystem::path& file() const { return file_; }
  const mcap::Reader& mcap() const { return *reader_; }
  const std::vector<RecordedChannel>& channels() const { return channels_; }
  const RecordedChannel* channel(mcap::Id id) const;
  // Log stamps of the first and the last message; 0 without messages.
  std::int64_t start_ns() const { return std::int64_t(reader_->statistics().start_ns); }
  std::int64_t end_ns() const { return std::int64_t(reader_->statistics().end_ns); }

  // The type as it was when it was recorded. Throws RecordingError where its schema can't be read.
  const schema::Idl& idl(const RecordedChannel& channel) const;
  // For people: what differs from this build's types, of these channels; empty: nothing, they can
  // be replayed. Types are converted nowhere yet.
  std::vector<std::string> type_differences(const std::set<mcap::Id>& channels) const;

  // Values of a metadata record; empty where there is none.
  std::map<std::string, std::string> metadata(const std::string& name) const;
  // Writes the deployment's files into the folder and gives the deployment file there. Nothing
  // where none is attached. Throws RecordingError where an attachment's name would lead out of the
  // folder.
  std::optional<std::filesystem::path> extract_deployment(
      const std::filesystem::path& folder) const;

  class Cursor {
   public:
    // Throws mcap::McapError where a chunk is damaged; the next call goes on behind it.
    std::optional<RecordedMessage> next();

   private:
    friend class Recording;
    Cursor(const Recording& recording, mcap::Cursor cursor)
        : recording_(&recording), cursor_(std::move(cursor)) {}
    const Recording* recording_;
    mcap::Cursor cursor_;
  };
  // Whose log stamp is in [start_ns, end_ns], of these channels. The Recording must outlive it.
  Cursor messages(std::int64_t start_ns, std::int64_t end_ns,
                  const std::set<mcap::Id>& channels) const;
  Cursor messages() const;

 private:
  std::filesystem::path file_;
  std::unique_ptr<mcap::Reader> reader_;
  std::vector<RecordedChannel> channels_;
  std::map<mcap::Id, std::size_t> index_of_;
  mutable std::map<mcap::Id, schema::Idl> idls_;  // by channel
};

}  // namespace fivepipe::recording
