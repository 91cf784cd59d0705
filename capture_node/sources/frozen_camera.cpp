#include "capture_node/sources/frozen_camera.h"

#include <algorithm>

namespace fivepipe::capture {

double FrozenCamera::frozen_s(const cv::Mat& image, std::int64_t now_ns) {
  const std::size_t row_bytes = std::size_t(image.cols) * image.elemSize();
  const int rows = (image.rows + kFrozenRowStep - 1) / kFrozenRowStep;
  bool is_equal = rows_.size() == row_bytes * std::size_t(rows);
  rows_.resize(row_bytes * std::size_t(rows));
  for (int i = 0; i < rows; ++i) {
    const std::uint8_t* const from = image.ptr(i * kFrozenRowStep);
    const auto kept = rows_.begin() + std::ptrdiff_t(row_bytes) * i;
    is_equal = is_equal && std::equal(from, from + row_bytes, kept);
    std::copy_n(from, row_bytes, kept);
  }
  if (!is_equal) since_ns_ = now_ns;
  return 1e-9 * double(now_ns - since_ns_);
}

}  // namespace fivepipe::capture
