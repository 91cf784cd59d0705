#include "common/hull/coverage/coverage_hull.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <compare>
#include <utility>

namespace fivepipe::hull {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// A walk starts this fraction before the superset's first point: twice the error bound of its depth
// (cpu_hull.h).
constexpr double kStartSlack = 4e-6;

// Sorts the silhouettes so that the result does not depend on the given order.
bool smaller_first(const CoverageSilhouette& a, const CoverageSilhouette& b) {
  const auto key = [](const CoverageSilhouette& s) {
    const auto& m = s.camera.camera_from_world.matrix();
    const geometry::Pinhole& k = s.camera.pinhole;
    std::array<double, 22> numbers{
        k.fx_px, k.fy_px, k.cx_px, k.cy_px, double(k.width_px), double(k.height_px)};
    std::copy(m.data(), m.data() + 16, numbers.begin() + 6);
    return numbers;
  };
  const auto key_a = key(a), key_b = key(b);
  if (key_a != key_b) return key_a < key_b;
  const auto order = [](const auto& x, const auto& y) {
    return std::lexicographical_compare_three_way(x.begin(), x.end(), y.begin(), y.end());
  };
  auto first = order(a.map.object().words(), b.map.object().words());
  if (std::is_eq(first))
    first = order(a.map.outline().pixels.words(), b.map.outline().pixels.words());
  if (std::is_eq(first)) first = order(a.map.outline().coverage, b.map.outline().coverage);
  return std::is_lt(first);
}

}  // namespace

bool in_hull(std::span<const CoverageSilhouette> silhouettes, const Vector3d& p_world_m) {
  return !silhouettes.empty() &&
         std::all_of(silhouettes.begin(), silhouettes.end(), [&](const CoverageSilhouette& s) {
           const auto uv_px = geometry::project(s.camera, p_world_m);
           return uv_px && s.map.interpolated(uv_px->x(), uv_px->y()) >= 0.5;
         });
}

CoverageHull::CoverageHull(base::WorkerPool& pool) : pool_(&pool), superset_(pool) {}
CoverageHull::CoverageHull(base::WorkerPool& pool, std::vector<CoverageSilhouette> silhouettes,
                           const HullRule& rule)
    : CoverageHull(pool) {
  assign(std::move(silhouettes), rule);
}

void CoverageHull::assign(std::vector<CoverageSilhouette> silhouettes, const HullRule& rule) {
  assert(rule.limits == Limits::all);
  std::vector<Silhouette> cells(silhouettes.size());
  std::vector<WalkedMap> walked(silhouettes.size());
  pool_->run(int(silhouettes.size()), [&](int i, int) {
    const SparseCoverageMap& map = silhouettes[i].map;
    const ObjectPixels half = map.half_covered();
    CellsOfMap of_map = cells_of(half);
    cells[i] = {cell_camera(silhouettes[i].camera), std::move(of_map.any)};
    walked[i] = {map, half, std::move(of_map.all)};
  });
  superset_.assign(cells, rule);
  cameras_.clear();
  for (const CpuHull::MapCamera& c : superset_.cameras())
    cameras_.push_back({std::move(silhouettes[c.silhouette]), c.silhouette,
                        std::move(walked[c.silhouette]), &c.skip_map});
  std::sort(cameras_.begin(), cameras_.end(), [](const MapCamera& a, const MapCamera& b) {
    return smaller_first(a.silhouette, b.silhouette);
  });
}

// The rays of one row that meet the superset, and the walks of those that the kernel does not
// resolve.
struct CoverageHull::Row {
  std::size_t rays = 0;
  std::vector<std::size_t> column;  // these have the row's width
  std::vector<double> u_px, begin, end;
  std::vector<CoverageEntry> entries;
  std::vector<CoverageWalk> walks;

  explicit Row(std::size_t width)
      : column(width), u_px(width), begin(width), end(width), entries(width) {}
  void add(std::size_t at, double at_u_px, const RayRange& range) {
    column[rays] = at;
    u_px[rays] = at_u_px;
    begin[rays] = range.begin;
    end[rays] = range.end;
    ++rays;
  }
  void resolve(std::size_t ray) {
    CoverageEntry& entry = entries[ray];
    const RayRange range{entry.t, end[ray]};
    for (CoverageWalk& walk : walks) walk.set_ray(u_px[ray], range);
    const int camera = entry.camera;
    entry = next_entry(walks, range);
    if (entry.t == range.begin) entry.camera = camera;
  }
};

