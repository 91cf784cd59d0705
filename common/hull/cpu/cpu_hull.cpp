#include "common/hull/cpu/cpu_hull.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "common/hull/cpu/ray_simd.h"
#include "common/hull/cpu/ray_walk.h"
#include "common/hull/map_from_view.h"

namespace fivepipe::hull {
namespace {

// Side of the pieces of a view that the pool culls in parallel [px]; a multiple of a block.
constexpr int kPiece_px = 4 * kBlock_px;

// Sorts the smallest object first, because it excludes most. The other keys make the order
// independent of the given one.
bool smaller_first(const CpuHull::MapCamera& a, const CpuHull::MapCamera& b,
                   std::span<const Silhouette> silhouettes) {
  const auto key = [](const CpuHull::MapCamera& c) {
    const auto& m = c.camera.camera_from_world.matrix();
    const geometry::Pinhole& k = c.camera.pinhole;
    std::array<double, 21> numbers{double(c.skip_map.bounds().area_px()), k.fx_px, k.fy_px, k.cx_px,
                                   k.cy_px};
    std::copy(m.data(), m.data() + 16, numbers.begin() + 5);
    return numbers;
  };
  const auto key_a = key(a), key_b = key(b);
  if (key_a != key_b) return key_a < key_b;
  return std::ranges::lexicographical_compare(
      silhouettes[std::size_t(a.silhouette)].pixels.words(),
      silhouettes[std::size_t(b.silhouette)].pixels.words());
}

void clip(RayRange& range, double offset, double slope) {
  const bool in_at_begin = offset + range.begin * slope >= 0,
             in_at_end = offset + range.end * slope >= 0;
  if (in_at_begin && in_at_end) return;
  const double t = -offset / slope;
  if (in_at_end)
    range.begin = std::max(range.begin, t);
  else if (in_at_begin)
    range.end = std::min(range.end, t);
  else
    range.end = range.begin;
}

// Returns the quadrants into which the images of the rays through a rect move. The direction, d/dt
// of U / W times W^2, is linear over the rays, so the corner rays decide. If their directions
// differ, or one is uncertain, both directions count.
std::vector<Quadrant> quadrants_ahead(const MapFromView& map, const PixelRect& rect) {
  bool directions[2][2] = {};  // axis; right or down, left or up
  for (int axis = 0; axis < 2; ++axis)
    for (int corner = 0; corner < 4; ++corner) {
      const ImageLine l = image_line(map, corner & 1 ? rect.u1_px - 1 : rect.u0_px,
                                     corner & 2 ? rect.v1_px - 1 : rect.v0_px);
      const double a = (axis ? l.v_slope : l.u_slope) * l.w_offset,
                   b = (axis ? l.v_offset : l.u_offset) * l.w_slope,
                   uncertain = kUncertainDirection * (std::abs(a) + std::abs(b));
      directions[axis][0] |= !(a - b < -uncertain);
      directions[axis][1] |= !(a - b > uncertain);
    }
  // If one axis has both directions, the SIMD code uses both directions of both axes.
  const bool both =
      (directions[0][0] && directions[0][1]) || (directions[1][0] && directions[1][1]);
  std::vector<Quadrant> boxes;
  for (const bool up : {false, true})
    for (const bool left : {false, true})
      if (both || (directions[0][left] && directions[1][up]))
        boxes.push_back(quadrant_ahead(left, up));
  return boxes;
}

}  // namespace

// Input of one call of depth(), which all threads read.
struct CpuHull::ViewJob {
  const View* view;
  HullRule rule;
  std::span<CpuHull::MapCamera> cameras;
  std::vector<MapFromView> maps;
  std::vector<const SkipMap*> skip_maps;
  std::vector<HalfSpace> half_spaces;  // their intersection holds the hull
  std::vector<HalfSpace> of_box;       // their intersection is the rule's box
  // Limits::seen: by camera; their intersection holds every point on the camera's object.
  std::vector<std::vector<HalfSpace>> of_camera;
  PixelRect rect;
  float* depth_m;
  float* at(int u, int v) const {
    return depth_m + std::ptrdiff_t(v - rect.v0_px) * rect.width_px() + (u - rect.u0_px);
  }
};

// A block of rays that may meet the hull, and the depth range in which they may.
struct CpuHull::VisibleBlock {
  PixelRect rays;
  RayRange range;
};

// Culls and traces pieces of a view. Each thread has its own tracer.
class CpuHull::Tracer {
 public:
  void begin(const ViewJob& job) {
    job_ = &job;
    seen_.clear();
  }

