#include "common/surface/swept_volume.h"

#include <atomic>
#include <bit>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "common/collision/proximity/lazy_octree.h"
#include "common/geometry/closed_mesh.h"
#include "common/surface/cell_boundary.h"

namespace fivepipe::surface {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

// How often a cell is halved to certify it free. 1/8 of a cell of 5 mm is smaller than the
// footprint of most cameras' pixels.
constexpr int kHalvingsOfACell = 3;
constexpr int kSamples = 8;
constexpr std::uint8_t kAllSamples = 0xff;
// Relative rounding error of a cell's centre and size.
constexpr double kCellRounding = 1e-12;

Vector3i cells_in(const SweptVolumeOptions& options) {
  const Eigen::AlignedBox3d& box = options.within_world_m;
  if (!(options.cell_m > 0 && std::isfinite(options.cell_m)))
    throw std::invalid_argument("swept volume: cell_m is not positive and finite");
  if (!(box.min().allFinite() && box.max().allFinite() && (box.sizes().array() > 0).all()))
    throw std::invalid_argument("swept volume: the box is empty or not finite");
  const Vector3d cells = (box.sizes() / options.cell_m).array().ceil();
  if (!(cells.prod() <= double(kMaxSweptCells)))
    throw std::invalid_argument(
        "swept volume: too many cells in the box; increase cell_m or reduce the box");
  return cells.cast<int>();
}

// A number in [0, 1) that looks random (the finaliser of SplitMix64: Steele, Lea and Flood, 2014).
double random_of(std::uint64_t number) {
  number += 0x9e3779b97f4a7c15u;
  number = (number ^ number >> 30) * 0xbf58476d1ce4e5b9u;
  number = (number ^ number >> 27) * 0x94d049bb133111ebu;
  return double((number ^ number >> 31) >> 11) * 0x1p-53;
}

}  // namespace

// The cells that one hull may touch.
class SweptVolume::Search {
 public:
  Search(SweptVolume& swept, const hull::HullQuery& query)
      : swept_(swept), query_(query), cubes_(query) {}

  void run() {
    const Vector3i size = cell_count();
    search(Vector3i::Zero(), std::bit_width(unsigned(size.maxCoeff() - 1)));
  }

 private:
  Vector3i cell_count() const { return swept_.cells_.size() - Vector3i::Constant(2); }

  // The cells [at, at + 2^level) along each axis.
  void search(const Vector3i& at, int level) {
    if ((at.array() >= cell_count().array()).any()) return;
    const int edge = 1 << level;
    const Vector3i end = (at + Vector3i::Constant(edge)).cwiseMin(cell_count());
    if (level <= kDoneLevel && is_done(at, end)) return;
    const double half_m = swept_.cell_m_ * edge / 2;
    const Vector3d center_m =
        swept_.origin_m_ + swept_.cell_m_ * at.cast<double>() + Vector3d::Constant(half_m);
    if (is_free(center_m, half_m)) return;
    if (query_.solid_radius_m(center_m) > half_m * std::numbers::sqrt3 * (1 + kCellRounding)) {
      for_cells(at, end, [&](const Vector3i& cell) {
        sample_bits(cell).store(kAllSamples, std::memory_order_relaxed);
        set(cell);
      });
    } else if (level == 0) {
      add_cell(at, center_m, half_m);
    } else {
      for (int octant = 0; octant < 8; ++octant)
        search(at + (edge / 2) * corner_offset(octant), level - 1);
    }
  }

  // Returns whether hulls before have set all that a hull can set in the cells.
  bool is_done(const Vector3i& at, const Vector3i& end) {
    bool is_done = true;
    for_cells(at, end, [&](const Vector3i& cell) {
      is_done = is_done && sample_bits(cell).load(std::memory_order_relaxed) == kAllSamples;
    });
    return is_done;
  }

  void add_cell(const Vector3i& cell, const Vector3d& center_m, double half_m) {
    const std::atomic_ref<std::uint8_t> samples = sample_bits(cell);
    const std::uint8_t before = samples.load(std::memory_order_relaxed);
    std::uint8_t found = 0;
    for (int i = 0; i < kSamples; ++i)
      if ((before >> i & 1) == 0 && query_.contains(sample_m(cell, i)))
        found |= std::uint8_t(1 << i);
    samples.fetch_or(found, std::memory_order_relaxed);
    const Vector3i in_grid = cell + Vector3i::Ones();
    if (swept_.cells_.at_shared(in_grid.x(), in_grid.y(), in_grid.z())) return;
    if (found != 0 || may_touch(center_m, half_m, kHalvingsOfACell)) set(cell);
  }

