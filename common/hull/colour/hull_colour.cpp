#include "common/hull/colour/hull_colour.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace fivepipe::hull {
namespace {

// A sum of weighted colours and the sum of the weights.
struct WeightedBgr {
  Eigen::Vector3d bgr = Eigen::Vector3d::Zero();
  double weight = 0;
};

// Positions beyond this limit are outside of every image. Below it, they fit into an int.
constexpr double kMaxPosition_px = 1e9;

// Interpolates between the four pixels around uv_px. Pixels without colour, and pixels outside
// `object` if it is not null, have weight 0.
WeightedBgr bilinear(const ColourRegion& colour, const ObjectPixels* object,
                     const Eigen::Vector2d& uv_px) {
  if (!(uv_px.cwiseAbs().sum() < kMaxPosition_px)) return {};
  const PixelRect& r = colour.region;
  const int u0 = int(std::floor(uv_px.x())), v0 = int(std::floor(uv_px.y()));
  const double right = uv_px.x() - u0, down = uv_px.y() - v0;
  WeightedBgr sum;
  for (int corner = 0; corner < 4; ++corner) {
    const int u = u0 + (corner & 1), v = v0 + (corner >> 1);
    if (!colour.pixels.contains(u, v) || (object && !object->contains(u, v))) continue;
    const double weight = (corner & 1 ? right : 1 - right) * (corner >> 1 ? down : 1 - down);
    const std::uint8_t* bgr =
        &colour.bgr[3 * (std::size_t(v - r.v0_px) * std::size_t(r.width_px()) +
                         std::size_t(u - r.u0_px))];
    sum.bgr += weight * Eigen::Vector3d(bgr[0], bgr[1], bgr[2]);
    sum.weight += weight;
  }
  return sum;
}

double sixteenth_power(double x) {
  for (int i = 0; i < 4; ++i) x *= x;
  return x;
}

Eigen::Matrix<double, 3, 4> projection_of(const geometry::Camera& camera) {
  Eigen::Matrix3d k;
  k << camera.pinhole.fx_px, 0, camera.pinhole.cx_px, 0, camera.pinhole.fy_px, camera.pinhole.cy_px,
      0, 0, 1;
  return k * camera.camera_from_world.matrix().topRows<3>();
}

bool same_camera(const geometry::Camera& a, const geometry::Camera& b) {
  return a.pinhole == b.pinhole && a.camera_from_world.matrix() == b.camera_from_world.matrix();
}

}  // namespace

HullColour::HullColour(std::span<const Silhouette> silhouettes,
                       std::span<const ColourRegion> regions, const HullRule& rule)
    : silhouettes_(silhouettes), rule_(rule) {
  for (const Silhouette& s : silhouettes) projections_.push_back(projection_of(s.camera));
  for (const ColourRegion& region : regions) {
    assert(region.bgr.size() == region.region.area_px() * 3 &&
           intersection(region.region, region.pixels.bounds()) == region.pixels.bounds());
    const auto silhouette =
        std::find_if(silhouettes.begin(), silhouettes.end(),
                     [&](const Silhouette& s) { return same_camera(s.camera, region.camera); });
    Image image{&region,
                silhouette == silhouettes.end() ? nullptr : &silhouette->pixels,
                std::size_t(silhouette - silhouettes.begin()),
                geometry::camera_center_world_m(region.camera),
                {}};
    for (const auto& projection : projections_)
      image.center_seen.push_back(projection * image.center_world_m.homogeneous());
    images_.push_back(std::move(image));
  }
}

HullColour::Sight HullColour::sight(std::size_t silhouette, const Homogeneous& seen) const {
  if (!(seen.z() > 0)) return Sight::unseen;
  const ObjectPixels& pixels = silhouettes_[silhouette].pixels;
  const double u_px = seen.x() / seen.z(), v_px = seen.y() / seen.z();
  if (pixels.contains_at(u_px, v_px)) return Sight::object;
  return pixels.holds(u_px, v_px) ? Sight::empty : Sight::unseen;
}

// Returns whether the point at this fraction of the way to the image's camera is in the hull, by
// all silhouettes but the image's own.
bool HullColour::is_in_hull(std::size_t own, double fraction, const Image& image,
                            std::span<const Homogeneous> p_seen) const {
  int seen = own < silhouettes_.size() ? 1 : 0;
  for (std::size_t s = 0; s < silhouettes_.size(); ++s) {
    if (s == own) continue;
    const Sight at = sight(s, (1 - fraction) * p_seen[s] + fraction * image.center_seen[s]);
    if (at == Sight::empty || (at == Sight::unseen && rule_.limits == Limits::all)) return false;
    seen += at == Sight::object;
  }
  return rule_.limits == Limits::all || seen >= rule_.min_seen;
}

// Returns the factor on the weight of an image for a hull point: 1, kDoubtfulWeight or
// kHiddenWeight. All points of the line of sight project to the same pixel of the image's own
// silhouette, so it is tested once, at the point.
double HullColour::visibility(const Image& image, const Eigen::Vector3d& p_world_m,
                              std::span<const Homogeneous> p_seen) const {
  if (image.object && sight(image.silhouette, p_seen[image.silhouette]) != Sight::object)
    return 1.0;
  const double length_m = (image.center_world_m - p_world_m).norm();
  const auto is_occluded_at = [&](double distance_m) {
    return distance_m < length_m && !silhouettes_.empty() &&
           is_in_hull(image.silhouette, distance_m / length_m, image, p_seen);
  };
  if (std::any_of(kOcclusionProbes_m.begin() + 1, kOcclusionProbes_m.end(), is_occluded_at))
    return kHiddenWeight;
  return is_occluded_at(kOcclusionProbes_m.front()) ? kDoubtfulWeight : 1.0;
}

std::array<std::uint8_t, 3> HullColour::at(const Eigen::Vector3d& p_world_m,
                                           const Eigen::Vector3d& eye_world_m) const {
  // Thread-local to reuse their memory. by_weight is sorted by decreasing weight.
  thread_local std::vector<Homogeneous> p_seen;  // by silhouette
  thread_local std::vector<std::pair<double, const Image*>> by_weight;
  p_seen.clear();
  for (const auto& projection : projections_)
    p_seen.push_back(projection * p_world_m.homogeneous());
  by_weight.clear();
  const Eigen::Vector3d to_eye = (eye_world_m - p_world_m).normalized();
  for (const Image& image : images_)
    by_weight.emplace_back(
        sixteenth_power(0.5 * (1 + (image.center_world_m - p_world_m).normalized().dot(to_eye))),
        &image);
  std::stable_sort(by_weight.begin(), by_weight.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  WeightedBgr sum;
  std::size_t left = by_weight.size();
  for (const auto& [view_weight, image] : by_weight) {
    if (view_weight * double(left--) < kNegligibleFraction * sum.weight) break;
    const auto uv_px = geometry::project(image->region->camera, p_world_m);
    if (!uv_px) continue;
    const WeightedBgr sample = bilinear(*image->region, image->object, *uv_px);
    if (!(sample.weight > 0)) continue;
    const double weight = view_weight * visibility(*image, p_world_m, p_seen);
    sum.bgr += weight * sample.bgr;
    sum.weight += weight * sample.weight;
  }
  if (!(sum.weight > 0)) return kUnseenBgr;
  std::array<std::uint8_t, 3> bgr;
  for (int c = 0; c < 3; ++c)
    bgr[std::size_t(c)] = std::uint8_t(std::lround(sum.bgr[c] / sum.weight));
  return bgr;
}

}  // namespace fivepipe::hull