  // Divides a piece of the view into blocks. Appends those whose rays may meet the hull to seen()
  // and fills the others with kNoHull.
  void cull(const PixelRect& rays, RayRange range) {
    range = shared_range(rays, range);
    if (range.empty()) return fill_empty(rays);
    if (rays.width_px() <= kBlock_px && rays.height_px() <= kBlock_px)
      return seen_.push_back({rays, range});
    const auto half = [](int size) {
      return std::max(kBlock_px, (size / 2 + kBlock_px - 1) / kBlock_px * kBlock_px);
    };
    const int u = std::min(rays.u1_px, rays.u0_px + half(rays.width_px())),
              v = std::min(rays.v1_px, rays.v0_px + half(rays.height_px()));
    for (const PixelRect& part : {PixelRect{rays.u0_px, rays.v0_px, u, v},
                                  {u, rays.v0_px, rays.u1_px, v},
                                  {rays.u0_px, v, u, rays.v1_px},
                                  {u, v, rays.u1_px, rays.v1_px}})
      if (!part.empty()) cull(part, range);
  }
  std::span<const VisibleBlock> seen() const { return seen_; }

  void trace(const VisibleBlock& block) { trace_block(block.rays, block.range); }

 private:
  void fill_empty(const PixelRect& rays) {
    for (int v = rays.v0_px; v < rays.v1_px; ++v)
      std::fill_n(job_->at(rays.u0_px, v), rays.width_px(), kNoHull);
  }

  // Returns a range that holds the part of every ray that may meet the hull. A slope is linear over
  // the rays, so its extremes are at the corners.
  RayRange shared_range(const PixelRect& rays, RayRange range) const {
    const RayRange tight = clipped(job_->of_box, rays, clipped(job_->half_spaces, rays, range));
    if (tight.empty()) return tight;
    const RayRange widened{std::max(range.begin, tight.begin * (1 - kRangeSlack)),
                           std::min(range.end, tight.end * (1 + kRangeSlack))};
    if (job_->rule.limits == Limits::all) return widened;
    std::vector<RayRange> on_object;
    for (const std::vector<HalfSpace>& half_spaces : job_->of_camera)
      on_object.push_back(clipped(half_spaces, rays, widened));
    return overlap_range(on_object, job_->rule.min_seen, widened);
  }

  static RayRange clipped(const std::vector<HalfSpace>& half_spaces, const PixelRect& rays,
                          RayRange tight) {
    for (const HalfSpace& h : half_spaces) {
      if (tight.empty()) break;
      const double max_slope = std::max(
          {h.slope_at(rays.u0_px, rays.v0_px), h.slope_at(rays.u1_px - 1, rays.v0_px),
           h.slope_at(rays.u0_px, rays.v1_px - 1), h.slope_at(rays.u1_px - 1, rays.v1_px - 1)});
      hull::clip(tight, h.offset, max_slope);
    }
    return tight;
  }

  void trace_block(const PixelRect& rays, const RayRange& range) {
    block_.rays = rays;
    block_.begin = range.begin;
    block_.end = range.end;
    block_.near = job_->view->near_m;
    block_.far = job_->view->far_m;
    block_.begins_at_near = range.begin == block_.near;
    if (job_->rule.limits == Limits::seen || job_->cameras.size() > std::size_t(kMaxSimdCameras)) {
      for (int v = rays.v0_px; v < rays.v1_px; ++v)
        for (int u = rays.u0_px; u < rays.u1_px; ++u) *job_->at(u, v) = depth_of(u, v);
      return;
    }
    const int left = fivepipe::hull::trace_block(block_, job_->maps, job_->skip_maps, scratch_,
                                                 job_->at(rays.u0_px, rays.v0_px),
                                                 job_->rect.width_px(), uncertain_);
    for (int i = 0; i < left; ++i) {
      const int u = rays.u0_px + uncertain_[i] % kBlock_px,
                v = rays.v0_px + uncertain_[i] / kBlock_px;
      *job_->at(u, v) = depth_of(u, v);
    }
    if (!is_in_box(rays, range)) cut_at_box(rays);
  }

