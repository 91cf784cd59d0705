// How deep a part collides with the hull of a frame: how far it would have to be moved until it is
// free in that frame. Verdicts are on the part's surface (spacing_sweep.h).
#pragma once
#include <vector>

#include "common/collision/spacing/movable_part.h"
#include "common/collision/spacing/spacing_sweep.h"
#include "common/study/frame_hull.h"
#include "common/study/spacing_study.h"

namespace fivepipe::study {

class PartDepth {
 public:
  // Of moves along the part's axis to a spacing of the range. world_from_part: the pose at spacing
  // 0. Throws std::invalid_argument as MovablePart does, and if the range descends or exceeds
  // kMaxSpacing_m.
  PartDepth(const geometry::Mesh& mesh, const Eigen::Isometry3d& world_from_part,
            const Eigen::Vector3d& axis_world, const collision::SpacingInterval& range);
  // Of moves along x, y or z of the world, to either side: the shortest one. world_from_part: the
  // pose at spacing 0, the only one.
  PartDepth(const geometry::Mesh& mesh, const Eigen::Isometry3d& world_from_part);

  // Bounds of the distance to the nearest spacing at which the part is free, as
  // LayoutResult::penetration. Without an axis, max_m is infinite if no move of at most
  // kMaxMove_m is certified to free the part. Several threads may call it at once, each with its
  // own hull, which is not unknown.
  Bracket operator()(FrameHull& hull, double spacing_m) const;

 private:
  struct Line {
    collision::MovablePart part;
    collision::SpacingInterval searched;   // finite
    collision::SpacingInterval permitted;  // beyond, there is no layout; may be infinite
  };
  static Bracket along(const Line& line, FrameHull& hull, double spacing_m, double at_most_m);
  std::vector<Line> lines_;
};

// Of a part without an axis.
inline constexpr double kMaxMove_m = 0.5;

}  // namespace fivepipe::study
