// Groups a recording's messages by frame, for a replay that waits for each frame. A recorder takes
// messages topic by topic, so messages of several frames are interleaved in the file.
#pragma once
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "common/recording/files/recording.h"
#include "common/recording/schema/cdr.h"

namespace fivepipe::recording {

struct OwnedMessage {
  const RecordedChannel* channel = nullptr;
  std::int64_t log_stamp_ns = 0, source_stamp_ns = 0;
  std::optional<KeyChange> key_change;
  std::vector<std::byte> cdr;
  std::int64_t capture_stamp_ns = 0;  // of its frame; 0 if it belongs to none
};

struct FrameGroup {
  std::optional<std::uint64_t> frame;  // nullopt: a single message that belongs to no frame
  std::int64_t log_stamp_ns = 0;       // of the first message
  std::int64_t capture_stamp_ns = 0;   // of the first message; 0 if it belongs to no frame
  std::vector<OwnedMessage> messages;  // by rank of their topics, then in file order
};

// Identifies the frame of a message. Frame numbers start again when capture_node restarts; the
// capture stamp distinguishes the runs.
struct FrameId {
  std::uint64_t frame = 0;
  std::int64_t capture_stamp_ns = 0;
};
class FrameIdReader {
 public:
  // The recording must outlive this object.
  explicit FrameIdReader(const Recording& recording) : recording_(recording) {}
  // Returns nullopt for key changes and for types that belong to no frame: those without `frame`,
  // and NodeStatus, which names a frame without a capture stamp. Throws RecordingError if the
  // schema of the channel cannot be parsed.
  std::optional<FrameId> operator()(const RecordedMessage& message);

 private:
  const Recording& recording_;
  struct Fields {
    schema::FieldReader frame, capture_stamp_ns;
  };
  std::map<mcap::Id, std::optional<Fields>> fields_;
};

class FrameGroups {
 public:
  // The file is assumed to hold all messages of a frame before the first message of the frame this
  // many frames later. late() counts the messages that violate this.
  static constexpr std::size_t kReorderWindow_frames = 120;
  // Messages with one frame number whose capture stamps differ by more belong to different runs.
  static constexpr std::int64_t kMaxFrameSpan_ns = 2'000'000'000;
  // `rank` orders topics within a frame, lowest first. The recording must outlive this object.
  FrameGroups(const Recording& recording, Recording::Cursor cursor,
              std::function<int(const std::string& topic)> rank);

  // Returns groups in the order of their first messages, nullopt at the end. Throws mcap::McapError
  // as Recording::Cursor does, and RecordingError as FrameIdReader does.
  std::optional<FrameGroup> next();
  // Number of messages whose frame had already been returned; next() returns each as its own group.
  std::uint64_t late() const { return late_; }

 private:
  bool read_message();  // false at the end
  FrameGroup pop_oldest();

  Recording::Cursor cursor_;
  std::function<int(const std::string&)> rank_;
  FrameIdReader frame_id_reader_;
  std::deque<FrameGroup> open_;
  std::size_t open_frames_ = 0;
  std::map<std::uint64_t, std::int64_t> emitted_;  // frame -> capture stamp
  bool ended_ = false;
  std::uint64_t late_ = 0;
};

}  // namespace fivepipe::recording
