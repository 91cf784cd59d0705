#include "common/collision/detection/box_query.h"

#include <algorithm>
#include <cmath>

namespace fivepipe::collision {
namespace {

// Bound of the rounding error of a projection in double [px]: below 1e-11 for images of 1e4 px.
constexpr double kProjectionRounding_px = 1e-6;

// False for an empty rectangle: its masks have no common bit, or no word is between them.
bool any_object_pixel(const hull::ObjectPixels& pixels, const hull::PixelRect& rect) {
  const int first = rect.u0_px >> 6, last = (rect.u1_px - 1) >> 6;
  const std::uint64_t first_mask = ~std::uint64_t(0) << (rect.u0_px & 63),
                      last_mask = ~std::uint64_t(0) >> (63 - ((rect.u1_px - 1) & 63));
  for (int v = rect.v0_px; v < rect.v1_px; ++v) {
    const auto row = pixels.words().subspan(std::size_t(v) * pixels.words_per_row(),
                                            std::size_t(pixels.words_per_row()));
    for (int w = first; w <= last; ++w)
      if (row[w] & (w == first ? first_mask : ~std::uint64_t(0)) &
          (w == last ? last_mask : ~std::uint64_t(0)))
        return true;
  }
  return false;
}

// The pixels from that of lowest_px to that of highest_px within the image: [first, second).
std::pair<int, int> pixel_range(double lowest_px, double highest_px, int size_px) {
  const auto index = [&](double px) {
    return int(std::clamp(std::floor(px + 0.5), -1.0, double(size_px)));
  };
  return {std::max(0, index(lowest_px - kProjectionRounding_px)),
          std::min(size_px, index(highest_px + kProjectionRounding_px) + 1)};
}

// A camera's view of a box. object: it may see a point of the box on its object. whole: it
// certainly sees every point of the box.
struct BoxView {
  bool object, whole;
};
BoxView view_of(const hull::Silhouette& s, const Eigen::AlignedBox3d& box_world_m) {
  Eigen::AlignedBox2d image_box_px;
  int behind = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const auto uv_px =
        geometry::project(s.camera, box_world_m.corner(Eigen::AlignedBox3d::CornerType(corner)));
    uv_px ? void(image_box_px.extend(*uv_px)) : void(++behind);
  }
  if (behind == 8) return {false, false};
  if (behind > 0) return {true, false};  // the projection is unbounded
  const auto [u0, u1] =
      pixel_range(image_box_px.min().x(), image_box_px.max().x(), s.pixels.width_px());
  const auto [v0, v1] =
      pixel_range(image_box_px.min().y(), image_box_px.max().y(), s.pixels.height_px());
  const auto in_image = [&](const Eigen::Vector2d& low_px, const Eigen::Vector2d& high_px) {
    return s.pixels.holds(low_px.x() - kProjectionRounding_px,
                          low_px.y() - kProjectionRounding_px) &&
           s.pixels.holds(high_px.x() + kProjectionRounding_px,
                          high_px.y() + kProjectionRounding_px);
  };
  return {any_object_pixel(s.pixels, {u0, v0, u1, v1}),
          in_image(image_box_px.min(), image_box_px.max())};
}

// Returns true only if the cameras certify the box free.
bool is_certified(std::span<const hull::Silhouette> silhouettes,
                  const Eigen::AlignedBox3d& box_world_m, const hull::HullRule& rule) {
  if (!rule.within_world_m.intersects(box_world_m)) return true;
  const bool all = rule.limits == hull::Limits::all;
  int may_see = 0;
  for (const hull::Silhouette& s : silhouettes) {
    const BoxView view = view_of(s, box_world_m);
    if (!view.object && (all || view.whole)) return true;
    may_see += view.object;
  }
  return !all && may_see < rule.min_seen;
}

}  // namespace

bool is_certainly_free(std::span<const hull::Silhouette> silhouettes,
                       const Eigen::AlignedBox3d& box_world_m, int depth,
                       const hull::HullRule& rule) {
  if (silhouettes.empty() || is_certified(silhouettes, box_world_m, rule)) return true;
  if (depth == 0) return false;
  for (int octant = 0; octant < 8; ++octant) {
    const Eigen::Vector3d corner_world_m =
                              box_world_m.corner(Eigen::AlignedBox3d::CornerType(octant)),
                          center_world_m = box_world_m.center();
    if (!is_certainly_free(
            silhouettes,
            {corner_world_m.cwiseMin(center_world_m), corner_world_m.cwiseMax(center_world_m)},
            depth - 1, rule))
      return false;
  }
  return true;
}

}  // namespace fivepipe::collision
