#include "capture_node/segmentation/coverage_estimate.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <optional>

#include "capture_node/segmentation/bit_morphology.h"

namespace fivepipe::capture {
namespace {

using Eigen::Vector3f;

// Half the size of the window in which colours are averaged [px]. It reaches the pixels 2 px inside
// from those beside the outline.
constexpr int kWindow_px = 3;

Vector3f level_at(const cv::Mat& image_bgr, int u, int v) {
  const std::uint8_t* const bgr = image_bgr.ptr(v) + 3 * u;
  return {float(bgr[0]), float(bgr[1]), float(bgr[2])};
}

// Returns the mean level of the pixels of `of` around (u, v); the nearest ones count most. Returns
// nullopt if there is none.
std::optional<Vector3f> mean_near(const cv::Mat& image_bgr, const hull::ObjectPixels& of, int u,
                                  int v) {
  Vector3f sum = Vector3f::Zero();
  float weights = 0;
  for (int dv = -kWindow_px; dv <= kWindow_px; ++dv)
    for (int du = -kWindow_px; du <= kWindow_px; ++du) {
      if (!of.contains(u + du, v + dv)) continue;
      const float squared = float(du * du + dv * dv), weight = 1 / (1 + squared * squared);
      sum += weight * level_at(image_bgr, u + du, v + dv);
      weights += weight;
    }
  if (weights == 0) return std::nullopt;
  return sum / weights;
}

// Calls f(u, v) for each pixel that is in `a` and not in `b`.
template <class F>
void for_each_difference(const hull::ObjectPixels& a, const hull::ObjectPixels& b, const F& f) {
  const int words = a.words_per_row();
  for (int v = 0; v < a.height_px(); ++v)
    for (int w = 0; w < words; ++w) {
      const std::size_t at = std::size_t(v) * std::size_t(words) + std::size_t(w);
      for (std::uint64_t bits = a.words()[at] & ~b.words()[at]; bits != 0; bits &= bits - 1)
        f(64 * w + std::countr_zero(bits), v);
    }
}

hull::ObjectPixels inverse(const hull::ObjectPixels& pixels) {
  hull::ObjectPixels all(pixels.width_px(), pixels.height_px());
  for (int v = 0; v < all.height_px(); ++v) all.set_run(0, all.width_px(), v);
  all.remove(pixels);
  return all;
}

}  // namespace

hull::CoverageMap estimated_coverage(const cv::Mat& image_bgr, const hull::ObjectPixels& object,
                                     const BehindObjects& behind) {
  assert(image_bgr.type() == CV_8UC3 && image_bgr.cols == object.width_px() &&
         image_bgr.rows == object.height_px());
  hull::CoverageMap coverage = hull::CoverageMap::from_pixels(object);
  if (object.count() == 0) return coverage;
  const hull::ObjectPixels inside = eroded(object, 1), far_inside = eroded(object, 2),
                           around = dilated(object, 1);
  const hull::ObjectPixels outside =
      behind.levels.empty() ? inverse(dilated(object, 2)) : hull::ObjectPixels();
  const auto behind_at = [&](int u, int v) -> std::optional<Vector3f> {
    if (behind.levels.empty()) return mean_near(image_bgr, outside, u, v);
    const std::size_t at = 3 * (std::size_t(v) * std::size_t(image_bgr.cols) + std::size_t(u));
    return Vector3f::Map(behind.levels.data() + at).cwiseProduct(behind.gain);
  };
  for_each_difference(around, far_inside, [&](int u, int v) {
    const std::optional<Vector3f> b = behind_at(u, v);
    std::optional<Vector3f> f = mean_near(image_bgr, far_inside, u, v);
    if (!f) f = mean_near(image_bgr, inside, u, v);
    if (!b || !f) return;
    const Vector3f difference = *f - *b;
    const float squared = difference.squaredNorm();
    if (!(squared >= kMinContrast_levels * kMinContrast_levels)) return;
    const float a = (level_at(image_bgr, u, v) - *b).dot(difference) / squared;
    const bool is_object = object.contains(u, v);
    const int low = inside.contains(u, v) ? 128 : 0, high = is_object ? 255 : 127;
    coverage.set(u, v, std::uint8_t(std::clamp(int(std::lround(255 * a)), low, high)));
  });
  return coverage;
}

}  // namespace fivepipe::capture
