// The frame sets of a recording, without DDS: what sim_node received; with what else belongs to the
// frame, if the caller requests it.
#pragma once
#include <optional>

#include "common/config/deployment.h"
#include "common/hull/colour_region.h"
#include "common/pipeline/frames/frame_set_assembler.h"
#include "common/pipeline/frames/recent_frames.h"
#include "common/recording/files/recording.h"

namespace fivepipe::replay {

// What to read besides the object-pixel maps. A recording may have none of it.
struct FrameExtras {
  bool colours = false;
  bool head_poses = false;
};

struct RecordedFrame {
  frames::FrameSet set;
  // Until the next complete frame, at most kMaxFrame_s; of the last frame: as the one before.
  double duration_s;
  double done;  // part of the recording's time that has been read, 0 to 1
  // If requested: of the cameras whose colour was recorded, and of the deployment's viewer.
  std::vector<hull::ColourRegion> colours = {};
  std::optional<Eigen::Isometry3d> eye_from_world = std::nullopt;
};

// A gap between two frames counts for no longer: nothing is known about the time after it.
inline constexpr double kMaxFrame_s = 0.2;

class RecordedFrames {
 public:
  // Borrows the recording. Throws recording::RecordingError if it has no object-pixel maps, or if
  // the type of a topic that is read differs from that of this build.
  RecordedFrames(const recording::Recording& recording, const config::Deployment& deployment,
                 const FrameExtras& extras = {});

  // Returns the complete frame sets in the order in which they became complete; nullopt at the end.
  // Skips bad messages, sets that stay incomplete, and damaged chunks of the file; drops() counts
  // them.
  std::optional<RecordedFrame> next();
  // By reason: those of FrameSetAssembler and of messages::BadMessage, and damaged_chunk.
  const std::map<std::string, std::uint64_t>& drops() const { return drops_; }
  // Describes the first bad message or damaged chunk; empty: there was none.
  const std::string& first_fault() const { return first_fault_; }
  // For a recording of which next() has returned no frame: the file, what a frame needs, what was
  // dropped, and how to find out more.
  std::string why_none() const;

 private:
  struct Extras {
    std::map<std::size_t, hull::ColourRegion> colours;  // by camera
    std::optional<Eigen::Isometry3d> eye_from_world;
  };
  // The extras of a frame may be recorded after its maps, but before those of the next frame.
  static constexpr std::size_t kMaxOpenExtras = 32;

  std::optional<frames::FrameSet> next_set();
  std::optional<recording::RecordedMessage> next_message();
  // Returns the sets that the map completes.
  std::vector<frames::FrameSet> add_map(const recording::RecordedMessage& message);
  void add_extra(const recording::RecordedMessage& message);
  void count(const std::string& reason, const std::string& fault);

  const recording::Recording& recording_;
  config::Rig rig_;
  std::string viewer_;
  recording::Recording::Cursor cursor_;
  frames::FrameSetAssembler assembler_;
  frames::RecentFrames<Extras> extras_{kMaxOpenExtras};
  std::optional<frames::FrameSet> waiting_;
  double last_duration_s_ = 0, done_ = 0;
  std::map<std::string, std::uint64_t> drops_;
  std::string first_fault_;
};

}  // namespace fivepipe::replay
