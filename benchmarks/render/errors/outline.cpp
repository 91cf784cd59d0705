#include "benchmarks/render/errors/outline.h"

#include <cmath>
#include <stdexcept>

namespace fivepipe::render_bench {
namespace {

using Eigen::Vector2d;

// An outline has this many points per pixel, so that the distance to its nearest point exceeds that
// to the outline itself by at most an eighth of a pixel.
constexpr int kPointsPerPixel = 4;

// Sum of the area's pixels.
struct Area {
  Vector2d sum_px = Vector2d::Zero();
  double pixels = 0;
  void add(int u_px, int v_px) {
    sum_px += Vector2d(u_px, v_px);
    pixels += 1;
  }
  ShownShape shape(std::vector<OutlinePoint> outline) const {
    if (outline.empty()) throw std::runtime_error("the image shows no outline of the object");
    double sum_inverse_depth = 0;
    for (const OutlinePoint& point : outline) sum_inverse_depth += 1 / point.depth_m;
    const double depth_m = double(outline.size()) / sum_inverse_depth;
    return {std::move(outline), sum_px / pixels, depth_m};
  }
};

// Adds the edge between a pixel and its neighbour, which are on different sides of the outline.
void add_edge(std::vector<OutlinePoint>& outline, const Vector2d& pixel, const Vector2d& neighbour,
              double depth_m) {
  const Vector2d step = neighbour - pixel, along(-step.y(), step.x());
  for (int i = 0; i < kPointsPerPixel; ++i)
    outline.push_back({pixel + 0.5 * step + (double(i) / kPointsPerPixel - 0.5) * along, depth_m,
                       i == kPointsPerPixel / 2});
}

// The point between `inside` and `outside` at which the line of sight leaves the object's image.
Vector2d crossing(std::span<const hull::Capsule> object, const geometry::Camera& camera,
                  Vector2d inside, Vector2d outside) {
  constexpr double kExact_px = 1e-3;
  while ((outside - inside).norm() > kExact_px) {
    const Vector2d center = 0.5 * (inside + outside);
    (hull::in_silhouette(object, camera, center) ? inside : outside) = center;
  }
  return inside;
}

double distance_px(const Vector2d& at_px, const std::vector<OutlinePoint>& outline) {
  double squared = INFINITY;
  for (const OutlinePoint& point : outline)
    squared = std::min(squared, (point.at_px - at_px).squaredNorm());
  return std::sqrt(squared);
}

}  // namespace

ShownShape shape_of(const Drawn& drawn) {
  std::vector<OutlinePoint> outline;
  Area area;
  const cv::Mat& depth_m = drawn.depth_m;
  for (int v = 0; v < depth_m.rows; ++v)
    for (int u = 0; u < depth_m.cols; ++u) {
      const float z_m = depth_m.at<float>(v, u);
      if (z_m == hull::kNoHull) continue;
      area.add(u, v);
      for (const auto& [du, dv] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
        const int nu = u + du, nv = v + dv;
        if (nu < 0 || nv < 0 || nu >= depth_m.cols || nv >= depth_m.rows ||
            depth_m.at<float>(nv, nu) != hull::kNoHull)
          continue;
        add_edge(outline, Vector2d(u, v), Vector2d(nu, nv), z_m);
      }
    }
  return area.shape(std::move(outline));
}

// The crossings of the outline with the rows and columns of a grid of kPointsPerPixel per pixel.
ShownShape true_shape(std::span<const hull::Capsule> object, const geometry::Camera& camera) {
  const geometry::Pinhole& k = camera.pinhole;
  const geometry::Camera fine{
      geometry::resized(k, kPointsPerPixel * k.width_px, kPointsPerPixel * k.height_px),
      camera.camera_from_world};
  const hull::ObjectPixels pixels = hull::true_object_pixels(object, fine, hull::PixelRule::center);
  const auto in_image_px = [](int u, int v) {
    return Vector2d((u + 0.5) / kPointsPerPixel - 0.5, (v + 0.5) / kPointsPerPixel - 0.5);
  };
  std::vector<OutlinePoint> outline;
  const hull::PixelRect bounds = pixels.bounds();
  for (int v = bounds.v0_px; v < bounds.v1_px; ++v)
    for (int u = bounds.u0_px; u < bounds.u1_px; ++u) {
      if (!pixels.contains(u, v)) continue;
      for (const auto& [du, dv] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
        const int nu = u + du, nv = v + dv;
        if (nu < 0 || nv < 0 || nu >= pixels.width_px() || nv >= pixels.height_px() ||
            pixels.contains(nu, nv))
          continue;
        const Vector2d at_px = crossing(object, camera, in_image_px(u, v), in_image_px(nu, nv));
        if (const auto depth_m = true_depth_m(object, geometry::ray_through(camera, at_px)))
          outline.push_back({at_px, *depth_m, (du != 0 ? v : u) % kPointsPerPixel == 0});
      }
    }
  Area area;
  for (int v = 0; v < k.height_px; ++v)
    for (int u = 0; u < k.width_px; ++u)
      if (hull::in_silhouette(object, camera, Vector2d(u, v))) area.add(u, v);
  return area.shape(std::move(outline));
}

std::vector<double> outline_distances_mm(const ShownShape& a, const ShownShape& b,
                                         double focal_px) {
  std::vector<double> distances_mm;
  for (const auto& [from, to] : {std::pair{&a, &b}, {&b, &a}})
    for (const OutlinePoint& point : from->outline)
      if (point.is_counted)
        distances_mm.push_back(1e3 * distance_px(point.at_px, to->outline) * point.depth_m /
                               focal_px);
  return distances_mm;
}

double centroid_distance_mm(const ShownShape& a, const ShownShape& b, double focal_px) {
  return 1e3 * (a.centroid_px - b.centroid_px).norm() * 0.5 * (a.depth_m + b.depth_m) / focal_px;
}

}  // namespace fivepipe::render_bench
