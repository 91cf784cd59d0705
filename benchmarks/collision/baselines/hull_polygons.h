// Rival: the hull's surface as triangles, for whoever has a collision library that wants some.
// Sources: Gibson, "Constrained Elastic Surface Nets", MICCAI 1998, in its naive form (a vertex in
// each cell that the surface passes, in the middle of its crossed edges; a quadrangle for each
// crossed edge of the grid); fewer and better shaped triangles than marching cubes'.
//
// Done to be fair. Bricks of 8x8x8 cells are found from coarse to fine by our own certified balls,
// so that only bricks at the hull's surface are sampled; membership there in vector lanes; bricks
// in threads; a cell's vertex from a table of the 256 ways to cross it.
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

  // The surface between grid points in the hull and others, in the world: closed, outside of
  // counter-clockwise triangles. It lies within a cell's diagonal of the hull's border; what is
  // thinner than a cell may be lost. What lies outside the volume is cut off. Keeps its buffers;
  // does not depend on the pool's threads. Throws std::invalid_argument where the volume would take
  // more than kMaxBricks along an axis.
  const geometry::Mesh& polygonise(const hull::HullQuery& query,
                                   const Eigen::AlignedBox3d& volume_world_m);

  std::size_t points_tested() const { return 512 * bricks_.size(); }  // by the last call

  static constexpr int kMaxBricks = 1024;

 private:
  using Cell = std::array<int, 3>;  // of the grid; or brick, or grid point with the same index
  struct Node {
    Cell brick;  // the least of size^3 bricks
    int size;
  };
  struct Brick {
    Cell brick;
    std::array<std::uint8_t, 512> inside;           // of its grid points
    std::array<std::uint16_t, 512> vertex_of_cell;  // counted from first_vertex; kNoVertex
    std::uint32_t vertices, quads, first_vertex, first_quad;
  };
  static constexpr std::uint16_t kNoVertex = 0xffff;
  static constexpr int kFree = -1, kSolid = -2;  // in the index

  void find_bricks(const hull::HullQuery& query);
  void make_index(const std::vector<Node>& solid);
  void ask(const hull::HullQuery& query, std::span<const hull::PointSimdCamera> cameras,
           Brick& brick) const;
  std::array<std::uint8_t, 729> surroundings(const Brick& brick) const;
  void count(Brick& brick) const;
  void write(const Brick& brick);
  int& index_at(const Cell& brick);
  int index_at(const Cell& brick) const;
  std::uint32_t vertex_at(const Cell& cell) const;
  Eigen::Vector3d point_m(const Cell& at) const {
    return corner_world_m_ + cell_m_ * Eigen::Vector3d(at[0], at[1], at[2]);
  }

  double cell_m_;
  Eigen::Vector3d corner_world_m_;
  int across_ = 0;  // bricks along an axis, a power of two
  Cell points_{};   // grid points of the volume along each axis; those beyond, and the first, are
                    // outside by definition
  std::vector<Brick> bricks_;
  Cell index_min_{}, index_size_{};
  std::vector<int> index_;  // of bricks, or kFree, kSolid
  geometry::Mesh mesh_;
};

}  // namespace fivepipe::baselines
