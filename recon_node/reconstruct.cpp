#include "recon_node/reconstruct.h"

#include <algorithm>
#include <cassert>
#include <chrono>
#include <numeric>

#include "common/hull/colour/hull_colour.h"

namespace fivepipe::recon {
namespace {

class Stopwatch {
 public:
  double s() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

// Estimated cost of a tile without hits, in hits.
constexpr double kEmptyTileCost_hits = 100;

// At most this many view sizes have a sweep: those of the viewer, of a light and of spectators.
constexpr std::size_t kMaxSweeps = 16;

void add_colour(ReconTile& tile, const hull::View& view, const hull::HullColour& colour) {
  tile.bgr.assign(tile.depth_m.size() * 3, 0);
  const Eigen::Vector3d eye_world_m = geometry::camera_center_world_m(view.camera);
  const int width = tile.covered.width_px();
  for (std::size_t i = 0; i < tile.depth_m.size(); ++i) {
    if (tile.depth_m[i] == hull::kNoHull) continue;
    const geometry::Ray ray = geometry::ray_through(
        view.camera,
        Eigen::Vector2d(tile.covered.u0_px + int(i) % width, tile.covered.v0_px + int(i) / width));
    const auto bgr =
        colour.at(ray.origin_world_m + double(tile.depth_m[i]) * ray.direction_world, eye_world_m);
    std::copy(bgr.begin(), bgr.end(), tile.bgr.begin() + std::ptrdiff_t(i) * 3);
  }
}

}  // namespace

std::vector<double> divided_by_hits(double all_s, const std::vector<hull::DepthTile>& tiles) {
  std::vector<double> cost_by_tile_s;
  for (const hull::DepthTile& tile : tiles)
    cost_by_tile_s.push_back(kEmptyTileCost_hits +
                             double(std::count_if(tile.depth_m.begin(), tile.depth_m.end(),
                                                  [](float d) { return d != hull::kNoHull; })));
  const double all = std::accumulate(cost_by_tile_s.begin(), cost_by_tile_s.end(), 0.0);
  for (double& s : cost_by_tile_s) s *= all_s / all;
  return cost_by_tile_s;
}

ReconTile covered_part(const Tile& tile, const hull::DepthTile& depths) {
  const int width = depths.rect.width_px(), height = depths.rect.height_px();
  hull::PixelRect hits{width, height, 0, 0};  // inside the tile
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u)
      if (depths.depth_m[std::size_t(v) * width + u] != hull::kNoHull)
        hits = {std::min(hits.u0_px, u), std::min(hits.v0_px, v), std::max(hits.u1_px, u + 1),
                std::max(hits.v1_px, v + 1)};
  ReconTile part;
  part.tile = tile;
  if (hits.empty()) return part;
  part.covered = {tile.rect.u0_px + hits.u0_px, tile.rect.v0_px + hits.v0_px,
                  tile.rect.u0_px + hits.u1_px, tile.rect.v0_px + hits.v1_px};
  part.depth_m.reserve(part.covered.area_px());
  for (int v = hits.v0_px; v < hits.v1_px; ++v) {
    const auto row = depths.depth_m.begin() + std::ptrdiff_t(v) * width;
    part.depth_m.insert(part.depth_m.end(), row + hits.u0_px, row + hits.u1_px);
  }
  return part;
}

Reconstructor::Reconstructor(const config::ReconConfig& config,
                             const Eigen::AlignedBox3d& volume_world_m)
    : config_(config),
      volume_world_m_(volume_world_m),
      pool_(config.backend == config::HullBackend::cpu ? config.threads : 1),
      cpu_(pool_),
      coverage_(pool_) {
  assert(config.backend != config::HullBackend::automatic);
  if (config.backend == config::HullBackend::gl) gl_.emplace();
}

void Reconstructor::set_silhouettes(const Maps& maps) {
  const auto silhouettes = maps.silhouettes;
  silhouettes_ = silhouettes;
  uses_coverage_ = config_.coverage && !maps.outlines.empty();
  if (uses_coverage_) {
    assert(config_.backend == config::HullBackend::cpu &&
           maps.outlines.size() == silhouettes.size());
    std::vector<hull::CoverageSilhouette> covered(silhouettes.size());
    pool_.run(int(silhouettes.size()), [&](int i, int) {
      const hull::Silhouette& s = silhouettes[std::size_t(i)];
      covered[std::size_t(i)] = {s.camera,
                                 hull::SparseCoverageMap(s.pixels, maps.outlines[std::size_t(i)])};
    });
    coverage_.assign(std::move(covered), config_.hull_rule);
    return;
  }
  if (config_.backend == config::HullBackend::cpu) cpu_.assign(silhouettes, config_.hull_rule);
  if (gl_) gl_->set_silhouettes(silhouettes, config_.hull_rule);
}

hull::PlaneSweep& Reconstructor::sweep_of(const geometry::Pinhole& pinhole) {
  const std::pair size_px(pinhole.width_px, pinhole.height_px);
  if (sweeps_.size() >= kMaxSweeps && !sweeps_.contains(size_px)) sweeps_.clear();
  hull::PlaneSweep& sweep =
      sweeps_.try_emplace(size_px, size_px.first, size_px.second, config_.sweep_planes)
          .first->second;
  sweep.set_silhouettes(silhouettes_, config_.hull_rule);
  return sweep;
}

std::vector<hull::DepthTile> Reconstructor::depths_by_gl(const hull::View& view,
                                                         std::span<const Tile> tiles) {
  std::vector<hull::PixelRect> rects;
  for (const Tile& tile : tiles) rects.push_back(tile.rect);
  if (gl_) return gl_->depth(view, rects);
  return sweep_of(view.camera.pinhole).depth(view, hull::sweep_range(view, volume_world_m_), rects);
}

Reconstructor::Depths Reconstructor::depths(const hull::View& view, std::span<const Tile> tiles) {
  Depths made;
  if (config_.backend != config::HullBackend::cpu) {
    const Stopwatch watch;
    made.tiles = depths_by_gl(view, tiles);
    made.cost_s = divided_by_hits(watch.s(), made.tiles);
    return made;
  }
  for (const Tile& tile : tiles) {
    const Stopwatch watch;
    made.tiles.push_back(uses_coverage_ ? coverage_.depth(view, tile.rect)
                                        : cpu_.depth(view, tile.rect));
    made.cost_s.push_back(watch.s());
  }
  return made;
}

std::vector<ReconTile> Reconstructor::reconstruct(const Maps& maps, const hull::View& view,
                                                  std::span<const Tile> tiles, bool want_colour) {
  const ViewTiles one{view, {tiles.begin(), tiles.end()}, want_colour};
  return std::move(reconstruct(maps, std::span(&one, 1)).front());
}

std::vector<std::vector<ReconTile>> Reconstructor::reconstruct(const Maps& maps,
                                                               std::span<const ViewTiles> views) {
  set_silhouettes(maps);
  return reconstruct_further(maps, views);
}

std::vector<std::vector<ReconTile>> Reconstructor::reconstruct_further(
    const Maps& maps, std::span<const ViewTiles> views) {
  const hull::HullColour colour(maps.silhouettes, maps.colours, config_.hull_rule);
  std::vector<std::vector<ReconTile>> made;
  for (const ViewTiles& of : views) {
    const Depths depth = depths(of.view, of.tiles);
    std::vector<ReconTile>& parts = made.emplace_back();
    for (std::size_t i = 0; i < of.tiles.size(); ++i) {
      const Stopwatch watch;
      parts.push_back(covered_part(of.tiles[i], depth.tiles[i]));
      if (of.want_colour) add_colour(parts.back(), of.view, colour);
      parts.back().cost_s = depth.cost_s[i] + watch.s();
    }
  }
  return made;
}

}  // namespace fivepipe::recon