  // False: certified that the hull does not touch the cube, which is not certified as a whole.
  bool may_touch(const Vector3d& center_m, double half_m, int halvings) const {
    if (halvings == 0 || query_.contains(center_m)) return true;
    for (int octant = 0; octant < 8; ++octant) {
      const Vector3d of_octant_m =
          center_m + half_m * (corner_offset(octant).cast<double>() - Vector3d::Constant(0.5));
      if (!is_free(of_octant_m, half_m / 2) && may_touch(of_octant_m, half_m / 2, halvings - 1))
        return true;
    }
    return false;
  }

  bool is_free(const Vector3d& center_m, double half_m) const {
    const double rounding_m = kCellRounding * (half_m + center_m.cwiseAbs().sum());
    return cubes_.test(center_m, half_m + rounding_m).free;
  }

  // Each octant of a cell has one sample.
  Vector3d sample_m(const Vector3i& cell, int i) const {
    const std::uint64_t number = (index_of(cell) * kSamples + std::size_t(i)) * 3;
    const Vector3d in_octant(random_of(number), random_of(number + 1), random_of(number + 2));
    return swept_.origin_m_ + swept_.cell_m_ * (cell.cast<double>() +
                                                (corner_offset(i).cast<double>() + in_octant) / 2);
  }

  std::size_t index_of(const Vector3i& cell) const {
    const Vector3i size = cell_count();
    return (std::size_t(cell.z()) * std::size_t(size.y()) + std::size_t(cell.y())) *
               std::size_t(size.x()) +
           std::size_t(cell.x());
  }
  std::atomic_ref<std::uint8_t> sample_bits(const Vector3i& cell) {
    return std::atomic_ref(swept_.samples_[index_of(cell)]);
  }
  void set(const Vector3i& cell) {
    swept_.cells_.set_shared(cell.x() + 1, cell.y() + 1, cell.z() + 1);
  }

  template <class Visit>
  static void for_cells(const Vector3i& begin, const Vector3i& end, const Visit& visit) {
    for (int z = begin.z(); z < end.z(); ++z)
      for (int y = begin.y(); y < end.y(); ++y)
        for (int x = begin.x(); x < end.x(); ++x) visit(Vector3i(x, y, z));
  }

  static constexpr int kDoneLevel = 3;  // larger blocks are seldom done as a whole
  SweptVolume& swept_;
  const hull::HullQuery& query_;
  collision::CubeQuery cubes_;
};

SweptVolume::SweptVolume(const SweptVolumeOptions& options)
    : origin_m_(options.within_world_m.min()),
      cell_m_(options.cell_m),
      cells_(cells_in(options) + Vector3i::Constant(2)),
      samples_(std::size_t(cells_in(options).cast<double>().prod()), 0) {}

void SweptVolume::add(const hull::HullQuery& query) {
  if (!query.hull().empty()) Search(*this, query).run();
}

SweptSurface SweptVolume::surface() const {
  SweptSurface surface;
  BitGrid cells = cells_;
  surface.added_cells = make_well_composed(cells);
  surface.cells = cells.count();
  surface.mesh = boundary_mesh(cells, origin_m_ - Vector3d::Constant(cell_m_), cell_m_);
  surface.volume_m3 = geometry::enclosed_volume_m3(surface.mesh);
  // Each sample stands for its octant of the cell. Those of cells that hold a border of the sweep
  // vary; the variance of one is at most a quarter.
  std::size_t in_hull = 0, sure_cells = 0;
  for (const std::uint8_t bits : samples_) {
    in_hull += std::size_t(std::popcount(bits));
    sure_cells += bits == kAllSamples;
  }
  const double sample_m3 = std::pow(cell_m_, 3) / kSamples;
  surface.hull_volume_m3 = sample_m3 * double(in_hull);
  surface.hull_volume_error_m3 =
      sample_m3 * std::sqrt(0.25 * kSamples * double(cells_.count() - sure_cells));
  return surface;
}

}  // namespace fivepipe::surface
