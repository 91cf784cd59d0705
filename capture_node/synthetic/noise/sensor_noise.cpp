#include "capture_node/synthetic/noise/sensor_noise.h"

#include <algorithm>
#include <cmath>

#include "capture_node/synthetic/noise/noise.h"

namespace fivepipe::capture {
namespace {

constexpr std::size_t kNoiseTableSize = std::size_t(1) << 20;

}  // namespace

// The sum of twelve uniform numbers minus its mean is approximately normal within 6 sigma
// (Irwin-Hall). It does not depend on libm.
SensorNoise::SensorNoise(double sigma_levels) {
  if (!(sigma_levels > 0)) return;
  table_.resize(kNoiseTableSize);
  for (std::size_t i = 0; i < kNoiseTableSize; ++i) {
    std::int64_t sum = 0;
    for (std::uint64_t draw = 0; draw < 3; ++draw) {
      const std::uint64_t bits = splitmix64(3 * i + draw);
      sum += std::int64_t((bits & 0xffff) + (bits >> 16 & 0xffff) + (bits >> 32 & 0xffff) +
                          (bits >> 48));
    }
    const double normal = (double(sum) - 6.0 * 65535.0) / 65536.0;
    table_[i] = std::int8_t(std::clamp(std::floor(normal * sigma_levels + 0.5), -127.0, 127.0));
  }
}

void SensorNoise::add(cv::Mat& bgr, std::uint64_t key) const {
  if (table_.empty()) return;
  const std::size_t row_bytes = std::size_t(bgr.cols) * 3;
  for (int v = 0; v < bgr.rows; ++v) {
    std::uint8_t* row = bgr.ptr(v);
    // Images wider than half the table use several ranges of it.
    for (std::size_t done = 0; done < row_bytes;) {
      const std::size_t n = std::min(row_bytes - done, kNoiseTableSize / 2);
      const std::int8_t* noise =
          table_.data() +
          splitmix64(splitmix64(key, std::uint64_t(v)), done) % (kNoiseTableSize - n);
      for (std::size_t i = 0; i < n; ++i)
        row[done + i] = std::uint8_t(std::clamp(row[done + i] + noise[i], 0, 255));
      done += n;
    }
  }
}

}  // namespace fivepipe::capture
