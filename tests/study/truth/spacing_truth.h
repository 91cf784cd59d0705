// Ground truth of a spacing study, in closed form: at which spacings does a box, moved along one of
// its edges, meet a shape of a synthetic actor?
//
//      prism          The box moves along z in its own frame, so it meets the shape exactly if its
//    |       |        interval of heights meets that of the shape clipped to the prism of the box's
//    |  .-.  |  z_max footprint. Both are convex, so the spacings are one interval:
//    | ( o ) |        [z_min - half height, z_max + half height].
//    |  '-'  |  z_min
//    | +---+ |  box
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "capture_node/synthetic/actors/part.h"
#include "common/collision/spacing/spacing_sweep.h"

namespace fivepipe::test {

using collision::SpacingInterval;

// A solid box at spacing 0. A positive spacing moves it along the z axis of the box's frame.
struct BoxOnAxis {
  Eigen::Isometry3d world_from_box;
  Eigen::Vector3d half_m;
};
// The same box, turned so that its z axis is axis_world, which is one of its edges' directions.
// Throws std::invalid_argument if it is none.
BoxOnAxis box_on_axis(const Eigen::Isometry3d& world_from_box, const Eigen::Vector3d& size_m,
                      const Eigen::Vector3d& axis_world);

// The heights, in the frame of the box [m], at which the shape is in the prism of its footprint;
// nullopt if it is nowhere there. Exact to rounding.
std::optional<SpacingInterval> heights_in_prism(const BoxOnAxis& box,
                                                const capture::SyntheticPart& part);

// The spacings at which the box meets a part: sorted, disjoint intervals.
std::vector<SpacingInterval> colliding_spacings(const BoxOnAxis& box,
                                                std::span<const capture::SyntheticPart> parts);
// Sorts the intervals and joins those that overlap.
std::vector<SpacingInterval> united(std::vector<SpacingInterval> intervals);
// The part of the range outside the intervals, which are sorted and disjoint.
std::vector<SpacingInterval> complement(std::span<const SpacingInterval> intervals,
                                        const SpacingInterval& range);

}  // namespace fivepipe::test
