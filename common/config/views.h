// The views in which the hull is reconstructed: one per eye of the viewer, that of a light that
// casts shadows, and one per eye of each spectator. A HullTile is keyed by the view's name.
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
  // frame's HeadPose, or on the path of a spectator.
  std::optional<Eigen::Isometry3d> fixed = {};
  double eye_x_m = 0;  // of an eye: its position along the head's x axis
};

// The name of the light's view. A viewer cannot have it, because names have no slash.
inline constexpr const char* kLightView = "light/0";
// The names of a stereo viewer's views end in these, left before right. The view of a viewer with
// one eye has the viewer's name. Spectators are viewers.
inline constexpr const char* kEyeSuffixes[] = {"/left", "/right"};

// Returns the views of each frame in the order of their reconstruction: the light's view if the
// scene has shadows, then the viewer's eyes, left before right. The eyes are last, because their
// tiles complete the frame.
std::vector<HullView> hull_views(const Scene& scene, const Viewer& viewer);
std::vector<HullView> hull_views(const Deployment& deployment);
// Returns the views of the viewer's eyes, left before right.
std::vector<HullView> eye_views(const Viewer& viewer);
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
