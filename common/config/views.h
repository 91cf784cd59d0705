// The views in which the hull is reconstructed: one per eye of the viewer, and that of a light that
// casts shadows. A HullTile is keyed by the view's name.
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
  // eye_from_world of a light's view, which does not move; absent: an eye, which moves with the
  // frame's HeadPose.
  std::optional<Eigen::Isometry3d> fixed = {};
  double eye_x_m = 0;  // of an eye: its position along the head's x axis
};

// The name of the light's view. A viewer cannot have it, because names have no slash.
inline constexpr const char* kLightView = "light/0";
// The names of a stereo viewer's views end in these, left before right. The view of a viewer with
// one eye has the viewer's name.
inline constexpr const char* kEyeSuffixes[] = {"/left", "/right"};

// Returns the views of each frame in the order of their reconstruction: the light's view if the
// scene has shadows, then the viewer's eyes, left before right. The eyes are last, because their
// tiles complete the frame.
std::vector<HullView> hull_views(const Deployment& deployment);
// Returns the light's view, or nullopt if the scene has no shadows.
std::optional<HullView> light_view(const Scene& scene);
// Returns eye_from_world of the view in a frame.
Eigen::Isometry3d eye_from_world(const HullView& view, const Eigen::Isometry3d& head_from_world);
// Returns true if a view of this name belongs to the viewer, whether or not it is stereo.
bool is_view_of(const Viewer& viewer, const std::string& name);

// Returns the pinhole of the light's map of virtual objects. It has the field of view of the
// light's view of the hull.
geometry::Pinhole shadow_map_pinhole(const ShadowView& shadows);

}  // namespace fivepipe::config
