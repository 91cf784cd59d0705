#include "common/collision/tracking/hull_components.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <stdexcept>

#include "common/collision/detection/cpu/contact_simd.h"
#include "common/geometry/box_visibility.h"
#include "common/hull/image_cone.h"

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

constexpr int kWordBits = 64;

// One bit per cell, set if the cell is in the hull. x varies fastest; each row is padded to whole
// words.
class CellGrid {
 public:
  explicit CellGrid(const Vector3i& size)
      : size_(size),
        words_per_row_((size.x() + kWordBits - 1) / kWordBits),
        bits_(std::size_t(words_per_row_) * size.y() * size.z(), 0) {}
  const Vector3i& size() const { return size_; }
  void set_run(int x0, int x1, int y, int z) {
    for (int x = x0; x < x1; ++x) row(y, z)[x / kWordBits] |= std::uint64_t{1} << (x % kWordBits);
  }
  std::uint64_t* row(int y, int z) {
    return bits_.data() + (std::size_t(z) * size_.y() + y) * words_per_row_;
  }
  const std::uint64_t* row(int y, int z) const {
    return bits_.data() + (std::size_t(z) * size_.y() + y) * words_per_row_;
  }
  int words_per_row() const { return words_per_row_; }

 private:
  Vector3i size_;
  int words_per_row_;
  std::vector<std::uint64_t> bits_;
};

struct Node {  // the cells [at, at + 2^level) along each axis
  Vector3i at;
  int level;
};

class CellSearch {
 public:
  CellSearch(const hull::HullQuery& query, const HullComponentsOptions& options, CellGrid& grid)
      : query_(query), options_(options), grid_(grid), rule_{query.hull().rule()} {
    Eigen::Isometry3d world_from_box = Eigen::Isometry3d::Identity();
    world_from_box.translation() = options.within_world_m.center();
    // The root cell starts at the box's minimum corner and may extend beyond its other sides.
    const double reach_m = options.within_world_m.diagonal().norm() +
                           2 * options.cell_m * std::bit_ceil(unsigned(grid.size().maxCoeff()));
    for (const hull::CpuHull::MapCamera& camera : query.hull().cameras()) {
      const auto map = object_map(camera, world_from_box, reach_m, rule_.hull.limits);
      if (map)
        maps_.push_back(*map);
      else
        ++rule_.unmapped;
    }
  }

  void run() {
    const int level = std::bit_width(unsigned(grid_.size().maxCoeff() - 1));
    std::vector<Node> nodes{{Vector3i::Zero(), level}}, next;
    for (int l = level; !nodes.empty() && l > 0; --l, nodes.swap(next)) split(nodes, next);
    std::vector<Vector3d> centers;
    for (const Node& node : nodes)
      centers.push_back(options_.within_world_m.min() +
                        options_.cell_m * (node.at.cast<double>().array() + 0.5).matrix());
    std::vector<std::uint8_t> inside(centers.size());
    query_.contains(centers, inside);
    for (std::size_t i = 0; i < nodes.size(); ++i)
      if (inside[i])
        grid_.set_run(nodes[i].at.x(), nodes[i].at.x() + 1, nodes[i].at.y(), nodes[i].at.z());
  }

 private:
  // Tests the octants of all nodes: sets those in the hull in the grid and appends mixed ones to
  // `next`.
  void split(const std::vector<Node>& nodes, std::vector<Node>& next) {
    next.clear();
    std::array<Node, Bvh::kArity> batch;
    int count = 0;
    for (const Node& node : nodes)
      for (int octant = 0; octant < 8; ++octant) {
        const int half = 1 << (node.level - 1);
        const Node child{node.at + half * Vector3i(octant & 1, octant >> 1 & 1, octant >> 2),
                         node.level - 1};
        if ((child.at.array() >= grid_.size().array()).any()) continue;
        batch[std::size_t(count++)] = child;
        if (count == Bvh::kArity) classify(batch, count, next), count = 0;
      }
    classify(batch, count, next);
  }

