// The parts of the real objects that synthetic cameras see.
#pragma once
#include <variant>

#include "common/geometry/oriented_box.h"
#include "common/hull/oracle/analytic.h"

namespace fivepipe::capture {

enum class Material { skin, sleeve, pipe, wood, cord, connector, tongs };

struct SyntheticPart {
  std::variant<hull::Capsule, geometry::OrientedBox> shape;  // world frame
  Material material;
};

// Returns the part, moved.
SyntheticPart moved(const Eigen::Isometry3d& motion, SyntheticPart part);

}  // namespace fivepipe::capture
