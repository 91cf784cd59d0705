// Baseline: the hull's surface as triangles, for a collision library that needs a mesh. Source:
// Gibson, "Constrained Elastic Surface Nets", MICCAI 1998, in its naive form: a vertex in each cell
// that the surface crosses, at the mean of its crossed edges' midpoints, and a quadrangle for each
// crossed edge of the grid. It gives fewer and better shaped triangles than marching cubes.
//
// Optimised for a fair comparison:
// - fivepipe's certified balls find the bricks of 8x8x8 cells from coarse to fine, so that only
//   bricks at the hull's surface are sampled.
// - SIMD tests the samples; threads share the bricks.
// - A table of the 256 cases gives a cell's vertex.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "common/geometry/mesh.h"
#include "common/hull/cpu/point_simd.h"
#include "common/hull/query/hull_query.h"

namespace fivepipe::baselines {

class HullPolygons {
 public:
  // Throws std::invalid_argument unless cell_m > 0.
  explicit HullPolygons(double cell_m);

  // Returns the closed surface, in the world frame, that separates the grid points in the hull from
  // the others; triangles are counter-clockwise seen from outside. It is within a cell's diagonal
  // of the hull's border; parts thinner than a cell may be lost, and the hull is cut off at the
  // volume. Keeps its buffers: the mesh is valid until the next call. The result does not depend on
  // the pool's threads. Throws std::invalid_argument for more than kMaxBricks along an axis.
  const geometry::Mesh& polygonise(const hull::HullQuery& query,
                                   const Eigen::AlignedBox3d& volume_world_m);

  // Whether the point is in the volume that the last call polygonised: the trilinear interpolation
  // of the grid points of its cell (1 in the hull, 0 outside) is at least 1/2. The surface does not
  // pass through a cell with eight equal grid points, so there the answer is exact.
  bool contains(const Eigen::Vector3d& p_world_m) const;

  std::size_t points_tested() const { return 512 * bricks_.size(); }  // by the last call

  static constexpr int kMaxBricks = 1024;

 private:
  using Cell = std::array<int, 3>;  // index of a cell, a brick or a grid point
  struct Node {
    Cell brick;  // the first of size^3 bricks
    int size;
  };
  struct Brick {
    Cell brick;
    std::array<std::uint8_t, 512> inside;           // by grid point
    std::array<std::uint16_t, 512> vertex_of_cell;  // relative to first_vertex, or kNoVertex
    std::uint32_t vertices, quads, first_vertex, first_quad;
  };
  static constexpr std::uint16_t kNoVertex = 0xffff;
  static constexpr int kFree = -1, kSolid = -2;  // entries of the index

  void find_bricks(const hull::HullQuery& query);
  void make_index(const std::vector<Node>& solid);
  void test_points(const hull::HullQuery& query, std::span<const hull::PointSimdCamera> cameras,
                   Brick& brick) const;
  std::array<std::uint8_t, 729> surroundings(const Brick& brick) const;
  void count(Brick& brick) const;
  void write(const Brick& brick);
  bool inside_at(const Cell& point) const;
  int& index_at(const Cell& brick);
  int index_at(const Cell& brick) const;
  std::uint32_t vertex_at(const Cell& cell) const;
  Eigen::Vector3d point_m(const Cell& at) const {
    return corner_world_m_ + cell_m_ * Eigen::Vector3d(at[0], at[1], at[2]);
  }

  double cell_m_;
  Eigen::Vector3d corner_world_m_;
  int across_ = 0;  // bricks along an axis, a power of two
  // Grid points of the volume along each axis. Points beyond it, and the first, count as outside.
  Cell points_{};
  std::vector<Brick> bricks_;
  Cell index_min_{}, index_size_{};
  std::vector<int> index_;  // the brick's number, or kFree or kSolid
  geometry::Mesh mesh_;
};

}  // namespace fivepipe::baselines
