#include "capture_node/object_colour.h"

#include <cstring>
#include <opencv2/imgproc.hpp>

namespace fivepipe {
namespace {

// cv::fillConvexPoly takes integers: so many binary places of a pixel.
constexpr int kShift = 4;
// Of what is nearer no camera has a picture.
constexpr double kNearest_m = 0.01;

}  // namespace

ObjectPixels footprint(std::vector<SeenPart> parts, const Eigen::AlignedBox3d& box_m, const Camera& camera, int margin_px) {
  const Pinhole& k = camera.pinhole;
  parts.push_back({camera, {-margin_px, -margin_px, k.width_px + margin_px, k.height_px + margin_px}});  // what it sees; so all corners are near its image
  std::vector<cv::Point> around;
  for (const Eigen::Vector3d& corner : corners_around_hull(parts, box_m, kNearest_m)) {
    const auto uv = project(camera, corner);
    if (!uv) continue;  // not so: all are in front of it
    for (const int du : {-margin_px, margin_px})
      for (const int dv : {-margin_px, margin_px}) around.emplace_back(cvRound((uv->x() + du) * (1 << kShift)), cvRound((uv->y() + dv) * (1 << kShift)));
  }
  if (around.empty()) return {k.width_px, k.height_px};
  std::vector<cv::Point> outline;
  cv::convexHull(around, outline);
  std::vector<std::uint8_t> bytes(std::size_t(k.width_px) * std::size_t(k.height_px));
  cv::Mat mask(k.height_px, k.width_px, CV_8U, bytes.data());
  cv::fillConvexPoly(mask, outline, 255, cv::LINE_8, kShift);
  return ObjectPixels::from_bytes(k.width_px, k.height_px, bytes);
}

ColourRegion colours_of(ObjectPixels pixels, const Camera& camera, const Undistortion& undistortion, const cv::Mat& captured_bgr) {
  const PixelRect region = pixels.bounds();
  ColourRegion colour{camera, std::move(pixels), region, std::vector<std::uint8_t>(3 * region.area_px())};
  const cv::Mat bgr = undistortion.published(captured_bgr, region);
  const std::size_t row_bytes = 3 * std::size_t(region.width_px());
  for (int v = 0; v < region.height_px(); ++v) std::memcpy(colour.bgr.data() + std::size_t(v) * row_bytes, bgr.ptr(v), row_bytes);
  return colour;
}

}  // namespace fivepipe
