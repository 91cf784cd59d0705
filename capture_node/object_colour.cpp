#include "capture_node/object_colour.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <opencv2/imgproc.hpp>

namespace fivepipe::capture {
namespace {

// No camera can focus on nearer points.
constexpr double kMinDepth_m = 0.01;

// Returns the pixels that the convex polygon `outline` touches. Its corners are in pixels, in order
// around it.
hull::ObjectPixels rasterize_conservative(const std::vector<cv::Point2f>& outline, int width_px,
                                          int height_px) {
  struct Extent {
    float min_u = INFINITY, max_u = -INFINITY;
  };
  std::vector<Extent> rows(static_cast<std::size_t>(height_px));
  for (std::size_t i = 0; i < outline.size(); ++i) {
    cv::Point2f top = outline[i], bottom = outline[(i + 1) % outline.size()];
    if (top.y > bottom.y) std::swap(top, bottom);
    const int first = std::max(0, int(std::floor(top.y + 0.5f))),
              last = std::min(height_px - 1, int(std::floor(bottom.y + 0.5f)));
    for (int v = first; v <= last; ++v)
      for (const float end :
           {std::max(top.y, float(v) - 0.5f), std::min(bottom.y, float(v) + 0.5f)}) {
        // If the edge is horizontal, the next edge begins at its other end and adds it.
        const float u = bottom.y > top.y
                            ? top.x + std::clamp((end - top.y) / (bottom.y - top.y), 0.0f, 1.0f) *
                                          (bottom.x - top.x)
                            : top.x;
        rows[std::size_t(v)].min_u = std::min(rows[std::size_t(v)].min_u, u);
        rows[std::size_t(v)].max_u = std::max(rows[std::size_t(v)].max_u, u);
      }
  }
  hull::ObjectPixels pixels(width_px, height_px);
  for (int v = 0; v < height_px; ++v) {
    const Extent& row = rows[std::size_t(v)];
    if (!(row.max_u >= -0.5f && row.min_u < float(width_px) - 0.5f)) continue;
    pixels.set_run(std::max(0, int(std::floor(row.min_u + 0.5f))),
                   std::min(width_px, int(std::floor(row.max_u + 0.5f)) + 1), v);
  }
  return pixels;
}

}  // namespace

VisibleRegion visible_region(const config::Viewer& viewer, const Eigen::Isometry3d& eye_from_world,
                             const Eigen::AlignedBox3d& hull_box_m) {
  const geometry::Camera eye{config::recon_pinhole(viewer), eye_from_world};
  const geometry::Pinhole& k = eye.pinhole;
  const double across = std::max(k.cx_px, k.width_px - k.cx_px) / k.fx_px,
               down = std::max(k.cy_px, k.height_px - k.cy_px) / k.fy_px;
  const Eigen::Vector3d center_m = geometry::camera_center_world_m(eye),
                        half_extent_m = Eigen::Vector3d::Constant(
                            viewer.far_m * Eigen::Vector3d(across, down, 1).norm());
  return {{eye, {0, 0, k.width_px, k.height_px}},
          hull_box_m.intersection(
              Eigen::AlignedBox3d(center_m - half_extent_m, center_m + half_extent_m))};
}

std::vector<VisibleRegion> visible_regions(std::span<const config::Viewer> viewers, double t_s,
                                           const Eigen::AlignedBox3d& hull_box_m) {
  std::vector<VisibleRegion> regions;
  for (const config::Viewer& viewer : viewers)
    for (const double x_m : config::eye_positions_m(viewer))
      regions.push_back(visible_region(
          viewer, config::eye_at(x_m, config::eye_from_world_at(viewer, t_s)), hull_box_m));
  return regions;
}

hull::ObjectPixels footprint(std::vector<hull::SilhouetteBounds> parts,
                             const Eigen::AlignedBox3d& box_m, const geometry::Camera& camera,
                             int margin_px) {
  const geometry::Pinhole& k = camera.pinhole;
  // The camera's own view: it keeps all corners in front of the camera and near its image.
  parts.push_back(
      {camera, {-margin_px, -margin_px, k.width_px + margin_px, k.height_px + margin_px}});
  std::vector<cv::Point2f> corners_px, outline;
  for (const Eigen::Vector3d& corner : hull::corners_around_hull(parts, box_m, kMinDepth_m)) {
    const auto uv = geometry::project(camera, corner);
    assert(uv);
    for (const int du : {-margin_px, margin_px})
      for (const int dv : {-margin_px, margin_px})
        corners_px.emplace_back(float(uv->x() + du), float(uv->y() + dv));
  }
  if (corners_px.empty()) return {k.width_px, k.height_px};
  cv::convexHull(corners_px, outline);
  return rasterize_conservative(outline, k.width_px, k.height_px);
}

hull::ObjectPixels visible_footprint(const std::vector<hull::SilhouetteBounds>& parts,
                                     std::span<const VisibleRegion> eyes,
                                     const geometry::Camera& camera, int margin_px) {
  hull::ObjectPixels all(camera.pinhole.width_px, camera.pinhole.height_px);
  for (const VisibleRegion& eye : eyes) {
    if (eye.box_m.isEmpty()) continue;
    std::vector<hull::SilhouetteBounds> seen = parts;
    seen.push_back(eye.part);
    all.add(footprint(std::move(seen), eye.box_m, camera, margin_px));
  }
  return all;
}

hull::ColourRegion colours_of(hull::ObjectPixels pixels, const geometry::Camera& camera,
                              const Undistortion& undistortion, const cv::Mat& captured_bgr) {
  const hull::PixelRect region = pixels.bounds();
  hull::ColourRegion colour{camera, std::move(pixels), region,
                            std::vector<std::uint8_t>(3 * region.area_px())};
  const cv::Mat bgr = undistortion.published(captured_bgr, region);
  const std::size_t row_bytes = 3 * std::size_t(region.width_px());
  for (int v = 0; v < region.height_px(); ++v)
    std::memcpy(colour.bgr.data() + std::size_t(v) * row_bytes, bgr.ptr(v), row_bytes);
  return colour;
}

}  // namespace fivepipe::capture
