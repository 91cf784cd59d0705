// The visual hull of synthetic actors from their exact silhouettes: for each camera, the union of
// the cones with the apex at the camera's centre that touch a capsule or a box. It uses no map and
// nothing of common/study, common/collision or the hull queries.
//
// The end of the hull along a direction has no closed form. Branch and bound finds it with a
// certified error: a cell is discarded if one camera's cones certainly miss it.
#pragma once
#include <span>
#include <variant>
#include <vector>

#include "common/geometry/camera.h"
#include "tests/study/truth/spacing_truth.h"

namespace fivepipe::test {

// The cone of one shape, in the frame of the world relative to the camera's centre.
class CapsuleCone {
 public:
  CapsuleCone(const hull::Capsule& capsule, const Eigen::Vector3d& eye_world_m);
  // True if no point of the ball is in the cone. `p` is relative to the camera's centre.
  bool misses(const Eigen::Vector3d& p_m, double ball_radius_m) const;

 private:
  Eigen::Vector3d a_m_, b_m_;
  double radius_m_, farthest_m_;
};
class BoxCone {
 public:
  BoxCone(const geometry::OrientedBox& box, const Eigen::Vector3d& eye_world_m);
  bool misses(const Eigen::Vector3d& p_m, double ball_radius_m) const;

 private:
  std::vector<Eigen::Vector3d> outward_;  // unit normals of the planes of the cone's faces
};

class ConeHull {
 public:
  ConeHull(std::span<const capture::SyntheticPart> parts,
           std::span<const geometry::Camera> cameras);

  // Ignores the borders of the images.
  bool contains(const Eigen::Vector3d& p_world_m) const;

  // min_m <= value <= max_m.
  struct Bound {
    double min_m, max_m;
  };
  // The highest point of the hull in the prism of the box's footprint, at heights of the interval,
  // in the frame of the box. Bounds are at most tolerance_m apart, unless the hull is so thin there
  // that no point of it is found. min_m is -infinity and max_m at most heights.low_m + tolerance_m
  // if the hull ends below that.
  Bound highest(const BoxOnAxis& box, const SpacingInterval& heights, double tolerance_m) const;
  // The lowest one, the other way round.
  Bound lowest(const BoxOnAxis& box, const SpacingInterval& heights, double tolerance_m) const;

 private:
  struct View {
    Eigen::Vector3d eye_world_m;
    std::vector<std::variant<CapsuleCone, BoxCone>> cones;
  };
  // The cones of each camera that may meet a cell.
  using Candidates = std::vector<std::vector<int>>;
  bool narrow(Candidates& candidates, const Eigen::Vector3d& center_m, double radius_m) const;
  std::vector<View> views_;
};

}  // namespace fivepipe::test
