// Sensor noise of the synthetic cameras.
#pragma once
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace fivepipe::capture {

// Gaussian sensor noise, rounded to grey levels. All images share one table and read it at
// different offsets.
class SensorNoise {
 public:
  explicit SensorNoise(double sigma_levels);
  // Adds the noise of image `key` in place, with saturation. The same key gives the same noise.
  void add(cv::Mat& bgr, std::uint64_t key) const;

 private:
  std::vector<std::int8_t> table_;
};

}  // namespace fivepipe::capture
