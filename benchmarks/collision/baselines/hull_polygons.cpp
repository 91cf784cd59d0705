#include "benchmarks/collision/baselines/hull_polygons.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace fivepipe::baselines {
namespace {

using Eigen::Vector3d;

// A brick has 8 x 8 x 8 cells and as many grid points, or 9 x 9 x 9 with the neighbours on the far
// sides.
constexpr int in_brick(int x, int y, int z) { return (z * 8 + y) * 8 + x; }
constexpr int in_surroundings(int x, int y, int z) { return (z * 9 + y) * 9 + x; }

// Returns the position of a cell's vertex for each set of corners inside (bit x + 2 y + 4 z): the
// mean of the midpoints of the crossed edges.
std::array<Vector3d, 256> vertices_in_cell() {
  std::array<Vector3d, 256> table;
  for (int corners = 0; corners < 256; ++corners) {
    Vector3d sum = Vector3d::Zero();
    int edges = 0;
    for (int a = 0; a < 8; ++a)
      for (int axis = 0; axis < 3; ++axis) {
        const int b = a | 1 << axis;
        if (a == b || (corners >> a & 1) == (corners >> b & 1)) continue;
        sum += 0.5 * Vector3d((a & 1) + (b & 1), (a >> 1 & 1) + (b >> 1 & 1), (a >> 2) + (b >> 2));
        ++edges;
      }
    table[std::size_t(corners)] = edges ? Vector3d(sum / edges) : sum;
  }
  return table;
}

int corners_of(const std::array<std::uint8_t, 729>& inside, int x, int y, int z) {
  int corners = 0;
  for (int c = 0; c < 8; ++c)
    corners |= inside[std::size_t(in_surroundings(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2)))]
               << c;
  return corners;
}

constexpr int kStep[3] = {in_surroundings(1, 0, 0), in_surroundings(0, 1, 0),
                          in_surroundings(0, 0, 1)};

}  // namespace

HullPolygons::HullPolygons(double cell_m) : cell_m_(cell_m) {
  if (!(cell_m > 0 && std::isfinite(cell_m)))
    throw std::invalid_argument("HullPolygons: cell_m must be > 0");
}

int& HullPolygons::index_at(const Cell& b) {
  return index_[(std::size_t(b[2] - index_min_[2]) * std::size_t(index_size_[1]) +
                 std::size_t(b[1] - index_min_[1])) *
                    std::size_t(index_size_[0]) +
                std::size_t(b[0] - index_min_[0])];
}

int HullPolygons::index_at(const Cell& b) const {
  for (int axis = 0; axis < 3; ++axis)
    if (b[axis] < index_min_[axis] || b[axis] >= index_min_[axis] + index_size_[axis]) return kFree;
  return const_cast<HullPolygons*>(this)->index_at(b);
}

// Descends from the whole grid. A node that a ball certifies free or solid is not divided.
void HullPolygons::find_bricks(const hull::HullQuery& query) {
  std::vector<Node> nodes{{{0, 0, 0}, across_}}, next, solid;
  std::vector<int> kind;
  for (bricks_.clear(); !nodes.empty(); nodes.swap(next)) {
    kind.assign(nodes.size(), 0);
    query.hull().pool().run(int((nodes.size() + 63) / 64), [&](int piece, int) {
      for (std::size_t i = std::size_t(piece) * 64;
           i < std::min(nodes.size(), std::size_t(piece + 1) * 64); ++i) {
        const double half_m = 4 * cell_m_ * nodes[i].size;
        const int x = nodes[i].brick[0], y = nodes[i].brick[1], z = nodes[i].brick[2];
        const int end = 8 * nodes[i].size;
        const auto all_axes = [&](const auto& holds) {
          return holds(8 * x, points_[0]) && holds(8 * y, points_[1]) && holds(8 * z, points_[2]);
        };
        const Vector3d center_world_m = point_m({8 * x, 8 * y, 8 * z}) + Vector3d::Constant(half_m);
        if (!all_axes([](int first, int points) { return first < points; }) ||
            query.free_radius_m(center_world_m) > std::sqrt(3.0) * half_m)
          kind[i] = kFree;
        else if (all_axes(
                     [&](int first, int points) { return first > 0 && first + end < points; }) &&
                 query.solid_radius_m(center_world_m) > std::sqrt(3.0) * half_m)
          kind[i] = kSolid;
      }
    });
    next.clear();
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      if (kind[i] == kFree) continue;
      if (kind[i] == kSolid)
        solid.push_back(nodes[i]);
      else if (nodes[i].size == 1)
        bricks_.push_back({nodes[i].brick, {}, {}, 0, 0, 0, 0});
      else
        for (int c = 0; c < 8; ++c) {
          const int half = nodes[i].size / 2;
          next.push_back(
              {{nodes[i].brick[0] + (c & 1) * half, nodes[i].brick[1] + (c >> 1 & 1) * half,
                nodes[i].brick[2] + (c >> 2) * half},
               half});
        }
    }
  }
  make_index(solid);
}

