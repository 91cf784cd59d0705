#include "common/collision/detection/bvh.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;

constexpr int kMortonBits = 21;  // per axis

std::uint64_t spread(std::uint64_t x) {  // moves bit i to bit 3 i
  x &= 0x1fffff;
  x = (x | x << 32) & 0x1f00000000ffff;
  x = (x | x << 16) & 0x1f0000ff0000ff;
  x = (x | x << 8) & 0x100f00f00f00f00f;
  x = (x | x << 4) & 0x10c30c30c30c30c3;
  return (x | x << 2) & 0x1249249249249249;
}

void check(std::span<const Vector3d> vertices_m) {
  for (std::size_t i = 0; i < vertices_m.size(); ++i)
    if (!vertices_m[i].allFinite())
      throw std::invalid_argument("mesh: vertex " + std::to_string(i) + " is not finite");
}

void check(const geometry::Mesh& mesh) {
  check(std::span(mesh.vertices_m));
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (const std::uint32_t v : mesh.triangles[i])
      if (!(v < mesh.vertices_m.size()))
        throw std::invalid_argument("mesh: triangle " + std::to_string(i) + " refers to vertex " +
                                    std::to_string(v) + " of " +
                                    std::to_string(mesh.vertices_m.size()));
}

// Rounds up by two units in the last place: one for the rounding of a difference to float, one for
// that of the center it is taken from.
float round_up_to_float(double x) {
  return std::nextafter(std::nextafter(float(x), std::numeric_limits<float>::infinity()),
                        std::numeric_limits<float>::infinity());
}

struct Bounds {
  double min, max;
};

}  // namespace

Bvh::Bvh(geometry::Mesh mesh) : mesh_(std::move(mesh)) {
  check(mesh_);
  if (mesh_.triangles.empty()) return;
  const Eigen::AlignedBox3d box = geometry::bounds_m(mesh_);
  const double largest_m = std::max(box.sizes().maxCoeff(), std::numeric_limits<double>::min());
  std::vector<std::pair<std::uint64_t, std::uint32_t>> keys;
  keys.reserve(mesh_.triangles.size());
  for (std::uint32_t i = 0; i < mesh_.triangles.size(); ++i) {
    const auto& [a, b, c] = mesh_.triangles[i];
    const Vector3d center = (mesh_.vertices_m[a] + mesh_.vertices_m[b] + mesh_.vertices_m[c]) / 3;
    std::uint64_t key = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double fraction = std::clamp((center[axis] - box.min()[axis]) / largest_m, 0.0, 1.0);
      key |= spread(std::uint64_t(fraction * ((1 << kMortonBits) - 1))) << axis;
    }
    keys.emplace_back(key, i);
  }
  std::sort(keys.begin(), keys.end());
  for (const auto& [key, triangle] : keys) order_.push_back(triangle);
  leaves_.resize((order_.size() + kArity - 1) / kArity);
  for (std::size_t below = leaves_.size(); levels_.empty() || below > 1;
       below = levels_.back().size())
    levels_.emplace_back((below + kArity - 1) / kArity);
  fit();
}

void Bvh::refit(std::span<const Vector3d> vertices_m) {
  if (vertices_m.size() != mesh_.vertices_m.size())
    throw std::invalid_argument("mesh: refit with " + std::to_string(vertices_m.size()) +
                                " vertices instead of " + std::to_string(mesh_.vertices_m.size()));
  check(vertices_m);  // first, so a refused refit changes nothing
  mesh_.vertices_m.assign(vertices_m.begin(), vertices_m.end());
  if (!leaves_.empty()) fit();
}

std::span<const std::uint32_t> Bvh::triangles_of(int leaf) const {
  const std::size_t first = std::size_t(leaf) * kArity;
  return std::span(order_).subspan(first, std::min(std::size_t(kArity), order_.size() - first));
}

void Bvh::fit() {
  static std::atomic<std::uint64_t> contents{0};
  content_ = ++contents;
  const Eigen::AlignedBox3d box = geometry::bounds_m(mesh_);
  origin_m_ = box.center();
  radius_m_ = 0.5 * box.diagonal().norm() * (1 + 4 * std::numeric_limits<double>::epsilon());
  std::vector<std::array<Bounds, 3>> below(leaves_.size()), above;
  for (std::size_t n = 0; n < leaves_.size(); ++n) {
    Leaf& leaf = leaves_[n];
    for (auto& vertex : leaf.vertices_m)
      for (auto& axis : vertex) axis.fill(std::numeric_limits<float>::quiet_NaN());
    below[n].fill(
        {std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()});
    const auto triangles = triangles_of(int(n));
    for (std::size_t t = 0; t < triangles.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k) {
        const Vector3d p = mesh_.vertices_m[mesh_.triangles[triangles[t]][k]] - origin_m_;
        for (int axis = 0; axis < 3; ++axis) {
          leaf.vertices_m[k][std::size_t(axis)][t] = float(p[axis]);
          Bounds& b = below[n][std::size_t(axis)];
          b = {std::min(b.min, p[axis]), std::max(b.max, p[axis])};
        }
      }
  }
  for (auto& level : levels_) {
    above.assign(level.size(), {});
    for (std::size_t i = 0; i < level.size(); ++i)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        Bounds all{std::numeric_limits<double>::infinity(),
                   -std::numeric_limits<double>::infinity()};
        for (std::size_t child = 0; child < kArity; ++child) {
          const std::size_t n = i * kArity + child;
          float &center = level[i].center_m[axis][child], &half = level[i].half_m[axis][child];
          center = 0, half = -1;
          if (n >= below.size()) continue;
          const Bounds& b = below[n][axis];
          center = float(0.5 * (b.min + b.max));
          half = round_up_to_float(std::max(b.max - double(center), double(center) - b.min));
          all = {std::min(all.min, b.min), std::max(all.max, b.max)};
        }
        above[i][axis] = all;
      }
    below = above;
  }
}

}  // namespace fivepipe::collision
