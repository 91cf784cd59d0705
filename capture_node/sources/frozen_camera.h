// Notices a camera that delivers the same image again and again. The noise of a sensor makes its
// images differ; the decoded images of a compressed stream can be equal while nothing moves.
#pragma once
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace fivepipe::capture {

class FrozenCamera {
 public:
  // Call it for each image, with the time of the call [ns]. Returns for how long the images have
  // been equal [s].
  double frozen_s(const cv::Mat& image, std::int64_t now_ns);

 private:
  std::vector<std::uint8_t> rows_;  // of the last image
  std::int64_t since_ns_ = 0;
};

// One row in this many is compared.
inline constexpr int kFrozenRowStep = 16;
// Equal images of this duration are reported. A camera with 20 Hz has sent 20 of them.
inline constexpr double kMinFrozen_s = 1;

}  // namespace fivepipe::capture
