// The spacings at which a part is where the hull can be. At other spacings, part of it is where no
// hull can be, so it is free there, whatever was there.
#pragma once
#include <optional>
#include <span>

#include "common/collision/spacing/spacing_sweep.h"
#include "common/geometry/camera.h"

namespace fivepipe::collision {

// Returns the spacings of the range at which the whole part is in the box and in the image of each
// camera; nullopt if there is none. Exact to rounding: each condition is linear in the spacing.
std::optional<SpacingInterval> interval_in_view(const MovablePart& part,
                                                const SpacingInterval& range,
                                                std::span<const geometry::Camera> cameras,
                                                const Eigen::AlignedBox3d& within_world_m);

}  // namespace fivepipe::collision
