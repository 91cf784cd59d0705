#include "capture_node/overlay.h"

#include <cassert>
#include <cstring>

#include "capture_node/segmentation/bit_morphology.h"

namespace fivepipe::capture {
namespace {

constexpr double kTint = 0.5, kDarkened = 0.6;

cv::Vec3b mixed(const cv::Vec3b& pixel, const cv::Vec3b& colour) {
  return cv::Vec3b(cv::Vec3d(pixel) * (1 - kTint) + cv::Vec3d(colour) * kTint);
}

}  // namespace

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
