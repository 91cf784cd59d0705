// The edges of drawn shadows beside their closed form.
#pragma once
#include "benchmarks/render/oracle/plate_shadow.h"

namespace fivepipe::render_bench {

struct ShadowErrors {
  render::plate_shadow::EdgeError of_object, of_hull;
};

// Draws the shadow of a virtual plate, and of the hull of such a plate that is moved by `moved_m`,
// in the viewer's image. The scene and its light's view are those of plate_shadow.h, not those that
// the suite times. Needs a current GL context.
ShadowErrors shadow_errors(const config::Viewer& viewer,
                           const Eigen::Vector3d& moved_m = Eigen::Vector3d::Zero());

}  // namespace fivepipe::render_bench