// Collects the rays of the row that meet the superset and the box, and clears their depths.
void CoverageHull::collect(Row& row, const View& view, int u0_px, double v_px,
                           std::span<float> depth_m) const {
  const HullRule& rule = superset_.rule();
  row.rays = 0;
  for (std::size_t column = 0; column < depth_m.size(); ++column) {
    if (depth_m[column] == kNoHull) continue;
    RayRange range{
        std::max(view.near_m, std::exchange(depth_m[column], kNoHull) * (1 - kStartSlack)),
        view.far_m};
    const double u_px = u0_px + double(column);
    if (rule.is_bounded())
      range = range_in_box(rule.within_world_m,
                           geometry::ray_through(view.camera, Vector2d(u_px, v_px)), range);
    if (!range.empty()) row.add(column, u_px, range);
  }
}

// Calls found(index in rect, depth [m], camera) for each ray that meets the hull. `camera` is the
// one whose border the ray crosses there, or null.
template <class Found>
void CoverageHull::trace(const View& view, const PixelRect& rect, std::span<float> depth_m,
                         const Found& found) {
  superset_.depth(view, rect, depth_m);
  std::vector<CoverageSimdCamera> simd_cameras;
  const auto width = std::size_t(rect.width_px());
  Row first_row(width);
  for (const MapCamera& c : cameras_) {
    const MapFromView map = map_from_view(cell_camera(c.silhouette.camera), view.camera);
    simd_cameras.emplace_back(map, c.walked);
    first_row.walks.emplace_back(map, c.walked, *c.skip_map);
  }
  std::vector<Row> rows(std::size_t(pool_->threads()), first_row);
  pool_->run(rect.height_px(), [&](int v, int thread) {
    Row& row = rows[std::size_t(thread)];
    const double v_px = rect.v0_px + v;
    const std::size_t first = std::size_t(v) * width;
    collect(row, view, rect.u0_px, v_px, depth_m.subspan(first, width));
    for (CoverageWalk& walk : row.walks) walk.set_row(v_px);
    const auto rays = [&](auto& all) { return std::span(all).first(row.rays); };
    simd_entries(simd_cameras, {v_px, rays(row.u_px), rays(row.begin), rays(row.end)},
                 rays(row.entries));
    for (std::size_t i = 0; i < row.rays; ++i) {
      const CoverageEntry& entry = row.entries[i];
      if (!entry.resolved) row.resolve(i);
      if (entry.t == kNever) continue;
      const std::size_t index = first + row.column[i];
      depth_m[index] = float(entry.t);
      found(index, entry.t, entry.camera < 0 ? nullptr : &cameras_[std::size_t(entry.camera)]);
    }
  });
}

void CoverageHull::depth(const View& view, const PixelRect& rect, std::span<float> depth_m) {
  assert(depth_m.size() == rect.area_px());
  trace(view, rect, depth_m, [](std::size_t, double, const MapCamera*) {});
}

DepthTile CoverageHull::depth(const View& view, const PixelRect& rect) {
  DepthTile tile{rect, std::vector<float>(rect.area_px())};
  depth(view, rect, tile.depth_m);
  return tile;
}

SurfaceTile CoverageHull::surface(const View& view, const PixelRect& rect) {
  const std::size_t area = rect.area_px();
  SurfaceTile tile{rect, std::vector<float>(area),
                   std::vector<Eigen::Vector3f>(area, Eigen::Vector3f::Zero()),
                   std::vector<std::int16_t>(area, -1)};
  trace(view, rect, tile.depth_m,
        [&](std::size_t index, double depth_m, const MapCamera* limiting) {
          if (!limiting) return;
          const int width = rect.width_px();
          const geometry::Ray ray = geometry::ray_through(
              view.camera, Vector2d(rect.u0_px + int(index % std::size_t(width)),
                                    rect.v0_px + int(index / std::size_t(width))));
          const auto normal = outward_normal_world(
              limiting->silhouette, ray.origin_world_m + depth_m * ray.direction_world);
          if (!normal) return;
          tile.normal_world[index] = normal->cast<float>();
          tile.limiting[index] = std::int16_t(limiting->given);
        });
  return tile;
}

}  // namespace fivepipe::hull
