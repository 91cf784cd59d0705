// Joins the coverage of cameras with the frame sets of their maps. The memory is bounded: coverage
// of new frames displaces that of old ones.
#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "common/pipeline/frames/frame_set_assembler.h"
#include "common/pipeline/frames/recent_frames.h"
#include "common/pipeline/messages/camera_messages.h"

namespace fivepipe::node {

class CoverageJoiner {
 public:
  // Coverage of a camera and frame that is kept, by different writers: a process and the one that
  // replaces it. Further coverage displaces the oldest.
  static constexpr std::size_t kMaxWriters = 2;

  explicit CoverageJoiner(const config::Rig& rig) : rig_(rig) {}  // the rig must outlive it

  void add(std::uint64_t writer, messages::CameraCoverage coverage);
  // Returns true if the writers of a coverage and of a map belong to the same process.
  using IsSameProcess = std::function<bool(std::uint64_t, std::uint64_t)>;
  // Sets set.outlines to the coverage of the set's images: of the same camera, frame, capture stamp
  // and process. A silhouette without coverage has an empty outline; if none has any, there are no
  // outlines. Forgets the coverage of this frame and of smaller ones. Returns the cameras without
  // coverage.
  std::vector<std::string> join(frames::FrameSet& set, const IsSameProcess& is_same_process);
  void reset() { frames_.clear(); }

 private:
  struct Sent {
    std::uint64_t writer;
    messages::CameraCoverage coverage;
  };
  using OfFrame = std::map<std::size_t, std::vector<Sent>>;  // by camera

  const config::Rig& rig_;
  frames::RecentFrames<OfFrame> frames_{frames::FrameSetAssembler::kMaxIncompleteSets};
};

}  // namespace fivepipe::node
