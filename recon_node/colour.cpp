#include "recon_node/colour.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace fivepipe {
namespace {

// Pixel centres of the region around uv; nothing where uv lies outside the region's pixels.
std::optional<std::array<std::uint8_t, 3>> bilinear(const ColourRegion& colour, const Eigen::Vector2d& uv_px) {
  const PixelRect& r = colour.region;
  if (!(uv_px.x() >= r.u0_px - 0.5 && uv_px.y() >= r.v0_px - 0.5 && uv_px.x() < r.u1_px - 0.5 && uv_px.y() < r.v1_px - 0.5)) return std::nullopt;
  const double u = std::clamp(uv_px.x() - r.u0_px, 0.0, double(r.width_px() - 1)), v = std::clamp(uv_px.y() - r.v0_px, 0.0, double(r.height_px() - 1));
  const int u0 = int(u), v0 = int(v), u1 = std::min(u0 + 1, r.width_px() - 1), v1 = std::min(v0 + 1, r.height_px() - 1);
  const double right = u - u0, down = v - v0;
  std::array<std::uint8_t, 3> bgr;
  for (int c = 0; c < 3; ++c) {
    const auto at = [&](int x, int y) { return double(colour.bgr[(std::size_t(y) * r.width_px() + x) * 3 + c]); };
    const double top = at(u0, v0) + right * (at(u1, v0) - at(u0, v0)), bottom = at(u0, v1) + right * (at(u1, v1) - at(u0, v1));
    bgr[c] = std::uint8_t(top + down * (bottom - top) + 0.5);
  }
  return bgr;
}

}  // namespace

HullColour::HullColour(std::span<const Silhouette> silhouettes, std::span<const ColourRegion> regions) : silhouettes_(silhouettes) {
  for (const ColourRegion& region : regions) {
    assert(region.bgr.size() == region.region.area_px() * 3);
    images_.push_back({&region, camera_center_world_m(region.camera)});
  }
}

bool HullColour::hidden(const Eigen::Vector3d& p_world_m, const Eigen::Vector3d& camera_world_m) const {
  const Eigen::Vector3d way = camera_world_m - p_world_m;
  const double length_m = way.norm();
  return std::any_of(kOcclusionProbes_m.begin(), kOcclusionProbes_m.end(), [&](double distance_m) {
    return distance_m < length_m && in_hull(silhouettes_, p_world_m + distance_m / length_m * way);
  });
}

std::array<std::uint8_t, 3> HullColour::at(const Eigen::Vector3d& p_world_m, const Eigen::Vector3d& eye_world_m) const {
  const Eigen::Vector3d to_eye = (eye_world_m - p_world_m).normalized();
  std::array<std::uint8_t, 3> best = kUnseenBgr;
  bool best_hidden = true;
  double best_cosine = -2;
  for (const Image& image : images_) {
    const double cosine = (image.centre_world_m - p_world_m).normalized().dot(to_eye);
    if (!best_hidden && !(cosine > best_cosine)) continue;
    const auto uv_px = project(image.region->camera, p_world_m);
    const auto bgr = uv_px ? bilinear(*image.region, *uv_px) : std::nullopt;
    if (!bgr) continue;
    const bool is_hidden = hidden(p_world_m, image.centre_world_m);
    if (is_hidden < best_hidden || (is_hidden == best_hidden && cosine > best_cosine)) {
      best = *bgr;
      best_hidden = is_hidden;
      best_cosine = cosine;
    }
  }
  return best;
}

}  // namespace fivepipe