  void classify(const std::array<Node, Bvh::kArity>& batch, int count, std::vector<Node>& next) {
    Bvh::Boxes boxes;
    const Vector3d center = options_.within_world_m.center();
    for (std::size_t i = 0; i < Bvh::kArity; ++i)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        boxes.half_m[axis][i] = -1, boxes.center_m[axis][i] = 0;
        if (int(i) >= count) continue;
        const double size_m = options_.cell_m * (1 << batch[i].level);
        const double first_m =
            options_.within_world_m.min()[Eigen::Index(axis)] - center[Eigen::Index(axis)];
        const double center_m =
            first_m + options_.cell_m * batch[i].at[Eigen::Index(axis)] + 0.5 * size_m;
        boxes.center_m[axis][i] = float(center_m);
        boxes.half_m[axis][i] = float(0.5 * size_m + kSlack * (size_m + std::abs(center_m)));
      }
    const ContactBits bits = classify_boxes(maps_, boxes, rule_);
    for (int i = 0; i < count; ++i) {
      const Node& node = batch[std::size_t(i)];
      if (bits.free >> i & 1) continue;
      if (!(bits.solid >> i & 1) || rule_.unmapped > 0 || !is_in_rule_box(node)) {
        next.push_back(node);
        continue;
      }
      const Vector3i end = (node.at.array() + (1 << node.level)).min(grid_.size().array());
      for (int z = node.at.z(); z < end.z(); ++z)
        for (int y = node.at.y(); y < end.y(); ++y) grid_.set_run(node.at.x(), end.x(), y, z);
    }
  }

  // Whether the node, with a margin for rounding, is in the rule's box.
  bool is_in_rule_box(const Node& node) const {
    if (!rule_.hull.is_bounded()) return true;
    const double size_m = options_.cell_m * (1 << node.level), margin_m = kSlack * size_m;
    const Vector3d low_m = options_.within_world_m.min() + options_.cell_m * node.at.cast<double>();
    return rule_.hull.within_world_m.contains(
        Eigen::AlignedBox3d(low_m.array() + margin_m, low_m.array() + size_m - margin_m));
  }

  // Relative bound on the rounding error of a cell's centre and half size in float.
  static constexpr double kSlack = 0x1p-22;
  const hull::HullQuery& query_;
  const HullComponentsOptions& options_;
  CellGrid& grid_;
  std::vector<ObjectMap> maps_;
  ContactRule rule_;
};

struct Run {  // the cells [x0, x1) of row (y, z)
  int x0, x1, y, z;
};

std::vector<Run> runs_of(const CellGrid& grid, std::vector<std::size_t>& first_of_row) {
  std::vector<Run> runs;
  for (int z = 0; z < grid.size().z(); ++z)
    for (int y = 0; y < grid.size().y(); ++y) {
      first_of_row.push_back(runs.size());
      const std::uint64_t* words = grid.row(y, z);
      int begin = -1;
      for (int w = 0; w < grid.words_per_row(); ++w) {
        if (begin < 0 && words[w] == 0) continue;
        for (int x = w * kWordBits; x < (w + 1) * kWordBits; ++x) {
          const bool in = words[w] >> (x % kWordBits) & 1;
          if (in && begin < 0) begin = x;
          if (!in && begin >= 0) runs.push_back({begin, x, y, z}), begin = -1;
        }
      }
      if (begin >= 0) runs.push_back({begin, grid.size().x(), y, z});
    }
  first_of_row.push_back(runs.size());
  return runs;
}

