#include "benchmarks/capture/methods.h"

#include <fmt/format.h>

#include <algorithm>

#include "capture_node/lens/undistortion.h"
#include "capture_node/segmentation/bit_morphology.h"
#include "capture_node/segmentation/segmentation.h"
#ifdef FIVEPIPE_OPENCV_VIDEO
#include <opencv2/video/background_segm.hpp>
#endif

namespace fivepipe::capture_bench {
namespace {

using Images = std::vector<cv::Mat>;

// Packs the pixels of a mask that are above `least`.
hull::ObjectPixels packed(const cv::Mat& mask, std::uint8_t least) {
  hull::ObjectPixels pixels(mask.cols, mask.rows);
  for (int v = 0; v < mask.rows; ++v) {
    std::uint64_t* const words =
        pixels.mutable_words().data() + std::size_t(v) * std::size_t(pixels.words_per_row());
    const std::uint8_t* const row = mask.ptr(v);
    for (int u = 0; u < mask.cols; ++u) words[u / 64] |= std::uint64_t(row[u] > least) << (u % 64);
  }
  return pixels;
}

// The settings are the defaults, because these were chosen with the tuning seeds.
class Fivepipe final : public Learned {
 public:
  Fivepipe(const config::RigCamera& camera, const Images& learning)
      : segmenter_(capture::learn_background(learning), {}), undistortion_(camera) {}
  hull::ObjectPixels segment(const cv::Mat& image_bgr) override {
    return undistortion_.published(segmenter_.segment(image_bgr)->object);
  }

 private:
  capture::Segmenter segmenter_;
  capture::Undistortion undistortion_;
};

config::RigCamera camera_for(const Images& learning) {
  config::RigCamera camera;
  camera.name = "camera";
  camera.source = camera.published =
      geometry::pinhole_from_fov(learning[0].cols, learning[0].rows, 0.85);
  return camera;
}

// The difference to one image of the background, in any channel.
class Difference final : public Learned {
 public:
  Difference(cv::Mat background_bgr, int threshold_levels)
      : background_bgr_(std::move(background_bgr)), threshold_levels_(threshold_levels) {}
  hull::ObjectPixels segment(const cv::Mat& image_bgr) override {
    cv::absdiff(image_bgr, background_bgr_, difference_);
    cv::Mat most(image_bgr.rows, image_bgr.cols, CV_8UC1);
    for (int v = 0; v < most.rows; ++v) {
      const std::uint8_t* const row = difference_.ptr(v);
      for (int u = 0; u < most.cols; ++u)
        most.ptr(v)[u] = std::max({row[3 * u], row[3 * u + 1], row[3 * u + 2]});
    }
    return packed(most, std::uint8_t(threshold_levels_));
  }

 private:
  cv::Mat background_bgr_, difference_;
  int threshold_levels_;
};

cv::Mat median_of(const Images& images) {
  cv::Mat median = images[0].clone();
  std::vector<std::uint8_t> levels(images.size());
  for (std::size_t i = 0; i < std::size_t(median.rows) * median.cols * 3; ++i) {
    for (std::size_t f = 0; f < images.size(); ++f) levels[f] = images[f].data[i];
    const auto middle = levels.begin() + std::ptrdiff_t(levels.size() / 2);
    std::nth_element(levels.begin(), middle, levels.end());
    median.data[i] = *middle;
  }
  return median;
}

#ifdef FIVEPIPE_OPENCV_VIDEO
// OpenCV's background subtractors. Pixels that they take for shadow are no object.
class Subtractor final : public Learned {
 public:
  Subtractor(cv::Ptr<cv::BackgroundSubtractor> subtractor, const Images& learning, double rate)
      : subtractor_(std::move(subtractor)), rate_(rate) {
    for (const cv::Mat& image : learning) subtractor_->apply(image, mask_);
  }
  hull::ObjectPixels segment(const cv::Mat& image_bgr) override {
    subtractor_->apply(image_bgr, mask_, rate_);
    return packed(mask_, kShadow);
  }

 private:
  static constexpr std::uint8_t kShadow = 127;
  cv::Ptr<cv::BackgroundSubtractor> subtractor_;
  cv::Mat mask_;
  double rate_;
};

void add_subtractors(std::vector<Method>& methods, const std::vector<Cleaning>& cleanings) {
  std::vector<Settings> mog2, knn;
  for (const double rate : {0.0, 0.002})
    for (const int threshold : {8, 10, 12, 16, 24, 32})
      mog2.push_back({fmt::format("varThreshold {}, shadows, rate {}", threshold, rate),
                      [=](const Images& learning) {
                        return std::make_unique<Subtractor>(
                            cv::createBackgroundSubtractorMOG2(int(learning.size()), threshold),
                            learning, rate);
                      }});
  for (const bool shadows : {false, true})
    for (const int threshold : {50, 100, 200, 400})
      knn.push_back(
          {fmt::format("dist2Threshold {}{}, rate 0", threshold, shadows ? ", shadows" : ""),
           [=](const Images& learning) {
             return std::make_unique<Subtractor>(
                 cv::createBackgroundSubtractorKNN(int(learning.size()), threshold, shadows),
                 learning, 0.0);
           }});
  methods.push_back({"mog2", std::move(mog2), cleanings});
  methods.push_back({"knn", std::move(knn), cleanings});
}
#endif

}  // namespace

std::string Cleaning::text() const {
  std::string text;
  if (opening_px > 0) text += fmt::format(", opening {} px", opening_px);
  if (closing_px > 0) text += fmt::format(", closing {} px", closing_px);
  return text;
}

hull::ObjectPixels cleaned(hull::ObjectPixels pixels, const Cleaning& cleaning) {
  return capture::closed(capture::opened(std::move(pixels), cleaning.opening_px),
                         cleaning.closing_px);
}

std::vector<Method> methods(bool is_quick) {
  const std::vector<Cleaning> cleanings{{0, 0}, {1, 0}, {1, 3}, {2, 3}};
  std::vector<Method> methods;
  methods.push_back({"fivepipe",
                     {{"defaults",
                       [](const Images& learning) {
                         return std::make_unique<Fivepipe>(camera_for(learning), learning);
                       }}},
                     {{0, 0}}});
#ifdef FIVEPIPE_OPENCV_VIDEO
  add_subtractors(methods, cleanings);
#endif
  std::vector<Settings> one, median;
  for (const int threshold : {12, 16, 20, 26, 32, 40}) {
    const std::string text = fmt::format("threshold {}", threshold);
    one.push_back({text, [=](const Images& learning) {
                     return std::make_unique<Difference>(learning[0], threshold);
                   }});
    median.push_back({text, [=](const Images& learning) {
                        return std::make_unique<Difference>(median_of(learning), threshold);
                      }});
  }
  methods.push_back({"difference", std::move(one), cleanings});
  methods.push_back({"median", std::move(median), cleanings});
  if (is_quick)
    for (Method& method : methods)
      if (method.settings.size() > 2) method.settings.resize(2);
  return methods;
}

std::unique_ptr<Learned> learn_distorted(const Images& learning) {
  config::RigCamera camera = camera_for(learning);
  camera.distortion = {-0.25, 0.08, 0.0005, -0.0003, 0};
  return std::make_unique<Fivepipe>(camera, learning);
}

}  // namespace fivepipe::capture_bench
