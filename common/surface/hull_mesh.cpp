#include "common/surface/hull_mesh.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "common/collision/proximity/lazy_octree.h"
#include "common/surface/bit_grid.h"
#include "common/surface/marching_cubes.h"

namespace fivepipe::surface {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

// Cubes of 4 x 4 x 4 points are not divided.
constexpr int kLeafLevel = 2;
// Of an edge of the lattice: halvings of the interval in which it crosses the border, and how near
// to its ends a vertex may be. Vertices at a point of the lattice would coincide.
constexpr int kHalvings = 12;
constexpr double kClearOfEnds = 0.01;
// Relative rounding error of a cube's centre and size.
constexpr double kCubeRounding = 1e-12;

struct Lattice {
  Vector3d origin_m;
  double cell_m;
  Vector3i points;
  Vector3d at_m(const Vector3i& point) const { return origin_m + cell_m * point.cast<double>(); }
};

// The outermost points are outside of the box.
Lattice lattice_of(const HullMeshOptions& options) {
  const Eigen::AlignedBox3d& box = options.within_world_m;
  if (!(options.cell_m > 0 && std::isfinite(options.cell_m)))
    throw std::invalid_argument("hull mesh: cell_m is not positive and finite");
  if (!(box.min().allFinite() && box.max().allFinite() && (box.sizes().array() > 0).all()))
    throw std::invalid_argument("hull mesh: the box is empty or not finite");
  const Vector3d points = (box.sizes() / options.cell_m).array().ceil() + 2;
  if (!(points.prod() <= double(kMaxLatticePoints)))
    throw std::invalid_argument(
        "hull mesh: too many cells in the box; increase cell_m or reduce the box");
  return {box.min() - Vector3d::Constant(options.cell_m / 2), options.cell_m, points.cast<int>()};
}

// Finds the points of the lattice that are in the hull and in the box.
class PointSearch {
 public:
  PointSearch(const hull::HullQuery& query, const Lattice& lattice, const Eigen::AlignedBox3d& box,
              BitGrid& inside)
      : query_(query), cubes_(query), lattice_(lattice), box_(box), inside_(inside) {}

  void run() {
    const int level = std::bit_width(unsigned(lattice_.points.maxCoeff() - 1));
    search(Vector3i::Zero(), std::max(level, kLeafLevel));
    flush();
  }

 private:
  // The points [at, at + 2^level) along each axis.
  void search(const Vector3i& at, int level) {
    if ((at.array() >= lattice_.points.array()).any()) return;
    const int edge = 1 << level;
    const double half_m = lattice_.cell_m * (edge - 1) / 2;
    const Vector3d center_m = lattice_.at_m(at) + Vector3d::Constant(half_m);
    if (cubes_.test(center_m, half_m + kCubeRounding * (half_m + center_m.cwiseAbs().sum())).free)
      return;
    const Vector3i end = (at + Vector3i::Constant(edge)).cwiseMin(lattice_.points);
    if (level > kLeafLevel && is_solid(center_m, half_m)) {
      for_points(at, end, [&](const Vector3i& p) { inside_.set(p.x(), p.y(), p.z()); });
    } else if (level == kLeafLevel) {
      for_points(at, end, [&](const Vector3i& p) {
        if (const Vector3d p_m = lattice_.at_m(p); box_.contains(p_m))
          waiting_.push_back(p), waiting_m_.push_back(p_m);
      });
      if (waiting_.size() >= kBatch) flush();
    } else {
      for (int octant = 0; octant < 8; ++octant)
        search(at + (edge / 2) * corner_offset(octant), level - 1);
    }
  }

  bool is_solid(const Vector3d& center_m, double half_m) const {
    const Vector3d half = Vector3d::Constant(half_m);
    return box_.contains(Eigen::AlignedBox3d(center_m - half, center_m + half)) &&
           query_.solid_radius_m(center_m) > half_m * std::numbers::sqrt3 * (1 + kCubeRounding);
  }

  template <class Visit>
  static void for_points(const Vector3i& begin, const Vector3i& end, const Visit& visit) {
    for (int z = begin.z(); z < end.z(); ++z)
      for (int y = begin.y(); y < end.y(); ++y)
        for (int x = begin.x(); x < end.x(); ++x) visit(Vector3i(x, y, z));
  }

  void flush() {
    std::vector<std::uint8_t> in_hull(waiting_.size());
    query_.contains(waiting_m_, in_hull);
    for (std::size_t i = 0; i < waiting_.size(); ++i)
      if (in_hull[i]) inside_.set(waiting_[i].x(), waiting_[i].y(), waiting_[i].z());
    waiting_.clear(), waiting_m_.clear();
  }

  static constexpr std::size_t kBatch = 1 << 16;
  const hull::HullQuery& query_;
  collision::CubeQuery cubes_;
  const Lattice& lattice_;
  const Eigen::AlignedBox3d& box_;
  BitGrid& inside_;
  std::vector<Vector3i> waiting_;
  std::vector<Vector3d> waiting_m_;
};

// Returns where each edge crosses the hull's border.
std::vector<Vector3d> border_points_m(const hull::HullQuery& query, const Eigen::AlignedBox3d& box,
                                      const Lattice& lattice, std::span<const CrossedEdge> edges) {
  std::vector<double> low(edges.size(), 0), high(edges.size(), 1);
  std::vector<Vector3d> points_m(edges.size());
  std::vector<std::uint8_t> in_hull(edges.size());
  const auto put = [&](std::size_t i) {
    const double t = std::clamp((low[i] + high[i]) / 2, kClearOfEnds, 1 - kClearOfEnds);
    const Vector3d inside_m = lattice.at_m(edges[i].inside);
    points_m[i] = inside_m + t * (lattice.at_m(edges[i].outside) - inside_m);
  };
  for (std::size_t i = 0; i < edges.size(); ++i) put(i);
  for (int halving = 0; halving < kHalvings; ++halving) {
    query.contains(points_m, in_hull);
    for (std::size_t i = 0; i < edges.size(); ++i) {
      const bool is_inside = in_hull[i] && box.contains(points_m[i]);
      (is_inside ? low : high)[i] = (low[i] + high[i]) / 2;
      put(i);
    }
  }
  return points_m;
}

}  // namespace

geometry::Mesh hull_mesh(const hull::HullQuery& query, const HullMeshOptions& options) {
  const Lattice lattice = lattice_of(options);
  if (query.hull().empty()) return {};
  BitGrid inside(lattice.points);
  PointSearch(query, lattice, options.within_world_m, inside).run();
  const MarchingCubes cubes(inside);
  return cubes.mesh(border_points_m(query, options.within_world_m, lattice, cubes.edges()));
}

}  // namespace fivepipe::surface
