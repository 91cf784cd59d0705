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

struct OwnedMessage {
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
  std::vector<OwnedMessage> messages;  // by rank of their topics, then in the file's order
};

// The frame that a message is of. Numbers begin again where capture_node is started anew: its time
// tells runs apart.
struct FrameId {
  std::uint64_t frame = 0;
  std::int64_t capture_stamp_ns = 0;
};
class FrameIdReader {
 public:
  explicit FrameIdReader(const Recording& recording) : recording_(recording) {}
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
  static constexpr std::size_t kReorderWindow_frames = 120;
  // Two messages of one frame number that were captured farther apart are of two runs, [ns].
  static constexpr std::int64_t kMaxFrameSpan_ns = 2'000'000'000;

  // rank: of a topic; what a frame needs first has the lower one. The recording must outlive it.
  FrameGroups(const Recording& recording, Recording::Cursor cursor,
              std::function<int(const std::string& topic)> rank);

  // In the order of the frames' first messages. Throws mcap::McapError as Recording::Cursor does.
  std::optional<FrameGroup> next();
  // Messages whose frame had been handed out: they came as groups of their own.
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
