#include "recon_node/colour.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace fivepipe {
namespace {

// Colour times weight, and the weight: how much of the four pixels around the point are there and of the object.
struct WeightedBgr {
  Eigen::Vector3d bgr = Eigen::Vector3d::Zero();
  double weight = 0;
};

// uv_px rounded towards the pixel centres to its lower left; the pixels beyond the region's border take no part.
WeightedBgr bilinear(const ColourRegion& colour, const ObjectPixels* object, const Eigen::Vector2d& uv_px) {
  const PixelRect& r = colour.region;
  if (!(uv_px.x() >= r.u0_px - 0.5 && uv_px.y() >= r.v0_px - 0.5 && uv_px.x() < r.u1_px - 0.5 && uv_px.y() < r.v1_px - 0.5)) return {};
  const int u0 = int(std::floor(uv_px.x())), v0 = int(std::floor(uv_px.y()));
  const double right = uv_px.x() - u0, down = uv_px.y() - v0;
  WeightedBgr sum;
  for (int corner = 0; corner < 4; ++corner) {
    const int u = u0 + (corner & 1), v = v0 + (corner >> 1);
    if (u < r.u0_px || v < r.v0_px || u >= r.u1_px || v >= r.v1_px || (object && !object->contains(u, v))) continue;
    const double weight = (corner & 1 ? right : 1 - right) * (corner >> 1 ? down : 1 - down);
    const std::uint8_t* bgr = &colour.bgr[3 * (std::size_t(v - r.v0_px) * std::size_t(r.width_px()) + std::size_t(u - r.u0_px))];
    sum.bgr += weight * Eigen::Vector3d(bgr[0], bgr[1], bgr[2]);
    sum.weight += weight;
  }
  return sum;
}

double sixteenth_power(double x) {
  for (int i = 0; i < 4; ++i) x *= x;
  return x;
}

bool same_camera(const Camera& a, const Camera& b) { return a.pinhole == b.pinhole && a.camera_from_world.matrix() == b.camera_from_world.matrix(); }

}  // namespace

HullColour::HullColour(std::span<const Silhouette> silhouettes, std::span<const ColourRegion> regions) : silhouettes_(silhouettes) {
  for (const ColourRegion& region : regions) {
    assert(region.bgr.size() == region.region.area_px() * 3);
    const auto silhouette = std::find_if(silhouettes.begin(), silhouettes.end(), [&](const Silhouette& s) { return same_camera(s.camera, region.camera); });
    images_.push_back({&region, silhouette == silhouettes.end() ? nullptr : &silhouette->pixels, camera_center_world_m(region.camera)});
  }
}

double HullColour::visibility(const Eigen::Vector3d& p_world_m, const Eigen::Vector3d& camera_world_m) const {
  const Eigen::Vector3d way = camera_world_m - p_world_m;
  const double length_m = way.norm();
  const auto in_the_way = [&](double distance_m) { return distance_m < length_m && in_hull(silhouettes_, p_world_m + distance_m / length_m * way); };
  if (std::any_of(kOcclusionProbes_m.begin() + 1, kOcclusionProbes_m.end(), in_the_way)) return kHiddenWeight;
  return in_the_way(kOcclusionProbes_m.front()) ? kDoubtfulWeight : 1.0;
}

std::array<std::uint8_t, 3> HullColour::at(const Eigen::Vector3d& p_world_m, const Eigen::Vector3d& eye_world_m) const {
  const Eigen::Vector3d to_eye = (eye_world_m - p_world_m).normalized();
  WeightedBgr sum;
  for (const Image& image : images_) {
    const auto uv_px = project(image.region->camera, p_world_m);
    if (!uv_px) continue;
    const WeightedBgr sample = bilinear(*image.region, image.object, *uv_px);
    if (!(sample.weight > 0)) continue;
    const double cosine = (image.centre_world_m - p_world_m).normalized().dot(to_eye);
    const double weight = sixteenth_power(0.5 * (1 + cosine)) * visibility(p_world_m, image.centre_world_m);
    sum.bgr += weight * sample.bgr;
    sum.weight += weight * sample.weight;
  }
  if (!(sum.weight > 0)) return kUnseenBgr;
  std::array<std::uint8_t, 3> bgr;
  for (int c = 0; c < 3; ++c) bgr[std::size_t(c)] = std::uint8_t(std::lround(std::clamp(sum.bgr[c] / sum.weight, 0.0, 255.0)));
  return bgr;
}

}  // namespace fivepipe
