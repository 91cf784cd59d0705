// Numbers for the elements of a lattice that are on a surface: a sparse map from (x, y, z, kind).
#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <vector>

namespace fivepipe::surface {

class LatticeIndex {
 public:
  static constexpr int kKinds = 4;
  // size: elements have coordinates in [0, size).
  explicit LatticeIndex(const Eigen::Vector3i& size)
      : rows_y_(size.y()), first_(std::size_t(size.y()) * std::size_t(size.z()) + 1, 0) {}

  // Elements must be added in ascending order of z, then y, then x, then kind in [0, kKinds).
  // Returns the number of the element: how many were added before.
  std::uint32_t add(const Eigen::Vector3i& at, int kind) {
    const std::size_t row = row_of(at);
    for (; filled_ <= row; ++filled_) first_[filled_] = std::uint32_t(keys_.size());
    keys_.push_back(key_of(at, kind));
    return std::uint32_t(keys_.size() - 1);
  }
  // Call once, after the last add() and before find().
  void finish() {
    for (; filled_ < first_.size(); ++filled_) first_[filled_] = std::uint32_t(keys_.size());
  }
  // Returns the number of an element, which must have been added.
  std::uint32_t find(const Eigen::Vector3i& at, int kind) const {
    const std::size_t row = row_of(at);
    const auto begin = keys_.begin() + first_[row], end = keys_.begin() + first_[row + 1];
    return std::uint32_t(std::lower_bound(begin, end, key_of(at, kind)) - keys_.begin());
  }
  std::size_t size() const { return keys_.size(); }

 private:
  std::size_t row_of(const Eigen::Vector3i& at) const {
    return std::size_t(at.z()) * std::size_t(rows_y_) + std::size_t(at.y());
  }
  static std::uint32_t key_of(const Eigen::Vector3i& at, int kind) {
    return std::uint32_t(at.x()) * kKinds + std::uint32_t(kind);
  }

  int rows_y_;
  std::vector<std::uint32_t> first_;  // by row: of its elements in keys_
  std::size_t filled_ = 0;            // elements of first_ that are final
  std::vector<std::uint32_t> keys_;
};

}  // namespace fivepipe::surface