std::size_t root_of(std::vector<std::size_t>& parent, std::size_t i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

// Joins the runs of two neighbouring rows that touch, at least at a corner.
void join_rows(const std::vector<Run>& runs, std::size_t a, std::size_t a_end, std::size_t b,
               std::size_t b_end, std::vector<std::size_t>& parent) {
  while (a < a_end && b < b_end) {
    if (runs[a].x0 <= runs[b].x1 && runs[b].x0 <= runs[a].x1) {
      const std::size_t ra = root_of(parent, a), rb = root_of(parent, b);
      parent[std::max(ra, rb)] = std::min(ra, rb);
    }
    if (runs[a].x1 < runs[b].x1)
      ++a;
    else
      ++b;
  }
}

std::vector<std::size_t> joined(const CellGrid& grid, const std::vector<Run>& runs,
                                const std::vector<std::size_t>& first_of_row) {
  std::vector<std::size_t> parent(runs.size());
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  const int rows = grid.size().y(), layers = grid.size().z();
  for (int z = 0; z < layers; ++z)
    for (int y = 0; y < rows; ++y)
      for (const auto& [dy, dz] : {std::pair{-1, 0}, {-1, -1}, {0, -1}, {1, -1}}) {
        if (y + dy < 0 || y + dy >= rows || z + dz < 0) continue;
        const auto here = std::size_t(z) * rows + y, there = std::size_t(z + dz) * rows + (y + dy);
        join_rows(runs, first_of_row[here], first_of_row[here + 1], first_of_row[there],
                  first_of_row[there + 1], parent);
      }
  for (std::size_t i = 0; i < runs.size(); ++i) parent[i] = root_of(parent, i);
  return parent;
}

struct Moments {
  double count = 0;
  Vector3d sum = Vector3d::Zero();
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
};

// Adds the moments of the run's cell centres about `origin`, in closed form. Units: cells.
void add_run(const Run& run, const Vector3d& origin, Moments& m) {
  const double n = run.x1 - run.x0;
  const Vector3d center = Vector3d(0.5 * (run.x0 + run.x1), run.y + 0.5, run.z + 0.5) - origin;
  m.count += n;
  m.sum += n * center;
  m.products += n * center * center.transpose();
  m.products(0, 0) += n * (n * n - 1) / 12;
}

// Returns whether some camera sees an object at its image border, and the box there or not wholly.
bool at_an_image_border(const hull::HullQuery& query, const Eigen::AlignedBox3d& box_world_m) {
  for (const hull::CpuHull::MapCamera& camera : query.hull().cameras()) {
    const hull::PixelRect image = hull::image_of(camera.camera), &object = camera.skip_map.bounds();
    if (object.empty()) continue;  // Limits::seen
    // With Limits::seen, a camera that does not see the box bounds nothing of it.
    if (query.hull().rule().limits == hull::Limits::seen &&
        !geometry::is_box_visible(camera.camera, box_world_m))
      continue;
    if (object.u0_px > image.u0_px && object.v0_px > image.v0_px && object.u1_px < image.u1_px &&
        object.v1_px < image.v1_px)
      continue;
    for (int corner = 0; corner < 8; ++corner) {
      const auto uv_px = geometry::project(
          camera.camera, box_world_m.corner(Eigen::AlignedBox3d::CornerType(corner)));
      if (!uv_px ||
          !hull::holds({image.u0_px + 1, image.v0_px + 1, image.u1_px - 1, image.v1_px - 1},
                       uv_px->x(), uv_px->y()))
        return true;
    }
  }
  return false;
}

Vector3i checked_size(const HullComponentsOptions& options) {
  const Eigen::AlignedBox3d& box = options.within_world_m;
  if (!(options.cell_m > 0 && std::isfinite(options.cell_m)))
    throw std::invalid_argument("hull components: cell_m is not positive and finite");
  if (!(box.min().allFinite() && box.max().allFinite() && (box.sizes().array() > 0).all()))
    throw std::invalid_argument("hull components: the search box is empty or not finite");
  const Vector3d cells = (box.sizes() / options.cell_m).array().ceil();
  if (!(cells.prod() <= double(kMaxComponentCells)))
    throw std::invalid_argument(
        "hull components: too many cells in the search box; increase cell_m or reduce the box");
  return cells.cast<int>();
}

struct Labelled {  // components by their first run; other elements are unused
  std::vector<Moments> moments;
  std::vector<HullComponent> components;  // only box and clipped
};

Labelled measure(const std::vector<Run>& runs, const std::vector<std::size_t>& component_of,
                 const Vector3i& size, const HullComponentsOptions& options,
                 const Vector3d& origin) {
  Labelled result{std::vector<Moments>(runs.size()), std::vector<HullComponent>(runs.size())};
  // Of a last layer that the box covers less than half, no centre is in the box, nor in a hull that
  // the box cuts.
  const Vector3i last =
      size.cwiseMin((options.within_world_m.sizes() / options.cell_m + Vector3d::Constant(0.5))
                        .array()
                        .floor()
                        .cast<int>()
                        .matrix());
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const Run& r = runs[i];
    add_run(r, origin, result.moments[component_of[i]]);
    HullComponent& component = result.components[component_of[i]];
    for (const Vector3d& corner : {Vector3d(r.x0, r.y, r.z), Vector3d(r.x1, r.y + 1, r.z + 1)})
      component.box_world_m.extend(options.within_world_m.min() + options.cell_m * corner);
    component.clipped |=
        r.x0 == 0 || r.x1 >= last.x() || r.y == 0 || r.y + 1 >= last.y() || r.z + 1 >= last.z();
  }
  return result;
}

