// The space that the hulls of a session's frames pass through: a closed surface that contains every
// point of every hull.
//
//     hull of frame 1    A cell belongs to the swept volume unless it is certified free of the
//     .--.    frame 2    hull of each frame: cubes without an object pixel in some camera
//    ( o  )  .--.        (collision::CubeQuery), of the size of many cells down to 1/8 of one.
//     '--'  ( o  )       The surface is the boundary of the cells, so it is larger than the sweep
//            '--'        by up to a cell; surface() also estimates the volume of the sweep itself.
#pragma once
#include <cstdint>
#include <vector>

#include "common/geometry/mesh.h"
#include "common/hull/query/hull_query.h"
#include "common/surface/bit_grid.h"

namespace fivepipe::surface {

struct SweptVolumeOptions {
  Eigen::AlignedBox3d within_world_m;  // not empty, finite; must contain the hulls
  double cell_m = 0.005;
};

// Maximum number of cells of the box. Each needs 9 bits.
inline constexpr std::size_t kMaxSweptCells = std::size_t{1} << 28;

struct SweptSurface {
  // World frame [m]. Closed, each edge belongs to two triangles, and the triangles at a vertex form
  // one fan, also if vertices at one position are merged.
  geometry::Mesh mesh;
  double volume_m3 = 0;  // that the mesh encloses
  // Volume of the union of the hulls, by 8 points at random places of each cell, and an upper
  // estimate of its standard error.
  double hull_volume_m3 = 0, hull_volume_error_m3 = 0;
  std::size_t cells = 0;
  // Of them, added because cells touched only at an edge or corner.
  std::size_t added_cells = 0;
};

class SweptVolume {
 public:
  // Throws std::invalid_argument if an option is out of range.
  explicit SweptVolume(const SweptVolumeOptions& options);

  // Adds the hull of a frame. Several threads may call it at once; the result does not depend on
  // the order. A hull with a camera that is not finite is unknown and adds nothing.
  void add(const hull::HullQuery& query);

  SweptSurface surface() const;
  double cell_m() const { return cell_m_; }

 private:
  class Search;
  Eigen::Vector3d origin_m_;
  double cell_m_;
  BitGrid cells_;  // with a margin of one cell, which stays empty
  // By cell without the margin: which of its sample points are in a hull.
  std::vector<std::uint8_t> samples_;
};

}  // namespace fivepipe::surface
