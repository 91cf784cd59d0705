// Bytes of a little-endian file.
#pragma once
#include <Eigen/Core>
#include <bit>
#include <string>
#include <utility>

namespace fivepipe::surface {

class ByteBuffer {
 public:
  static_assert(std::endian::native == std::endian::little);
  explicit ByteBuffer(std::string begin = {}) : bytes_(std::move(begin)) {}

  template <class Value>
  void add(Value value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void add_floats(const Eigen::Vector3d& v) {
    for (int axis = 0; axis < 3; ++axis) add(float(v[axis]));
  }
  void add_text(const std::string& text) { bytes_ += text; }
  std::size_t size() const { return bytes_.size(); }
  std::string text() && { return std::move(bytes_); }

 private:
  std::string bytes_;
};

}  // namespace fivepipe::surface