void HullPolygons::make_index(const std::vector<Node>& solid) {
  Cell first{across_, across_, across_}, last{-1, -1, -1};
  const auto extend = [&](const Cell& brick, int size) {
    for (int axis = 0; axis < 3; ++axis) {
      first[axis] = std::min(first[axis], brick[axis]);
      last[axis] = std::max(last[axis], brick[axis] + size - 1);
    }
  };
  for (const Brick& b : bricks_) extend(b.brick, 1);
  for (const Node& n : solid) extend(n.brick, n.size);
  index_min_ = first;
  std::size_t size = 1;
  for (int axis = 0; axis < 3; ++axis)
    size *= std::size_t(index_size_[axis] = std::max(0, last[axis] - first[axis] + 1));
  index_.assign(size, kFree);
  for (std::size_t i = 0; i < bricks_.size(); ++i) index_at(bricks_[i].brick) = int(i);
  for (const Node& n : solid)
    for (int z = n.brick[2]; z < n.brick[2] + n.size; ++z)
      for (int y = n.brick[1]; y < n.brick[1] + n.size; ++y)
        for (int x = n.brick[0]; x < n.brick[0] + n.size; ++x) index_at({x, y, z}) = kSolid;
}

void HullPolygons::test_points(const hull::HullQuery& query,
                               std::span<const hull::PointSimdCamera> cameras, Brick& brick) const {
  std::array<Vector3d, 512> points_world_m;
  std::array<hull::InHull, 512> verdicts;
  for (int z = 0; z < 8; ++z)
    for (int y = 0; y < 8; ++y)
      for (int x = 0; x < 8; ++x)
        points_world_m[std::size_t(in_brick(x, y, z))] =
            point_m({8 * brick.brick[0] + x, 8 * brick.brick[1] + y, 8 * brick.brick[2] + z});
  hull::contains_simd(cameras, points_world_m, verdicts.data());
  for (std::size_t i = 0; i < 512; ++i)
    brick.inside[i] = verdicts[i] == hull::InHull::uncertain ? query.contains(points_world_m[i])
                                                             : verdicts[i] == hull::InHull::yes;
  // Points at the border of the volume count as outside, so that every crossed edge has four cells.
  for (int axis = 0; axis < 3; ++axis) {
    const int first = 8 * brick.brick[axis];
    if (first > 0 && first + 8 <= points_[axis]) continue;
    for (int i = 0; i < 512; ++i)
      if (const int at = first + (i >> 3 * axis & 7); at == 0 || at >= points_[axis])
        brick.inside[std::size_t(i)] = 0;
  }
}

std::array<std::uint8_t, 729> HullPolygons::surroundings(const Brick& brick) const {
  std::array<std::uint8_t, 729> inside;
  for (int c = 0; c < 8; ++c) {  // c = 0 is the brick itself
    const int dx = c & 1, dy = c >> 1 & 1, dz = c >> 2;
    const int of =
        c ? index_at({brick.brick[0] + dx, brick.brick[1] + dy, brick.brick[2] + dz}) : 0;
    const Brick* neighbour = c == 0 ? &brick : of >= 0 ? &bricks_[std::size_t(of)] : nullptr;
    for (int z = 0; z < (dz ? 1 : 8); ++z)
      for (int y = 0; y < (dy ? 1 : 8); ++y)
        for (int x = 0; x < (dx ? 1 : 8); ++x)
          inside[std::size_t(in_surroundings(x + 8 * dx, y + 8 * dy, z + 8 * dz))] =
              neighbour ? neighbour->inside[std::size_t(in_brick(x, y, z))] : of == kSolid;
  }
  return inside;
}

void HullPolygons::count(Brick& brick) const {
  const auto inside = surroundings(brick);
  brick.vertices = brick.quads = 0;
  for (int z = 0; z < 8; ++z)
    for (int y = 0; y < 8; ++y)
      for (int x = 0; x < 8; ++x) {
        const int corners = corners_of(inside, x, y, z);
        const bool crossed = corners != 0 && corners != 255;
        brick.vertex_of_cell[std::size_t(in_brick(x, y, z))] =
            crossed ? std::uint16_t(brick.vertices++) : kNoVertex;
        if (!crossed) continue;
        for (int axis = 0; axis < 3; ++axis)
          brick.quads += (corners & 1) != (corners >> (1 << axis) & 1);
      }
}

std::uint32_t HullPolygons::vertex_at(const Cell& cell) const {
  const Brick& brick = bricks_[std::size_t(index_at({cell[0] >> 3, cell[1] >> 3, cell[2] >> 3}))];
  return brick.first_vertex +
         brick.vertex_of_cell[std::size_t(in_brick(cell[0] & 7, cell[1] & 7, cell[2] & 7))];
}