// Sets volume, centroid and covariance from the moments about `origin` [cells].
void set_moments(const Moments& m, const HullComponentsOptions& options, const Vector3d& origin,
                 HullComponent& component) {
  const Vector3d mean = m.sum / m.count;
  component.cells = std::size_t(m.count);
  component.volume_m3 = m.count * std::pow(options.cell_m, 3);
  component.centroid_world_m = options.within_world_m.min() + options.cell_m * (mean + origin);
  component.covariance_world_m2 =
      options.cell_m * options.cell_m *
      (m.products / m.count - mean * mean.transpose() + Eigen::Matrix3d::Identity() / 12);
}

// index: of the component in `components`, by first run; runs.size() if it was dropped.
void add_outlines(const hull::HullQuery& query, const HullComponentsOptions& options,
                  const std::vector<Run>& runs, const std::vector<std::size_t>& component_of,
                  const std::vector<std::size_t>& index, std::vector<HullComponent>& components) {
  std::vector<std::vector<Vector3d>> points_world_m(components.size());
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (index[component_of[i]] == runs.size()) continue;
    const Vector3d first_cell =
        Vector3d(runs[i].x0, runs[i].y, runs[i].z) + Vector3d::Constant(0.5);
    points_world_m[index[component_of[i]]].push_back(options.within_world_m.min() +
                                                     options.cell_m * first_cell);
  }
  auto outlines = component_outlines(query, points_world_m);
  for (std::size_t i = 0; i < components.size(); ++i)
    components[i].outlines = std::move(outlines[i]);
}

}  // namespace

std::vector<HullComponent> hull_components(const hull::HullQuery& query,
                                           const HullComponentsOptions& options) {
  const Vector3i size = checked_size(options);
  if (query.hull().empty()) return {};
  CellGrid grid(size);
  CellSearch(query, options, grid).run();
  std::vector<std::size_t> first_of_row;
  const std::vector<Run> runs = runs_of(grid, first_of_row);
  const std::vector<std::size_t> component_of = joined(grid, runs, first_of_row);
  const Vector3d origin = 0.5 * size.cast<double>();
  Labelled labelled = measure(runs, component_of, size, options, origin);

  std::vector<HullComponent> found;
  std::vector<std::size_t> index(runs.size(), runs.size());
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (!(labelled.moments[i].count >= double(std::max<std::size_t>(options.min_cells, 1))))
      continue;
    index[i] = found.size();
    HullComponent& component = labelled.components[i];
    set_moments(labelled.moments[i], options, origin, component);
    component.clipped |= at_an_image_border(query, component.box_world_m);
    found.push_back(component);
  }
  if (options.outlines) add_outlines(query, options, runs, component_of, index, found);
  std::stable_sort(found.begin(), found.end(), [](const HullComponent& a, const HullComponent& b) {
    return a.cells > b.cells;
  });
  return found;
}

}  // namespace fivepipe::collision
