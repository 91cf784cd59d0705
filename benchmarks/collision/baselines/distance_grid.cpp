#include "benchmarks/collision/baselines/distance_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace fivepipe::baselines {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

struct Parabola {
  int at;
  double from;  // it is the lowest parabola from here on
};

// Transforms one line: out[i] = min over j of in[j] + (i - j)^2.
void lower_envelope(std::span<const float> in, std::span<float> out,
                    std::vector<Parabola>& lowest) {
  lowest.clear();
  for (int i = 0; i < int(in.size()); ++i) {
    if (in[std::size_t(i)] == kInfinity) continue;
    double from = -std::numeric_limits<double>::infinity();
    while (!lowest.empty()) {
      const int j = lowest.back().at;
      from = (in[std::size_t(i)] - in[std::size_t(j)] + double(i) * i - double(j) * j) /
             (2.0 * (i - j));
      if (from > lowest.back().from) break;
      lowest.pop_back();
    }
    if (lowest.empty()) from = -std::numeric_limits<double>::infinity();
    lowest.push_back({i, from});
  }
  if (lowest.empty()) return std::fill(out.begin(), out.end(), kInfinity);
  std::size_t k = 0;
  for (int i = 0; i < int(out.size()); ++i) {
    while (k + 1 < lowest.size() && lowest[k + 1].from < i) ++k;
    const int d = i - lowest[k].at;
    out[std::size_t(i)] = in[std::size_t(lowest[k].at)] + float(d) * float(d);
  }
}

}  // namespace

DistanceGrid::DistanceGrid(double voxel_m) : voxel_m_(voxel_m) {
  if (!(voxel_m > 0 && std::isfinite(voxel_m)))
    throw std::invalid_argument("DistanceGrid: voxel_m must be > 0");
}

void DistanceGrid::build(const hull::HullQuery& query, const Eigen::AlignedBox3d& box_world_m) {
  const Eigen::Vector3d size = (box_world_m.sizes() / voxel_m_).array().ceil().max(1.0);
  if (!(size.prod() <= kMaxVoxels))
    throw std::invalid_argument("DistanceGrid: more than kMaxVoxels in the box");
  size_ = size.cast<int>();
  corner_world_m_ = box_world_m.min();
  squared_.resize(std::size_t(size_.x()) * std::size_t(size_.y()) * std::size_t(size_.z()));
  const auto cameras = hull::point_simd_cameras(query.hull());
  query.hull().pool().run(size_.z(), [&](int z, int) { test_layer(query, cameras, z); });
  for (int axis = 0; axis < 3; ++axis) transform(query.hull().pool(), axis);
}

// Tests the voxels of layer z.
void DistanceGrid::test_layer(const hull::HullQuery& query,
                              std::span<const hull::PointSimdCamera> cameras, int z) {
  std::vector<Eigen::Vector3d> row(std::size_t(size_.x()));
  std::vector<hull::InHull> verdicts(row.size(), hull::InHull::no);
  float* out = squared_.data() + std::size_t(z) * std::size_t(size_.y()) * row.size();
  for (int y = 0; y < size_.y(); ++y, out += row.size()) {
    for (std::size_t x = 0; x < row.size(); ++x)
      row[x] = corner_world_m_ + voxel_m_ * Eigen::Vector3d(double(x) + 0.5, y + 0.5, z + 0.5);
    if (!query.hull().empty()) hull::contains_simd(cameras, row, verdicts.data());
    for (std::size_t x = 0; x < row.size(); ++x) {
      const bool in = verdicts[x] == hull::InHull::uncertain ? query.contains(row[x])
                                                             : verdicts[x] == hull::InHull::yes;
      out[x] = in ? 0 : kInfinity;
    }
  }
}

// Transforms all lines along an axis. A unit of work is the lines that share the slower of the
// other two coordinates.
void DistanceGrid::transform(base::WorkerPool& pool, int axis) {
  const std::size_t strides[3] = {1, std::size_t(size_.x()),
                                  std::size_t(size_.x()) * std::size_t(size_.y())};
  const int inner = axis == 0 ? 1 : 0, outer = axis == 2 ? 1 : 2;
  pool.run(size_[outer], [&](int o, int) {
    const std::size_t length = std::size_t(size_[axis]);
    std::vector<float> in(length), out(length);
    std::vector<Parabola> lowest;
    for (int i = 0; i < size_[inner]; ++i) {
      float* line =
          squared_.data() + std::size_t(o) * strides[outer] + std::size_t(i) * strides[inner];
      for (std::size_t k = 0; k < in.size(); ++k) in[k] = line[k * strides[axis]];
      lower_envelope(in, out, lowest);
      for (std::size_t k = 0; k < in.size(); ++k) line[k * strides[axis]] = out[k];
    }
  });
}

float DistanceGrid::distance_m(const Eigen::Vector3d& p_world_m) const {
  const Eigen::Vector3i at = ((p_world_m - corner_world_m_) / voxel_m_)
                                 .array()
                                 .floor()
                                 .cast<int>()
                                 .max(0)
                                 .min(size_.array() - 1);
  return float(voxel_m_) *
         std::sqrt(squared_[(std::size_t(at.z()) * std::size_t(size_.y()) + std::size_t(at.y())) *
                                std::size_t(size_.x()) +
                            std::size_t(at.x())]);
}

}  // namespace fivepipe::baselines
