// Parts of the hull followed over frames: who is who, and how it moves. Nothing is guessed: where two could be the same, none is.
//
// A part is the one of the frame before that it lies nearest to, if that lies nearest to it, too, and both by a factor of kClearly; the part
// before is taken to have gone on as it moved. What met, or came apart, has new numbers, and says of whom.
//
// Velocity: the line through the middles over the last frames (least squares). Rotation: that of the principal axes (the covariance's), summed
// over the frames and fitted likewise; about an axis across which the part is round the shape tells nothing, and nothing is said. Both are those
// of the hull, whose excess over the object changes with its pose; docs/collision.md says by how much.
#pragma once
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "common/collision/hull_parts.h"

namespace fivepipe {

enum class PartOrigin {
  appeared,  // there was nothing where it came from, or nothing that it clearly was
  followed,  // the one of the frame before
  merged,    // of those in `from`
  split      // off the one in `from`
};

struct PartMotion {
  Eigen::Vector3d velocity_world_m_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_velocity_world_rad_s = Eigen::Vector3d::Zero();  // of what the shape determines
  int determined_axes = 0;   // 0, 2 or 3: about none; about those across its long, or short, axis; about all
  double window_s = 0;       // that it is an average over
  int frames = 0;            // in the window
};

struct FollowedPart {
  std::uint64_t id = 0;      // never given twice
  PartOrigin origin = PartOrigin::appeared;
  std::vector<std::uint64_t> from;   // numbers of the frame before
  HullPart part;
  std::optional<PartMotion> motion;  // from the third frame on
};

struct PartTrackerOptions {
  int window_frames = 8;          // >= 3
  double fastest_m_s = 6;         // nothing moves faster
};

class PartTracker {
 public:
  explicit PartTracker(const PartTrackerOptions& options = {});
  // The parts of one more frame. A time that is not later than the last starts anew. Throws std::invalid_argument where it is not finite.
  const std::vector<FollowedPart>& add(double time_s, const std::vector<HullPart>& parts);
  const std::vector<FollowedPart>& parts() const { return parts_; }
  void reset();

 private:
  struct Sample {
    double time_s;
    Eigen::Vector3d middle_world_m;
    Eigen::Vector3d turned_rad;  // sum of the turns since the part appeared
    Eigen::Matrix3d axes;        // columns: principal, least first; signs as in the sample before
    Eigen::Array3d defined;      // 1 where the axis is: its variance differs from both others
  };
  struct Track {
    std::deque<Sample> samples;
  };
  Eigen::Vector3d expected_m(std::size_t i, double time_s) const;
  std::vector<std::optional<std::size_t>> match(double time_s, const std::vector<HullPart>& parts) const;
  void extend(Track& track, double time_s, const HullPart& part) const;
  std::optional<PartMotion> motion_of(const Track& track) const;

  PartTrackerOptions options_;
  std::uint64_t next_id_ = 1;
  double time_s_ = 0;
  std::vector<FollowedPart> parts_;
  std::vector<Track> tracks_;  // as parts_
};

// How much nearer than the next best a match must be.
inline constexpr double kClearly = 2;

}  // namespace fivepipe
