// The views in which the hull is reconstructed: the viewer's, and that of a light that casts
// shadows. A HullTile is keyed by the view's name.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "common/config/deployment.h"

namespace fivepipe::config {

struct HullView {
  std::string name;
  geometry::Pinhole recon;
  double near_m, far_m;
  // eye_from_world of a view that does not move; absent: that of the frame's HeadPose.
  std::optional<Eigen::Isometry3d> fixed = {};
};

// The name of the light's view. A viewer cannot have it, because names have no slash.
inline constexpr const char* kLightView = "light/0";

// Returns the light's view, or nullopt if the scene has no shadows.
std::optional<HullView> light_view(const Scene& scene);
// The pinhole of the light's map of virtual objects; the same view as that of the hull.
geometry::Pinhole shadow_map_pinhole(const ShadowView& shadows);

}  // namespace fivepipe::config