  // Returns whether the rays are in the rule's box over the whole range.
  bool is_in_box(const PixelRect& rays, const RayRange& range) const {
    return std::all_of(job_->of_box.begin(), job_->of_box.end(), [&](const HalfSpace& h) {
      const double min_slope = std::min(
          {h.slope_at(rays.u0_px, rays.v0_px), h.slope_at(rays.u1_px - 1, rays.v0_px),
           h.slope_at(rays.u0_px, rays.v1_px - 1), h.slope_at(rays.u1_px - 1, rays.v1_px - 1)});
      return h.offset + range.begin * min_slope >= 0 && h.offset + range.end * min_slope >= 0;
    });
  }

  // Traces the rays again whose first hull point is outside the rule's box.
  void cut_at_box(const PixelRect& rays) {
    for (int v = rays.v0_px; v < rays.v1_px; ++v)
      for (int u = rays.u0_px; u < rays.u1_px; ++u) {
        float& depth_m = *job_->at(u, v);
        if (depth_m == kNoHull) continue;
        const RayRange range = range_in_box(u, v);
        if (!(range.begin <= depth_m && depth_m <= range.end)) depth_m = depth_of(u, v);
      }
  }

  // Returns the part of the view's depths in which the ray is in the rule's box.
  RayRange range_in_box(int u, int v) const {
    RayRange range{job_->view->near_m, job_->view->far_m};
    for (const HalfSpace& h : job_->of_box)
      if (!range.empty()) hull::clip(range, h.offset, h.slope_at(u, v));
    return range;
  }

  float depth_of(int u, int v) {
    RayRange range = range_in_box(u, v);
    if (range.empty()) return kNoHull;
    if (job_->rule.limits == Limits::seen) range = range_on_objects(u, v, range);
    if (range.empty()) return kNoHull;
    walks_.clear();
    for (std::size_t i = 0; i < job_->cameras.size(); ++i) {
      const CpuHull::MapCamera& c = job_->cameras[i];
      walks_.emplace_back(image_line(job_->maps[i], u, v), c.skip_map,
                          walk_window(c.camera, c.skip_map, job_->rule), beyond_window(job_->rule),
                          range);
    }
    const double t = RayWalk(walks_, job_->rule).next_entry(range.begin, range.end);
    return t == kNever ? kNoHull : float(t);
  }

  // Limits::seen: returns the part of the range in which enough cameras may see the ray on their
  // objects. It depends on the ray alone, not on its block.
  RayRange range_on_objects(int u, int v, const RayRange& range) {
    on_object_.clear();
    for (std::size_t i = 0; i < job_->cameras.size(); ++i)
      on_object_.push_back(range_in_window(image_line(job_->maps[i], u, v),
                                           job_->cameras[i].skip_map.bounds(), range));
    return overlap_range(on_object_, job_->rule.min_seen, range);
  }

