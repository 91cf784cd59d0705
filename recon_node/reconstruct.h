// Computes depth and colour of the visual hull in the tiles of a view that belong to a
// reconstruction node (paper, section 3).
#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "common/config/deployment.h"
#include "common/hull/colour_region.h"
#include "common/hull/coverage/coverage_hull.h"
#include "common/hull/coverage/coverage_outline.h"
#include "common/hull/cpu/cpu_hull.h"
#include "common/hull/gl/gl_hull.h"
#include "common/hull/paper/plane_sweep.h"
#include "recon_node/tiles.h"

namespace fivepipe::recon {

struct ReconTile {
  Tile tile;
  // The smallest rectangle inside the tile that contains every hit; all 0 if there is no hit.
  hull::PixelRect covered;
  // Of `covered`, row-major, along the view's z; kNoHull if the ray misses the hull.
  std::vector<float> depth_m;
  // Of `covered`, 3 bytes per pixel, 0 if the ray misses; empty if no colour was requested.
  std::vector<std::uint8_t> bgr;
  // Time for depth and colour. A backend that computes all tiles together divides its time by hits.
  double cost_s = 0;
};

// Divides the time spent on all tiles together between them by their numbers of hits. A tile
// without a hit counts as 100 hits, and each hit adds one.
std::vector<double> divided_by_hits(double all_s, const std::vector<hull::DepthTile>& tiles);

// Crops the depths of a tile to the rectangle of its hits.
ReconTile covered_part(const Tile& tile, const hull::DepthTile& depths);

class Reconstructor {
 public:
  // The backend must not be `automatic`; recon_node's main.cpp decides. Backend `sweep` distributes
  // its planes over the volume, which is that of the rig. Backends `gl` and `sweep` need a current
  // OpenGL context from construction to destruction.
  Reconstructor(const config::ReconConfig& config, const Eigen::AlignedBox3d& volume_world_m);

  // The real objects of one frame as the cameras see them.
  struct Maps {
    std::span<const hull::Silhouette> silhouettes;
    // With config.coverage: of the silhouettes, or empty. The hull is then that of the coverage.
    std::span<const hull::CoverageOutline> outlines = {};
    std::span<const hull::ColourRegion> colours = {};
  };
  // Returns one result per tile, in the order of `tiles`, also for tiles without a hit. The tiles
  // must be disjoint and inside the view. Takes colour from maps.colours if want_colour is true.
  // Throws GlError, and std::invalid_argument for more silhouettes than the backend supports
  // (kMaxSweepCameras, kMaxGlCameras).
  std::vector<ReconTile> reconstruct(const Maps& maps, const hull::View& view,
                                     std::span<const Tile> tiles, bool want_colour);

  // Tiles of one view; they must be disjoint and inside the view.
  struct ViewTiles {
    hull::View view;
    std::vector<Tile> tiles;
    bool want_colour;
  };
  // The same for several views of one frame. Returns one result per view. Backend `sweep` uploads
  // the silhouettes once per view, the other backends prepare them once.
  std::vector<std::vector<ReconTile>> reconstruct(const Maps& maps,
                                                  std::span<const ViewTiles> views);
  // The same for further views of the same maps, which the last reconstruct() has prepared.
  std::vector<std::vector<ReconTile>> reconstruct_further(const Maps& maps,
                                                          std::span<const ViewTiles> views);

 private:
  struct Depths {
    std::vector<hull::DepthTile> tiles;
    std::vector<double> cost_s;
  };
  void set_silhouettes(const Maps& maps);
  // These use the silhouettes of the last set_silhouettes().
  Depths depths(const hull::View& view, std::span<const Tile> tiles);
  std::vector<hull::DepthTile> depths_by_gl(const hull::View& view, std::span<const Tile> tiles);
  hull::PlaneSweep& sweep_of(const geometry::Pinhole& pinhole);

  config::ReconConfig config_;
  Eigen::AlignedBox3d volume_world_m_;
  base::WorkerPool pool_;
  hull::CpuHull cpu_;
  hull::CoverageHull coverage_;
  bool uses_coverage_ = false;  // of the last set_silhouettes()
  std::optional<hull::GlHull> gl_;
  std::span<const hull::Silhouette> silhouettes_;           // of the last set_silhouettes()
  std::map<std::pair<int, int>, hull::PlaneSweep> sweeps_;  // by width and height of the view
};

}  // namespace fivepipe::recon
