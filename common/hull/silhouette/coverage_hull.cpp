#include "common/hull/silhouette/coverage_hull.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "common/hull/silhouette/coverage_walk.h"

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
    std::array<double, 20> numbers{k.fx_px, k.fy_px, k.cx_px, k.cy_px};
    std::copy(m.data(), m.data() + 16, numbers.begin() + 4);
    return numbers;
  };
  const auto key_a = key(a), key_b = key(b);
  if (key_a != key_b) return key_a < key_b;
  return std::ranges::lexicographical_compare(a.map.bytes(), b.map.bytes());
}

struct Entry {
  double t;
  int camera;  // the camera whose walk ended there; -1: the ray starts in the hull
};

}  // namespace

// The walk of one ray through the map of one camera, which begins when it is needed: at most points
// the ray is at the border of one silhouette and far inside of the others.
class CoverageHull::LazyWalk {
 public:
  LazyWalk(const MapFromView& map, const MapCamera& camera, double u_px, double v_px)
      : line_(image_line(map, u_px, v_px)), camera_(&camera) {}
  CoverageWalk::VerdictSpan verdict_at(double t, const RayRange& range) {
    // Without an end: the next call asks again.
    if (is_in_whole_cell(line_, camera_->whole_cells, t)) return {true, t};
    if (!walk_) walk_.emplace(line_, camera_->silhouette.map, *camera_->skip_map, range);
    return walk_->verdict_at(t);
  }
  // The camera sees the ray from this parameter on; requires a walk.
  double begin() const { return walk_->begin(); }

 private:
  ImageLine line_;
  const MapCamera* camera_;
  std::optional<CoverageWalk> walk_;
};

bool in_hull(std::span<const CoverageSilhouette> silhouettes, const Vector3d& p_world_m) {
  return !silhouettes.empty() &&
         std::all_of(silhouettes.begin(), silhouettes.end(), [&](const CoverageSilhouette& s) {
           const auto uv_px = geometry::project(s.camera, p_world_m);
           return uv_px && s.map.interpolated(uv_px->x(), uv_px->y()) >= 0.5;
         });
}

std::optional<Vector3d> outward_normal_world(const CoverageSilhouette& silhouette,
                                             const Vector3d& p_world_m) {
  const auto uv_px = geometry::project(silhouette.camera, p_world_m);
  if (!uv_px) return std::nullopt;
  const auto outward = outward_in_image(silhouette.map, *uv_px);
  if (!outward) return std::nullopt;
  const geometry::Pinhole& k = silhouette.camera.pinhole;
  const Vector3d normal_camera(k.fx_px * outward->x(), k.fy_px * outward->y(),
                               outward->dot(Vector2d(k.cx_px, k.cy_px) - *uv_px));
  return (silhouette.camera.camera_from_world.linear().transpose() * normal_camera).normalized();
}

CoverageHull::CoverageHull(base::WorkerPool& pool) : pool_(&pool), superset_(pool) {}
CoverageHull::CoverageHull(base::WorkerPool& pool, std::span<const CoverageSilhouette> silhouettes,
                           const HullRule& rule)
    : CoverageHull(pool) {
  assign(silhouettes, rule);
}

void CoverageHull::assign(std::span<const CoverageSilhouette> silhouettes, const HullRule& rule) {
  assert(rule.limits == Limits::all);
  std::vector<Silhouette> cells(silhouettes.size());
  std::vector<ObjectPixels> whole_cells(silhouettes.size());
  pool_->run(int(silhouettes.size()), [&](int i, int) {
    CellsOfMap of_map = cells_of(silhouettes[i].map);
    cells[i] = {cell_camera(silhouettes[i].camera), std::move(of_map.any)};
    whole_cells[i] = std::move(of_map.all);
  });
  superset_.assign(cells, rule);
  cameras_.clear();
  for (const CpuHull::MapCamera& c : superset_.cameras())
    cameras_.push_back({silhouettes[c.silhouette], c.silhouette,
                        std::move(whole_cells[c.silhouette]), &c.skip_map});
  std::sort(cameras_.begin(), cameras_.end(), [](const MapCamera& a, const MapCamera& b) {
    return smaller_first(a.silhouette, b.silhouette);
  });
}

// The first parameter of the range just after which the ray is inside of all silhouettes, or
// kNever.
template <class Walks>
static Entry next_entry(Walks& walks, const RayRange& range) {
  double t = range.begin;
  int limiting = -1;
  for (std::size_t camera = 0, agreed = 0; agreed < walks.size();
       camera = camera + 1 == walks.size() ? 0 : camera + 1) {
    ++agreed;
    for (CoverageWalk::VerdictSpan verdict_span;
         !(verdict_span = walks[camera].verdict_at(t, range)).inside; agreed = 1) {
      t = verdict_span.end;
      limiting = int(camera);
      if (!(t < range.end)) return {kNever, -1};
    }
  }
  return {t, limiting};
}

// Calls found(index in rect, depth [m], camera) for each ray that meets the hull. `camera` is the
// one whose border the ray crosses there, or null.
template <class Found>
void CoverageHull::trace(const View& view, const PixelRect& rect, std::span<float> depth_m,
                         const Found& found) {
  superset_.depth(view, rect, depth_m);
  std::vector<MapFromView> maps;
  for (const MapCamera& c : cameras_)
    maps.push_back(map_from_view(cell_camera(c.silhouette.camera), view.camera));
  std::vector<std::vector<LazyWalk>> walks_of(std::size_t(pool_->threads()));
  pool_->run(rect.height_px(), [&](int row, int thread) {
    std::vector<LazyWalk>& walks = walks_of[std::size_t(thread)];
    for (int column = 0; column < rect.width_px(); ++column) {
      const std::size_t index =
          std::size_t(row) * std::size_t(rect.width_px()) + std::size_t(column);
      float& depth = depth_m[index];
      if (depth == kNoHull) continue;
      RayRange range{std::max(view.near_m, depth * (1 - kStartSlack)), view.far_m};
      if (const HullRule& rule = superset_.rule(); rule.is_bounded())
        range = range_in_box(
            rule.within_world_m,
            geometry::ray_through(view.camera, Vector2d(rect.u0_px + column, rect.v0_px + row)),
            range);
      if (range.empty()) {
        depth = kNoHull;
        continue;
      }
      walks.clear();
      for (std::size_t i = 0; i < cameras_.size(); ++i)
        walks.emplace_back(maps[i], cameras_[i], rect.u0_px + column, rect.v0_px + row);
      const Entry entry = next_entry(walks, range);
      depth = entry.t == kNever ? kNoHull : float(entry.t);
      if (depth == kNoHull) continue;
      const bool by_border =
          entry.camera >= 0 && entry.t > walks[std::size_t(entry.camera)].begin();
      found(index, entry.t, by_border ? &cameras_[std::size_t(entry.camera)] : nullptr);
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
