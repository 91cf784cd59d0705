// Reads a recording: its topics, their writers, and the messages in the order in which the recorder
// took them. Independent of DDS.
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

// The file is not a fivepipe recording, or lacks what the caller requested. The text names the
// file.
struct RecordingError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// One writer of one topic.
struct RecordedChannel {
  mcap::Id id = 0;
  std::string topic, type;  // for key states: the topic that the keys belong to
  bool key_states = false;
  std::string writer, node;  // GUID and participant name; empty if unknown
  std::map<std::string, std::string> metadata;
  std::uint64_t messages = 0;
};

struct RecordedMessage {
  const RecordedChannel* channel = nullptr;
  std::uint32_t sequence = 0;
  // CLOCK_REALTIME: when the recorder took the message, and when its source wrote it.
  std::int64_t log_stamp_ns = 0, source_stamp_ns = 0;
  std::optional<KeyChange> key_change;  // if set, `cdr` holds the key only
  std::span<const std::byte> cdr;       // valid until the cursor's next call
};

class Recording {
 public:
  // Throws mcap::McapError if the file is not an MCAP file, std::system_error if it cannot be read.
  explicit Recording(const std::filesystem::path& file);

  const std::filesystem::path& file() const { return file_; }
  const mcap::Reader& mcap() const { return *reader_; }
  const std::vector<RecordedChannel>& channels() const { return channels_; }
  const RecordedChannel* channel(mcap::Id id) const;  // nullptr if there is none
  // Log stamps of the first and the last message; 0 without messages.
  std::int64_t start_ns() const { return std::int64_t(reader_->statistics().start_ns); }
  std::int64_t end_ns() const { return std::int64_t(reader_->statistics().end_ns); }

  // The type at the time of recording. Throws RecordingError if the channel has no schema or the
  // schema cannot be parsed.
  const schema::Idl& idl(const RecordedChannel& channel) const;
  // Messages that describe how the types of these channels differ from this build's types. Empty if
  // they are equal, as replay requires: fivepipe does not convert between versions of a type.
  // Throws RecordingError as idl() does.
  std::vector<std::string> type_differences(const std::set<mcap::Id>& channels) const;

  // Values of the last metadata record of that name; empty if the file has none. Throws
  // mcap::McapError if the record is damaged.
  std::map<std::string, std::string> metadata(const std::string& name) const;
  // Writes the deployment's files into the folder and returns the path of the deployment file
  // there, or nullopt if the recording has none. Throws RecordingError if an attachment's name
  // leads out of the folder, a file cannot be written or the deployment file is missing;
  // mcap::McapError if an attachment is damaged.
  std::optional<std::filesystem::path> extract_deployment(
      const std::filesystem::path& folder) const;

  class Cursor {
   public:
    // Returns nullopt at the end. Skips key states that fivepipe did not write. Throws
    // mcap::McapError if a chunk is damaged; the next call continues after that chunk.
    std::optional<RecordedMessage> next();

   private:
    friend class Recording;
    Cursor(const Recording& recording, mcap::Cursor cursor)
        : recording_(&recording), cursor_(std::move(cursor)) {}
    const Recording* recording_;
    mcap::Cursor cursor_;
  };
  // Messages of these channels with a log stamp in [start_ns, end_ns]. The Recording must outlive
  // the cursor.
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
