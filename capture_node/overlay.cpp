#include "capture_node/overlay.h"

#include <cassert>
#include <cmath>
#include <cstring>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "capture_node/segmentation/bit_morphology.h"
#include "common/geometry/lens.h"

namespace fivepipe::capture {
namespace {

constexpr double kTint = 0.5, kDarkened = 0.6;

cv::Vec3b mixed(const cv::Vec3b& pixel, const cv::Vec3b& colour) {
  return cv::Vec3b(cv::Vec3d(pixel) * (1 - kTint) + cv::Vec3d(colour) * kTint);
}

// Draws a line of the world in short pieces, because the lens bends it.
void draw_line(cv::Mat& picture, const config::RigCamera& camera, const Eigen::Vector3d& from_m,
               const Eigen::Vector3d& to_m, const cv::Scalar& colour) {
  constexpr int kPieces = 64, kThickness_px = 1;
  const double radius = geometry::monotonic_radius(camera.distortion);
  const geometry::Pinhole& k = camera.source;
  std::optional<cv::Point> last;
  for (int i = 0; i <= kPieces; ++i) {
    const Eigen::Vector3d p_m =
        camera.camera_from_mount * (from_m + (to_m - from_m) * (double(i) / kPieces));
    std::optional<cv::Point> here;
    if (p_m.z() > 0 && (p_m.head<2>() / p_m.z()).norm() < radius) {
      const Eigen::Vector2d xy = geometry::distorted(camera.distortion, p_m.head<2>() / p_m.z());
      const double u = k.fx_px * xy.x() + k.cx_px, v = k.fy_px * xy.y() + k.cy_px;
      // Far outside, the coordinates may be larger than integers.
      if (std::abs(u) < 10 * k.width_px && std::abs(v) < 10 * k.height_px)
        here = cv::Point(int(std::lround(u)), int(std::lround(v)));
    }
    if (last && here) cv::line(picture, *last, *here, colour, kThickness_px, cv::LINE_AA);
    last = here;
  }
}

}  // namespace

void draw_volume(cv::Mat& picture_bgr, const config::RigCamera& camera,
                 const Eigen::AlignedBox3d& volume_m) {
  const cv::Scalar red(60, 60, 255), green(80, 230, 80), blue(255, 120, 60);
  for (int corner = 0; corner < 8; ++corner)
    for (int axis = 0; axis < 3; ++axis) {
      if (corner >> axis & 1) continue;
      const auto at = [&](int of) { return volume_m.corner(Eigen::AlignedBox3d::CornerType(of)); };
      draw_line(picture_bgr, camera, at(corner), at(corner | 1 << axis), green);
    }
  constexpr double kAxis_m = 0.5;
  const cv::Scalar colours[] = {red, green, blue};
  for (int axis = 0; axis < 3; ++axis)
    draw_line(picture_bgr, camera, Eigen::Vector3d::Zero(), kAxis_m * Eigen::Vector3d::Unit(axis),
              colours[axis]);
}

cv::Mat overlay(const cv::Mat& image_bgr, const Segmentation& segmentation) {
  const hull::ObjectPixels& object = segmentation.object;
  assert(image_bgr.type() == CV_8UC3 && image_bgr.cols == object.width_px() &&
         image_bgr.rows == object.height_px());
  const cv::Vec3b red(40, 40, 255), blue(255, 90, 30), yellow(0, 220, 255), white(255, 255, 255);
  const hull::ObjectPixels inner = eroded(object, 1);
  cv::Mat result = image_bgr.clone();
  for (int v = 0; v < result.rows; ++v)
    for (int u = 0; u < result.cols; ++u) {
      cv::Vec3b& pixel = result.at<cv::Vec3b>(v, u);
      if (object.contains(u, v))
        pixel = inner.contains(u, v) ? mixed(pixel, red) : white;
      else if (segmentation.difference.shadow.contains(u, v))
        pixel = mixed(pixel, blue);
      else if (segmentation.difference.differs.contains(u, v))
        pixel = yellow;
      else
        pixel = cv::Vec3b(cv::Vec3d(pixel) * kDarkened);
    }
  return result;
}

cv::Mat mask_image(const hull::ObjectPixels& pixels) {
  const std::vector<std::uint8_t> bytes = pixels.to_bytes();
  cv::Mat mask(pixels.height_px(), pixels.width_px(), CV_8UC1);
  if (!bytes.empty()) std::memcpy(mask.data, bytes.data(), bytes.size());
  return mask;
}

}  // namespace fivepipe::capture
