#include "benchmarks/hull/baselines/cpu_plane_sweep.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <stdexcept>

#include "benchmarks/hull/baselines/tile_range.h"

namespace fivepipe::baselines {
namespace {

using Eigen::Vector3d;

// Tiles are squares of 16 or 8 rays. Large tiles need fewer counts, small ones fit the object more
// closely. In a small view, a large tile would span much of the object.
constexpr int kMinTilesAcross = 30;
int tile_px_of(const hull::PixelRect& image) {
  return image.width_px() >= kMinTilesAcross * kSweptTile_px ? kSweptTile_px : kSweptTile_px / 2;
}

SweptCamera lanes_of(const ObjectPixelLookup& lookup, const hull::MapFromView& map) {
  Eigen::Matrix3d shift = Eigen::Matrix3d::Identity();
  shift.col(2) = Vector3d(-lookup.origin_u_px(), -lookup.origin_v_px(), 1);
  const auto floats = [&](const Vector3d& p) {
    const Eigen::Vector3f f = (shift * p).cast<float>();
    return std::array{f.x(), f.y(), f.z()};
  };
  const Eigen::Matrix3d& m = map.at_infinity;
  return {floats(map.at_eye), floats(m.col(0)), floats(m.col(1)), floats(m.col(2)),
          lookup.tables()};
}

}  // namespace

bool CpuPlaneSweep::prepare(std::span<const hull::Silhouette> silhouettes, const hull::View& view,
                            base::WorkerPool& pool) {
  if (silhouettes.size() > kMaxSweptCameras)
    throw std::invalid_argument("plane sweep: at most " + std::to_string(kMaxSweptCameras) +
                                " cameras");
  cameras_.resize(silhouettes.size());
  half_spaces_.clear();
  if (silhouettes.empty() || !hull::is_finite(view.camera) ||
      !(view.near_m > 0 && view.far_m > view.near_m && std::isfinite(view.far_m)))
    return false;
  if (!std::all_of(silhouettes.begin(), silhouettes.end(),
                   [](const hull::Silhouette& s) { return hull::is_finite(s.camera); }))
    return false;
  pool.run(int(silhouettes.size()), [&](int i, int) {
    MapCamera& c = cameras_[std::size_t(i)];
    const hull::Silhouette& s = silhouettes[std::size_t(i)];
    c.bounds = s.pixels.bounds();
    c.map = hull::map_from_view(s.camera, view.camera);
    if (!c.bounds.empty()) c.lookup.build(s.pixels, c.bounds);
  });
  for (const MapCamera& c : cameras_) {
    if (c.bounds.empty()) return false;
    hull::add_half_spaces(c.map, c.bounds, half_spaces_);
  }
  return true;
}

void CpuPlaneSweep::depth(std::span<const hull::Silhouette> silhouettes, const hull::View& view,
                          base::WorkerPool& pool, std::span<float> depth_m) {
  const hull::PixelRect image{0, 0, view.camera.pinhole.width_px, view.camera.pinhole.height_px};
  assert(depth_m.size() == image.area_px());
  if (!prepare(silhouettes, view, pool))
    return std::fill(depth_m.begin(), depth_m.end(), hull::kNoHull);

  // The smallest silhouette comes first, because it removes the most rays and planes.
  std::vector<const MapCamera*> order;
  for (const MapCamera& c : cameras_) order.push_back(&c);
  std::sort(order.begin(), order.end(), [](const MapCamera* a, const MapCamera* b) {
    return a->bounds.area_px() < b->bounds.area_px();
  });
  std::vector<SweptCamera> lanes;
  for (const MapCamera* c : order) lanes.push_back(lanes_of(c->lookup, c->map));

  const int tile_px = tile_px_of(image);
  const double step_m = (view.far_m - view.near_m) / planes_;
  const float before_m = reported_ == SweptDepth::centered ? float(0.5 * step_m) : 0;
  const auto stride = std::size_t(image.width_px());
  pool.run(pieces_of(image), [&](int p, int) {
    const hull::PixelRect piece = piece_of(image, p);
    for (int v = piece.v0_px; v < piece.v1_px; ++v)
      std::fill_n(depth_m.data() + std::size_t(v) * stride + piece.u0_px, piece.width_px(),
                  hull::kNoHull);
    const DepthRange shared = range_of_rays(half_spaces_, piece, {view.near_m, view.far_m});
    if (shared.empty()) return;
    for (int v = piece.v0_px; v < piece.v1_px; v += tile_px)
      for (int u = piece.u0_px; u < piece.u1_px; u += tile_px) {
        const hull::PixelRect rays = hull::intersection(piece, {u, v, u + tile_px, v + tile_px});
        const DepthRange range = range_of_rays(half_spaces_, rays, shared);
        if (range.empty()) continue;
        const int first = std::max(0, int(std::ceil((range.begin_m - view.near_m) / step_m))),
                  end = std::min(planes_, int((range.end_m - view.near_m) / step_m) + 1);
        sweep_tile(lanes, {rays, first, end, float(view.near_m), float(step_m), before_m,
                           depth_m.data() + std::size_t(v) * stride + u, stride, swept_});
      }
  });
}

}  // namespace fivepipe::baselines
