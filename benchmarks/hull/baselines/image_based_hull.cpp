#include "benchmarks/hull/baselines/image_based_hull.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "benchmarks/hull/baselines/tile_range.h"

namespace fivepipe::baselines {
namespace {

using Eigen::Vector3d;

static_assert(kTile_px * kTilesAcross == kPiece_px);

EpipolarCamera lanes_of(const EpipolarBins& bins, const hull::MapFromView& map) {
  Eigen::Matrix3d shift = Eigen::Matrix3d::Identity();
  shift.col(2) = Vector3d(-bins.origin_u_px(), -bins.origin_v_px(), 1);
  const auto floats = [&](const Vector3d& p) {
    const Eigen::Vector3f f = (shift * p).cast<float>();
    return std::array{f.x(), f.y(), f.z()};
  };
  const Eigen::Matrix3d& m = map.at_infinity;
  return {floats(map.at_eye),
          floats(m.col(0)),
          floats(m.col(1)),
          floats(m.col(2)),
          bins.sectors(),
          bins.whole_first().data(),
          bins.part_first().data(),
          reinterpret_cast<const std::int32_t*>(bins.whole().data()),
          bins.part().data(),
          bins.part_steps().data(),
          bins.nearest().data(),
          bins.farthest().data(),
          bins.groups(),
          bins.empty_bin(),
          bins.ends_inside()};
}

// Removes the rays outside the silhouette of a camera at the view's center. A ray is inside it at
// every depth or at none.
void keep_where_seen(const hull::ObjectPixels& pixels, const hull::MapFromView& map,
                     const hull::PixelRect& view, std::span<float> depth_m) {
  std::size_t i = 0;
  for (int v = view.v0_px; v < view.v1_px; ++v)
    for (int u = view.u0_px; u < view.u1_px; ++u, ++i) {
      const Vector3d p = map.at_infinity * Vector3d(u, v, 1);
      if (!(p.z() > 0 && pixels.contains_at(p.x() / p.z() - 0.5, p.y() / p.z() - 0.5)))
        depth_m[i] = hull::kNoHull;
    }
}

}  // namespace

bool ImageBasedHull::prepare(std::span<const hull::Silhouette> silhouettes, const hull::View& view,
                             base::WorkerPool& pool) {
  cameras_.resize(silhouettes.size());
  half_spaces_.clear();
  if (silhouettes.empty() || !hull::is_finite(view.camera) ||
      !(view.near_m > 0 && view.far_m > view.near_m))
    return false;
  if (!std::all_of(silhouettes.begin(), silhouettes.end(),
                   [](const hull::Silhouette& s) { return hull::is_finite(s.camera); }))
    return false;
  pool.run(int(silhouettes.size()), [&](int i, int) {
    MapCamera& c = cameras_[std::size_t(i)];
    const hull::Silhouette& s = silhouettes[std::size_t(i)];
    c.bounds = s.pixels.bounds();
    c.map = hull::map_from_view(s.camera, view.camera);
    c.at_eye =
        !((geometry::camera_center_world_m(s.camera) - geometry::camera_center_world_m(view.camera))
              .norm() > hull::kNearestToCamera_m);
    if (!c.bounds.empty() && !c.at_eye) c.bins.build(s, c.bounds, c.map);
  });
  for (const MapCamera& c : cameras_) {
    if (c.bounds.empty()) return false;
    hull::add_half_spaces(c.map, c.bounds, half_spaces_);
  }
  return true;
}

void ImageBasedHull::depth(std::span<const hull::Silhouette> silhouettes, const hull::View& view,
                           base::WorkerPool& pool, std::span<float> depth_m) {
  const hull::PixelRect image{0, 0, view.camera.pinhole.width_px, view.camera.pinhole.height_px};
  assert(depth_m.size() == image.area_px());
  if (!prepare(silhouettes, view, pool))
    return std::fill(depth_m.begin(), depth_m.end(), hull::kNoHull);

  // The smallest silhouette comes first, because it advances or ends the most rays.
  std::vector<const MapCamera*> order;
  for (const MapCamera& c : cameras_)
    if (!c.at_eye) order.push_back(&c);
  std::sort(order.begin(), order.end(), [](const MapCamera* a, const MapCamera* b) {
    return a->bounds.area_px() < b->bounds.area_px();
  });
  std::vector<EpipolarCamera> lanes;
  for (const MapCamera* c : order) lanes.push_back(lanes_of(c->bins, c->map));

  const auto stride = std::size_t(image.width_px());
  pool.run(pieces_of(image), [&](int p, int) {
    const hull::PixelRect piece = piece_of(image, p);
    for (int v = piece.v0_px; v < piece.v1_px; ++v)
      std::fill_n(depth_m.data() + std::size_t(v) * stride + piece.u0_px, piece.width_px(),
                  hull::kNoHull);
    const DepthRange shared = range_of_rays(half_spaces_, piece, {view.near_m, view.far_m});
    if (shared.empty()) return;
    TileRanges ranges;
    narrow_tiles(lanes, piece, float(shared.begin_m), float(shared.end_m), ranges);
    for (int i = 0; i < kTilesAcross * kTilesAcross; ++i) {
      const int u = piece.u0_px + i % kTilesAcross * kTile_px,
                v = piece.v0_px + i / kTilesAcross * kTile_px;
      if (ranges.begin_m[i] < ranges.end_m[i])
        trace_tile(lanes, {hull::intersection(piece, {u, v, u + kTile_px, v + kTile_px}),
                           ranges.begin_m[i], ranges.end_m[i],
                           depth_m.data() + std::size_t(v) * stride + u, stride});
    }
  });
  for (std::size_t i = 0; i < cameras_.size(); ++i)
    if (cameras_[i].at_eye) keep_where_seen(silhouettes[i].pixels, cameras_[i].map, image, depth_m);
}

}  // namespace fivepipe::baselines
