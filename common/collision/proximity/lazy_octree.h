// Lazy octree over the space around a hull. One test per cube determines whether the cube is
// certified free of the hull and whether its centre is in the hull.
//
// The roots are a lattice of cubes aligned with the world's origin. A search splits a cube into
// octants on demand. The verdict on a cube depends only on the hull and the cube, so all searches
// share the cubes and the order of the searches does not matter.
//
// A cube is free if some camera has no object pixel in the pixel rectangle that bounds the cube's
// projection. Unlike is_certainly_free (box_query.h), the test supports both hull rules and bounds
// its rounding errors, and the octree keeps its verdict.
#pragma once
#include <array>
#include <atomic>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <vector>

#include "common/collision/detection/triangle.h"
#include "common/hull/query/hull_query.h"

namespace fivepipe::collision {

// Combined verdict of all cameras on a cube.
struct CubeVerdict {
  bool free = false;  // certified: no point of the closed cube is in the hull
  // A hint, from the same pixels as contains(), whose result may differ by rounding.
  bool center_in_hull = false;
};

// The margin of a body that moves from -sweep_world_m to +sweep_world_m about its given place, and
// of which each coordinate of each point has a rounding error of at most rounding_m (>= 0).
struct SweptMargin {
  Eigen::Vector3d sweep_world_m;
  double rounding_m;
};

class CubeQuery {
 public:
  // Borrows the query's hull, which must not be empty and must outlive this object.
  explicit CubeQuery(const hull::HullQuery& query);
  CubeVerdict test(const Eigen::Vector3d& center_world_m, double half_edge_m) const;
  // Return true only if a body contains no point of the hull at any place of its margin: a closed
  // box with edges along the world's axes, or a triangle. Coordinates must be finite. A box or a
  // triangle can be flat, so that one test certifies a face beside a flat border of the hull.
  bool is_free(const Eigen::Vector3d& center_world_m, const Eigen::Vector3d& half_m,
               const SweptMargin& margin) const;
  bool is_free(const Triangle& triangle_world_m, const SweptMargin& margin) const;

 private:
  struct CubeCamera {
    Eigen::Matrix3d r;  // camera_from_world
    Eigen::Vector3d t;
    double fx_px, fy_px, cx_px, cy_px;
    double rounding;       // relative rounding error of camera-frame points and their pixels
    double translation_m;  // 1-norm of t
    hull::PixelRect image;
    const hull::SkipMap* skip_map;
  };
  struct CubeProjection;
  template <class Extent>
  static bool meets_pyramid(const CubeCamera& camera, const Eigen::Vector3d& p_camera_m,
                            const Extent& extent, double rounding_m);
  template <class Extent>
  static CubeProjection project(const CubeCamera& camera, const Eigen::Vector3d& center_world_m,
                                const Extent& extent);
  template <class Extent>
  CubeVerdict verdict(const Eigen::Vector3d& center_world_m, const Extent& extent) const;

  std::vector<CubeCamera> cameras_;
  hull::HullRule rule_;
};

class LazyOctree {
 public:
  struct Octants;
  // Points to a cube's octants; null until they have been tested. The first thread to test them
  // owns them.
  using OctantsPtr = std::atomic<Octants*>;
  struct Octants {
    std::array<OctantsPtr, 8> children{};    // index bits 0, 1, 2: the half towards +x, +y, +z
    std::uint8_t not_free = 0, in_hull = 0;  // CubeVerdict, one bit per octant
  };
  // A cube that may hold hull points.
  struct Cube {
    OctantsPtr* octants;
    Eigen::Vector3d center_world_m;
  };
  using Neighborhood = std::vector<Cube>;  // at most eight; empty: all cubes are free

  // Borrows the query's hull, which must outlive this object. threads: number of threads of the
  // WorkerPool whose tasks call it.
  LazyOctree(const hull::HullQuery& query, double root_edge_m, int threads);

  // Returns the lattice cubes that may hold hull points within half of root_edge_m of p. `thread`
  // is the thread index of WorkerPool. The result stays valid as long as the octree.
  const Neighborhood& neighborhood(const Eigen::Vector3d& p_world_m, int thread);
  // Returns the octants of a cube and tests them on the first call. Thread-safe.
  Octants& octants(const Cube& cube, double half_edge_m, int thread);
  static Eigen::Vector3d center_of_octant(const Eigen::Vector3d& center_world_m, double half_edge_m,
                                          int octant) {
    const double quarter_m = half_edge_m / 2;
    return center_world_m + Eigen::Vector3d(octant & 1 ? quarter_m : -quarter_m,
                                            octant & 2 ? quarter_m : -quarter_m,
                                            octant & 4 ? quarter_m : -quarter_m);
  }

  double root_edge_m() const { return root_edge_m_; }

 private:
  using CellIndex = std::array<std::int64_t, 3>;  // lattice coordinates
  struct CellIndexHash {
    std::size_t operator()(const CellIndex& cell) const;
  };
  struct alignas(64) ThreadState {
    std::vector<std::unique_ptr<Octants[]>> chunks;
    std::size_t left = 0;  // unused octants of the last chunk
    std::unordered_map<CellIndex, Neighborhood, CellIndexHash> neighborhoods;
    const Neighborhood* last = nullptr;
    CellIndex last_cell{};
  };
  static Octants& next_octants(ThreadState& state);

  CubeQuery query_;
  double root_edge_m_;
  std::vector<ThreadState> thread_states_;
  std::mutex roots_mutex_;
  std::unordered_map<CellIndex, std::unique_ptr<OctantsPtr>, CellIndexHash> root_at_;  // null: free
};

}  // namespace fivepipe::collision
