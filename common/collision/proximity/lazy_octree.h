// Space around a hull in cubes, each tested once: is it certified free of the hull, and is its
// centre in it?
//
// A lattice of cubes through the world's origin, each split into octants where a search needs it.
// What is said of a cube depends on the hull and the cube alone: searches share the cubes, and
// whichever comes first makes no difference. (In the images a cube is free where one camera has no
// object pixel in the rectangle that holds its projection; as is_certainly_free of box_query.h, but
// kept, for both rules, and with rounding counted.)
#pragma once
#include <array>
#include <atomic>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <vector>

#include "common/hull/query/hull_query.h"

namespace fivepipe::collision {

// What every camera says of a cube.
struct CubeVerdict {
  bool free = false;  // no point of the closed cube is in the hull: certified
  bool center_in_hull =
      false;  // by the very pixels that contains() would ask; a hint, not its answer
};

class CubeQuery {
 public:
  explicit CubeQuery(const hull::HullQuery& query);  // borrows its hull, which is not empty
  CubeVerdict test(const Eigen::Vector3d& center_world_m, double half_edge_m) const;

 private:
  struct CubeCamera {
    Eigen::Matrix3d r;  // camera_from_world
    Eigen::Vector3d t;
    double fx_px, fy_px, cx_px, cy_px;
    double axis_z;    // how far along z a step of 1 along each world axis leads at most
    double rounding;  // of a point in the camera's frame and of its pixel, as a fraction of the
                      // lengths that take part
    double translation_m;  // sum of its parts' sizes
    hull::PixelRect image;
    const hull::SkipMap* skip_map;
  };
  struct CubeProjection;
  static bool meets_pyramid(const CubeCamera& camera, const Eigen::Vector3d& p_camera_m,
                            double half_edge_m, double rounding_m);
  static CubeProjection project_cube(const CubeCamera& camera,
                                     const Eigen::Vector3d& center_world_m, double half_edge_m);

  std::vector<CubeCamera> cameras_;
  hull::HullRule rule_;
};

class LazyOctree {
 public:
  struct Octants;
  // Where a cube's octants are, once they were tested for; owned by the thread that was first.
  using OctantsPtr = std::atomic<Octants*>;
  struct Octants {
    std::array<OctantsPtr, 8> children{};    // bit 0, 1, 2 of the index: towards +x, +y, +z
    std::uint8_t not_free = 0, in_hull = 0;  // bits by index: what CubeVerdict says
  };
  // A cube that may hold hull points.
  struct Cube {
    OctantsPtr* octants;
    Eigen::Vector3d center_world_m;
  };
  using Neighborhood = std::vector<Cube>;  // up to eight; none: all of it is free

  LazyOctree(const hull::HullQuery& query, double root_edge_m, int threads);

  // Of the lattice cubes of root_edge_m those that may hold hull points within half an edge of p.
  // `thread`: as in WorkerPool.
  const Neighborhood& neighborhood(const Eigen::Vector3d& p_world_m, int thread);
  Octants& octants(const Cube& cube, double half_edge_m, int thread);
  static Eigen::Vector3d center_of_octant(const Eigen::Vector3d& center_world_m, double half_edge_m,
                                          int octant) {
    const double quarter_m = half_edge_m / 2;
    return center_world_m + Eigen::Vector3d(octant & 1 ? quarter_m : -quarter_m,
                                            octant & 2 ? quarter_m : -quarter_m,
                                            octant & 4 ? quarter_m : -quarter_m);
  }

  double root_edge_m() const { return root_edge_m_; }
  // How many cubes were tested; depends on how threads met.
  std::size_t tested() const;

 private:
  using CellIndex = std::array<std::int64_t, 3>;  // in the lattice
  struct CellIndexHash {
    std::size_t operator()(const CellIndex& cell) const;
  };
  struct alignas(64) ThreadState {  // of one thread
    std::vector<std::unique_ptr<Octants[]>> chunks;
    std::size_t left = 0;  // of the last chunk
    std::size_t tested = 0;
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
