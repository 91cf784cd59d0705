// The frame sets of a recording, without DDS: what sim_node received.
#pragma once
#include <optional>

#include "common/config/deployment.h"
#include "common/pipeline/frames/frame_set_assembler.h"
#include "common/recording/files/recording.h"

namespace fivepipe::study {

struct RecordedFrame {
  frames::FrameSet set;
  // Until the next complete frame, at most kMaxFrame_s; of the last frame: as the one before.
  double duration_s;
  double done;  // part of the recording's time that has been read, 0 to 1
};

// A gap between two frames counts for no longer: nothing is known about the time after it.
inline constexpr double kMaxFrame_s = 0.2;

class RecordedFrames {
 public:
  // Borrows the recording. Throws recording::RecordingError if it has no object-pixel maps, or if
  // their type differs from that of this build.
  RecordedFrames(const recording::Recording& recording, const config::Deployment& deployment);

  // Returns the complete frame sets in the order in which they became complete; nullopt at the end.
  // Skips bad messages, sets that stay incomplete, and damaged chunks of the file; drops() counts
  // them.
  std::optional<RecordedFrame> next();
  // By reason: those of FrameSetAssembler and of messages::BadMessage, and damaged_chunk.
  const std::map<std::string, std::uint64_t>& drops() const { return drops_; }
  // Describes the first bad message or damaged chunk; empty: there was none.
  const std::string& first_fault() const { return first_fault_; }

 private:
  std::optional<frames::FrameSet> next_set();
  std::optional<recording::RecordedMessage> next_message();
  void count(const std::string& reason, const std::string& fault);

  const recording::Recording& recording_;
  config::Rig rig_;
  recording::Recording::Cursor cursor_;
  frames::FrameSetAssembler assembler_;
  std::optional<frames::FrameSet> waiting_;
  double last_duration_s_ = 0, done_ = 0;
  std::map<std::string, std::uint64_t> drops_;
  std::string first_fault_;
};

}  // namespace fivepipe::study
