// A recording's messages frame by frame, for a replay in which each frame is waited for: recorders
// take topic by topic, so that messages of several frames stand among one another in the file.
#pragma once
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "common/recording/files/recording.h"
#include "common/recording/schema/cdr.h"

namespace fivepipe::recording {

struct KeptMessage {
  const RecordedChannel* channel = nullptr;
  std::int64_t log_stamp_ns = 0, source_stamp_ns = 0;
  std::optional<KeyChange> key_change;
  std::vector<std::byte> cdr;
  std::int64_t capture_stamp_ns = 0;  // where it is of a frame
};

struct FrameGroup {
  std::optional<std::uint64_t> frame;  // none: a message that is of no frame, alone
  std::int64_t log_stamp_ns = 0;       // of its first message
  std::int64_t capture_stamp_ns = 0;   // of that message, where it is of a frame
  std::vector<KeptMessage> messages;   // by rank of their topics, then in the file's order
};

// The frame that a message is of. Numbers begin again where capture_node is started anew: its time
// tells runs apart.
struct FrameId {
  std::uint64_t frame = 0;
  std::int64_t capture_stamp_ns = 0;
};
class FrameOf {
 public:
  explicit FrameOf(const Recording& recording) : recording_(recording) {}
  // Nothing where its type has no frame, or states one without being of it (a node's status), and
  // of keys' states.
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
  // A frame's messages stand in the file before the first message of the frame that comes so many
  // after it.
  static constexpr std::size_t kFramesAhead = 120;
  // Two messages of one frame number that were captured farther apart are of two runs, [ns].
  static constexpr std::int64_t kOneFrameTakes_ns = 2'000'000'000;

  // rank: of a topic; what a frame needs first has the lower one. The recording must outlive it.
  FrameGroups(const Recording& recording, Recording::Cursor cursor,
              std::function<int(const std::string& topic)> rank);

  // In the order of the frames' first messages. Throws mcap::McapError as Recording::Cursor does.
  std::optional<FrameGroup> next();
  // Messages whose frame had been handed out: they came as groups of their own.
  std::uint64_t late() const { return late_; }

 private:
  bool read_one();  // false at the end
  FrameGroup handed_out();

  Recording::Cursor cursor_;
  std::function<int(const std::string&)> rank_;
  FrameOf frame_of_;
  std::deque<FrameGroup> open_;
  std::size_t open_frames_ = 0;
  std::map<std::uint64_t, std::int64_t> handed_out_;  // frame -> capture stamp
  bool ended_ = false;
  std::uint64_t late_ = 0;
};

}  // namespace fivepipe::recording
