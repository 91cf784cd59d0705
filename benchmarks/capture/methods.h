// Segmentation methods and their settings: fivepipe's, and those that users could choose instead.
#pragma once
#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "common/hull/object_pixels.h"

namespace fivepipe::capture_bench {

// A method that has learned the background of one camera.
class Learned {
 public:
  virtual ~Learned() = default;
  // Takes the images in their order: 8-bit BGR of the size of those learned from.
  virtual hull::ObjectPixels segment(const cv::Mat& image_bgr) = 0;
};

// One choice of settings.
struct Settings {
  std::string text;
  std::function<std::unique_ptr<Learned>(const std::vector<cv::Mat>& learning)> learn;
};

// Radii of an opening and a closing that follow the method. Those of fivepipe are in its settings.
struct Cleaning {
  int opening_px = 0, closing_px = 0;
  std::string text() const;
};
hull::ObjectPixels cleaned(hull::ObjectPixels pixels, const Cleaning& cleaning);

struct Method {
  std::string name;
  std::vector<Settings> settings;  // to choose from by tuning
  std::vector<Cleaning> cleanings;
};

// fivepipe is the first one. is_quick: at most two settings for each. Without the OpenCV module
// `video`, MOG2 and KNN are absent.
std::vector<Method> methods(bool is_quick);

// fivepipe with its default settings, from a camera with a lens whose distortion is removed: what
// capture_node does with an image.
std::unique_ptr<Learned> learn_distorted(const std::vector<cv::Mat>& learning);

}  // namespace fivepipe::capture_bench