void HullPolygons::write(const Brick& brick) {
  static const std::array<Vector3d, 256> kVertices = vertices_in_cell();
  const auto inside = surroundings(brick);
  std::size_t triangle = 2 * std::size_t(brick.first_quad);
  for (int z = 0; z < 8; ++z)
    for (int y = 0; y < 8; ++y)
      for (int x = 0; x < 8; ++x) {
        const std::uint16_t vertex = brick.vertex_of_cell[std::size_t(in_brick(x, y, z))];
        if (vertex == kNoVertex) continue;
        const Cell cell{8 * brick.brick[0] + x, 8 * brick.brick[1] + y, 8 * brick.brick[2] + z};
        mesh_.vertices_m[brick.first_vertex + vertex] =
            point_m(cell) + cell_m_ * kVertices[std::size_t(corners_of(inside, x, y, z))];
        const int corner = in_surroundings(x, y, z);
        for (int axis = 0; axis < 3; ++axis) {  // the edge from the cell's minimum corner
          const bool from = inside[std::size_t(corner)],
                     to = inside[std::size_t(corner + kStep[axis])];
          if (from == to) continue;
          Cell b = cell, c = cell, d = cell;
          const int second = (axis + 1) % 3, third = (axis + 2) % 3;
          --b[second], --c[second], --c[third], --d[third];
          // The four cells around the edge, counter-clockwise seen from its end.
          const std::uint32_t quad[4] = {vertex_at(c), vertex_at(d), vertex_at(cell), vertex_at(b)};
          mesh_.triangles[triangle++] = {quad[0], quad[from ? 1 : 2], quad[from ? 2 : 1]};
          mesh_.triangles[triangle++] = {quad[0], quad[from ? 2 : 3], quad[from ? 3 : 2]};
        }
      }
}

const geometry::Mesh& HullPolygons::polygonise(const hull::HullQuery& query,
                                               const Eigen::AlignedBox3d& volume_world_m) {
  const double bricks = std::ceil(volume_world_m.sizes().maxCoeff() / (8 * cell_m_)) + 1;
  if (!(bricks <= kMaxBricks))
    throw std::invalid_argument("HullPolygons: more than " + std::to_string(kMaxBricks) +
                                " bricks along an axis of the volume");
  for (across_ = 1; across_ < bricks;) across_ *= 2;
  // Adds one point beyond the volume on each side.
  for (int axis = 0; axis < 3; ++axis)
    points_[axis] = int(std::ceil(volume_world_m.sizes()[axis] / cell_m_)) + 2;
  corner_world_m_ = volume_world_m.min() - Vector3d::Constant(cell_m_);
  find_bricks(query);
  base::WorkerPool& pool = query.hull().pool();
  const auto cameras = hull::point_simd_cameras(query.hull());
  pool.run(int(bricks_.size()),
           [&](int i, int) { test_points(query, cameras, bricks_[std::size_t(i)]); });
  pool.run(int(bricks_.size()), [&](int i, int) { count(bricks_[std::size_t(i)]); });
  std::uint32_t vertices = 0, quads = 0;
  for (Brick& b : bricks_) {
    b.first_vertex = vertices, b.first_quad = quads;
    vertices += b.vertices, quads += b.quads;
  }
  mesh_.vertices_m.resize(vertices);
  mesh_.triangles.resize(2 * std::size_t(quads));
  pool.run(int(bricks_.size()), [&](int i, int) { write(bricks_[std::size_t(i)]); });
  return mesh_;
}

bool HullPolygons::inside_at(const Cell& point) const {
  const int brick = index_at({point[0] >> 3, point[1] >> 3, point[2] >> 3});
  if (brick < 0) return brick == kSolid;
  return bricks_[std::size_t(brick)]
      .inside[std::size_t(in_brick(point[0] & 7, point[1] & 7, point[2] & 7))];
}

bool HullPolygons::contains(const Vector3d& p_world_m) const {
  const Vector3d at = (p_world_m - corner_world_m_) / cell_m_;
  Cell cell;
  for (int axis = 0; axis < 3; ++axis) {
    // The grid points outside the indexed bricks are outside the hull. NaN is outside too.
    if (!(at[axis] >= 8 * index_min_[axis] - 1 &&
          at[axis] < 8 * (index_min_[axis] + index_size_[axis])))
      return false;
    cell[axis] = int(std::floor(at[axis]));
  }
  double inside = 0;
  for (int c = 0; c < 8; ++c) {
    const Cell offset{c & 1, c >> 1 & 1, c >> 2};
    double weight = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const double fraction = at[axis] - cell[axis];
      weight *= offset[axis] ? fraction : 1 - fraction;
    }
    if (inside_at({cell[0] + offset[0], cell[1] + offset[1], cell[2] + offset[2]}))
      inside += weight;
  }
  return inside >= 0.5;
}

}  // namespace fivepipe::baselines