  const ViewJob* job_ = nullptr;
  std::vector<VisibleBlock> seen_;
  Block block_;
  SimdScratch scratch_;
  std::uint16_t uncertain_[kBlock_px * kBlock_px];
  std::vector<MapWalk> walks_;
  std::vector<RayRange> on_object_;
};

CpuHull::CpuHull(base::WorkerPool& pool) : pool_(&pool) {
  for (int thread = 0; thread < pool.threads(); ++thread)
    tracers_.push_back(std::make_unique<Tracer>());
}
CpuHull::CpuHull(base::WorkerPool& pool, std::span<const Silhouette> silhouettes,
                 const HullRule& rule)
    : CpuHull(pool) {
  assign(silhouettes, rule);
}
CpuHull::~CpuHull() = default;

void CpuHull::assign(std::span<const Silhouette> silhouettes, const HullRule& rule) {
  rule_ = rule;
  used_ = 0;
  empty_ = silhouettes.empty();
  unusable_ = std::any_of(silhouettes.begin(), silhouettes.end(),
                          [](const Silhouette& s) { return !is_finite(s.camera); });
  empty_ |= unusable_;
  if (empty_) return;
  used_ = silhouettes.size();
  if (cameras_.size() < used_) cameras_.resize(used_);
  pool_->run(int(used_), [&](int i, int) {
    cameras_[std::size_t(i)].camera = silhouettes[std::size_t(i)].camera;
    cameras_[std::size_t(i)].skip_map.assign(silhouettes[std::size_t(i)].pixels);
    cameras_[std::size_t(i)].silhouette = i;
  });
  std::sort(
      cameras_.begin(), cameras_.begin() + std::ptrdiff_t(used_),
      [&](const MapCamera& a, const MapCamera& b) { return smaller_first(a, b, silhouettes); });
  if (rule.limits == Limits::all)
    for (const MapCamera& c : cameras()) empty_ |= c.skip_map.bounds().empty();
}

void CpuHull::make_all_quadrants() {
  pool_->run(int(used_) * kQuadrants, [&](int i, int) {
    if (SkipMap& skip_map = cameras_[std::size_t(i / kQuadrants)].skip_map;
        !skip_map.has(Quadrant(i % kQuadrants)))
      skip_map.make(Quadrant(i % kQuadrants));
  });
}

void CpuHull::depth(const View& view, const PixelRect& rect, std::span<float> depth_m) {
  assert(depth_m.size() == rect.area_px());
  if (rect.empty()) return;
  if (empty_ || !is_finite(view.camera) ||
      !(view.near_m > 0 && view.far_m > view.near_m && std::isfinite(view.far_m))) {
    std::fill(depth_m.begin(), depth_m.end(), kNoHull);
    return;
  }
  ViewJob job{&view, rule_, {cameras_.data(), used_}, {}, {}, {}, {}, {}, rect, depth_m.data()};
  if (rule_.is_bounded()) add_half_spaces(view_rays(view.camera), rule_.within_world_m, job.of_box);
  for (const MapCamera& c : job.cameras) {
    job.maps.push_back(map_from_view(c.camera, view.camera));
    job.skip_maps.push_back(&c.skip_map);
    add_half_spaces(job.maps.back(),
                    rule_.limits == Limits::all ? walk_window(c.camera, c.skip_map, rule_)
                                                : c.skip_map.bounds(),
                    rule_.limits == Limits::all ? job.half_spaces : job.of_camera.emplace_back());
  }
  const std::vector<VisibleBlock> blocks = visible_blocks(job);
  make_quadrants(job, blocks);
  pool_->run(int(blocks.size()), [&](int i, int thread) {
    tracers_[std::size_t(thread)]->trace(blocks[std::size_t(i)]);
  });
}

// Returns the blocks of the view that may see the hull and fills the rest with kNoHull.
std::vector<CpuHull::VisibleBlock> CpuHull::visible_blocks(const ViewJob& job) {
  const PixelRect& rect = job.rect;
  const int columns = (rect.width_px() + kPiece_px - 1) / kPiece_px,
            rows = (rect.height_px() + kPiece_px - 1) / kPiece_px;
  for (auto& tracer : tracers_) tracer->begin(job);
  pool_->run(columns * rows, [&](int piece, int thread) {
    const int u = rect.u0_px + kPiece_px * (piece % columns),
              v = rect.v0_px + kPiece_px * (piece / columns);
    tracers_[std::size_t(thread)]->cull(intersection(rect, {u, v, u + kPiece_px, v + kPiece_px}),
                                        {job.view->near_m, job.view->far_m});
  });
  std::vector<VisibleBlock> blocks;
  for (const auto& tracer : tracers_)
    blocks.insert(blocks.end(), tracer->seen().begin(), tracer->seen().end());
  return blocks;
}

// Creates the missing quadrants that the rays of these blocks use.
void CpuHull::make_quadrants(const ViewJob& job, std::span<const VisibleBlock> blocks) {
  if (blocks.empty()) return;
  PixelRect rays = blocks.front().rays;
  for (const auto& block : blocks)
    rays = {std::min(rays.u0_px, block.rays.u0_px), std::min(rays.v0_px, block.rays.v0_px),
            std::max(rays.u1_px, block.rays.u1_px), std::max(rays.v1_px, block.rays.v1_px)};
  rays.u1_px += kTile_px, rays.v1_px += kTile_px;  // tiles can extend beyond their block
  std::vector<std::pair<SkipMap*, Quadrant>> to_make;
  for (std::size_t i = 0; i < job.cameras.size(); ++i)
    for (const Quadrant box : quadrants_ahead(job.maps[i], rays))
      if (!job.cameras[i].skip_map.has(box)) to_make.emplace_back(&job.cameras[i].skip_map, box);
  pool_->run(int(to_make.size()), [&](int i, int) {
    to_make[std::size_t(i)].first->make(to_make[std::size_t(i)].second);
  });
}

DepthTile CpuHull::depth(const View& view, const PixelRect& rect) {
  DepthTile tile{rect, std::vector<float>(rect.area_px())};
  depth(view, rect, tile.depth_m);
  return tile;
}

}  // namespace fivepipe::hull
