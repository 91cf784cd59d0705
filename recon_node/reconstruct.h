// Depth and colour of the visual hull in the tiles of a view that a reconstruction node owns
// (paper, section 3).
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/config/deployment.h"
#include "common/hull/colour_region.h"
#include "common/hull/cpu/cpu_hull.h"
#include "common/hull/gl/gl_hull.h"
#include "common/hull/paper/plane_sweep.h"
#include "recon_node/tiles.h"

namespace fivepipe::recon {

struct ReconTile {
  Tile tile;
  hull::PixelRect covered;  // smallest rectangle inside the tile that holds every hit; empty (all
                            // 0) without any
  std::vector<float>
      depth_m;  // of `covered`, row-major; along the view's z; kNoHull where the ray misses
  std::vector<std::uint8_t> bgr;  // of `covered`, 3 bytes a pixel, 0 where the ray misses; empty
                                  // where colour was not wanted
  double cost_s = 0;  // time that depth and colour took; where a backend takes all tiles together,
                      // by their hits
};

// The depths of a tile cut down to what they cover.
ReconTile covered_part(const Tile& tile, const hull::DepthTile& depths);

class Reconstructor {
 public:
  // Backend `automatic` must have been decided. volume: the rig's, in which a sweep spends its
  // planes. Backends `gl` and `sweep` need a current OpenGL context from here to destruction.
  Reconstructor(const config::ReconConfig& config, const Eigen::AlignedBox3d& volume_world_m);

  // One of each tile given, which are of the view and disjoint, in their order, those without a hit
  // too. Colour from `colours` where wanted. Throws GlError, and std::invalid_argument for more
  // silhouettes than the backend takes (kMaxSweepCameras, kMaxGlCameras).
  std::vector<ReconTile> reconstruct(std::span<const hull::Silhouette> silhouettes,
                                     const hull::View& view, std::span<const Tile> tiles,
                                     std::span<const hull::ColourRegion> colours, bool want_colour);

 private:
  struct Depths {
    std::vector<hull::DepthTile> tiles;
    std::vector<double> cost_s;
  };
  Depths depths(std::span<const hull::Silhouette> silhouettes, const hull::View& view,
                std::span<const Tile> tiles);
  std::vector<hull::DepthTile> depths_by_gl(std::span<const hull::Silhouette> silhouettes,
                                            const hull::View& view, std::span<const Tile> tiles);

  config::ReconConfig config_;
  Eigen::AlignedBox3d volume_world_m_;
  base::WorkerPool pool_;
  hull::CpuHull cpu_;
  std::optional<hull::GlHull> gl_;
  std::optional<hull::PlaneSweep> sweep_;  // for the size of the last view
};

}  // namespace fivepipe::recon
