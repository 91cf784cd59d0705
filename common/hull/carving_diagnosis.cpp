#include "common/hull/carving_diagnosis.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "common/base/math/splitmix64.h"
#include "common/hull/map_from_view.h"

namespace fivepipe::hull {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

CameraVerdict verdict_on(const Silhouette& s, const Vector3d& p_world_m) {
  if (!is_finite(s.camera)) return CameraVerdict::unusable;
  const auto uv_px = geometry::project(s.camera, p_world_m);
  if (!uv_px) return CameraVerdict::behind;
  if (!s.pixels.holds(uv_px->x(), uv_px->y())) return CameraVerdict::outside_image;
  return s.pixels.contains_at(uv_px->x(), uv_px->y()) ? CameraVerdict::object
                                                      : CameraVerdict::empty;
}

bool removes(CameraVerdict v, const HullRule& rule) {
  return v == CameraVerdict::empty || v == CameraVerdict::unusable ||
         (rule.limits == Limits::all && v != CameraVerdict::object);
}

// Counts the cameras that remove a point and those that see it on their objects.
struct Votes {
  int removing = 0, object = 0;
  void add(CameraVerdict v, const HullRule& rule) {
    removing += removes(v, rule);
    object += v == CameraVerdict::object;
  }
  bool keep(const HullRule& rule) const {
    return removing == 0 && object >= (rule.limits == Limits::seen ? rule.min_seen : 1);
  }
  Votes without(CameraVerdict v, const HullRule& rule) const {
    return {removing - removes(v, rule), object - (v == CameraVerdict::object)};
  }
};

double squared_gap(double x, double low, double high) {
  const double gap = std::max({low - x, x - high, 0.0});
  return gap * gap;
}

// Returns the distance from uv to the nearest object pixel's square. Searches each row outward from
// uv's column while its pixels can be nearer than the nearest one found.
double distance_to_object_px(const ObjectPixels& pixels, const Vector2d& uv_px) {
  const PixelRect bounds = pixels.bounds();
  double nearest2 = kInfinity;
  const int start = int(std::clamp(uv_px.x() + 0.5, double(bounds.u0_px), double(bounds.u1_px)));
  for (int v = bounds.v0_px; v < bounds.v1_px; ++v) {
    const double rows2 = squared_gap(uv_px.y(), v - 0.5, v + 0.5);
    const auto nearer = [&](int u) {  // false if no further pixel can be nearer
      const double distance2 = rows2 + squared_gap(uv_px.x(), u - 0.5, u + 0.5);
      if (!(distance2 < nearest2)) return false;
      if (!pixels.contains(u, v)) return true;
      nearest2 = distance2;
      return false;
    };
    for (int u = start; u < bounds.u1_px && nearer(u);) ++u;
    for (int u = start - 1; u >= bounds.u0_px && nearer(u);) --u;
  }
  return std::sqrt(nearest2);
}

// Returns a number for each index, uniformly distributed in [0, 1).
double random_number(std::uint64_t seed, std::uint64_t index) {
  const std::uint64_t key = seed * 0xd1342543de82ef95u + index * 0x9e3779b97f4a7c15u;
  return double(base::splitmix64(key) >> 11) * 0x1p-53;
}

struct Counts {
  struct OfCamera {
    std::int64_t removed = 0, alone = 0, not_seeing = 0, kept_by_others = 0;
  };
  std::int64_t hull = 0, too_few = 0;
  std::vector<OfCamera> cameras;
};

void count_point(std::span<const Silhouette> silhouettes, const Vector3d& p_world_m,
                 const HullRule& rule, std::vector<CameraVerdict>& verdicts, Counts& counts) {
  if (!rule.within_world_m.contains(p_world_m)) return;
  Votes votes;
  for (std::size_t i = 0; i < silhouettes.size(); ++i)
    votes.add(verdicts[i] = verdict_on(silhouettes[i], p_world_m), rule);
  counts.hull += votes.keep(rule);
  counts.too_few += votes.removing == 0 && !votes.keep(rule);
  for (std::size_t i = 0; i < silhouettes.size(); ++i) {
    const bool removed = removes(verdicts[i], rule),
               others_keep = votes.without(verdicts[i], rule).keep(rule);
    Counts::OfCamera& c = counts.cameras[i];
    c.removed += removed;
    c.alone += removed && others_keep;
    c.not_seeing +=
        removed && others_keep &&
        (verdicts[i] == CameraVerdict::behind || verdicts[i] == CameraVerdict::outside_image);
    c.kept_by_others += others_keep;
  }
}

// Returns the volume and its binomial standard error, or the bound of the "rule of three" if
// `count` is none or all of the points.
SampledVolume sampled(std::int64_t count, int points, double box_m3) {
  const double fraction = double(count) / points;
  const double error =
      count == 0 || count == points ? 3.0 / points : std::sqrt(fraction * (1 - fraction) / points);
  return {fraction * box_m3, std::min(error, 1.0) * box_m3};
}

// Points per work item of the pool.
constexpr int kBatchSize = 2048;

Counts count_points(std::span<const Silhouette> silhouettes, const Eigen::AlignedBox3d& box,
                    base::WorkerPool& pool, const HullRule& rule,
                    const DiagnosisSampling& sampling) {
  std::vector<Counts> of_threads(std::size_t(pool.threads()));
  for (Counts& c : of_threads) c.cameras.resize(silhouettes.size());
  pool.run((sampling.points + kBatchSize - 1) / kBatchSize, [&](int piece, int thread) {
    std::vector<CameraVerdict> verdicts(silhouettes.size());
    for (std::uint64_t i = std::uint64_t(piece) * kBatchSize;
         i < std::min(std::uint64_t(piece + 1) * kBatchSize, std::uint64_t(sampling.points)); ++i) {
      const Vector3d at(random_number(sampling.seed, 3 * i),
                        random_number(sampling.seed, 3 * i + 1),
                        random_number(sampling.seed, 3 * i + 2));
      count_point(silhouettes, box.min() + at.cwiseProduct(box.sizes()), rule, verdicts,
                  of_threads[std::size_t(thread)]);
    }
  });
  Counts sum = of_threads.front();
  for (const Counts& c : std::span(of_threads).subspan(1)) {
    sum.hull += c.hull;
    sum.too_few += c.too_few;
    for (std::size_t i = 0; i < silhouettes.size(); ++i) {
      sum.cameras[i].removed += c.cameras[i].removed;
      sum.cameras[i].alone += c.cameras[i].alone;
      sum.cameras[i].not_seeing += c.cameras[i].not_seeing;
      sum.cameras[i].kept_by_others += c.cameras[i].kept_by_others;
    }
  }
  return sum;
}

}  // namespace

PointDiagnosis diagnose_point(std::span<const Silhouette> silhouettes, const Vector3d& p_world_m,
                              const HullRule& rule) {
  PointDiagnosis diagnosis{false, {}, {}, false};
  if (!p_world_m.allFinite()) return diagnosis;
  Votes votes;
  for (const Silhouette& s : silhouettes) {
    const CameraVerdict v = verdict_on(s, p_world_m);
    votes.add(v, rule);
    const bool has_pixel = v != CameraVerdict::behind && v != CameraVerdict::unusable;
    diagnosis.cameras.push_back(
        {v, removes(v, rule),
         has_pixel ? distance_to_object_px(s.pixels, *geometry::project(s.camera, p_world_m))
                   : kInfinity});
  }
  diagnosis.in_hull = votes.keep(rule) && rule.within_world_m.contains(p_world_m);
  diagnosis.too_few = votes.removing == 0 && !votes.keep(rule);
  for (int i = 0; i < int(diagnosis.cameras.size()); ++i)
    if (diagnosis.cameras[std::size_t(i)].removes &&
        votes.without(diagnosis.cameras[std::size_t(i)].verdict, rule).keep(rule))
      diagnosis.alone.push_back(i);
  return diagnosis;
}

VolumeDiagnosis diagnose_volume(std::span<const Silhouette> silhouettes,
                                const Eigen::AlignedBox3d& box_world_m, base::WorkerPool& pool,
                                const HullRule& rule, const DiagnosisSampling& sampling) {
  assert(sampling.points > 0);
  VolumeDiagnosis diagnosis{box_world_m, sampling.points, {}, {}, {}};
  for (const Silhouette& s : silhouettes) {
    CameraContribution& contribution = diagnosis.cameras.emplace_back();
    contribution.no_object_pixel = s.pixels.bounds().empty();
    contribution.unusable = !is_finite(s.camera);
  }
  const double box_m3 = box_world_m.sizes().prod();
  if (!(box_world_m.sizes().minCoeff() > 0 && std::isfinite(box_m3))) return diagnosis;
  const Counts counts = count_points(silhouettes, box_world_m, pool, rule, sampling);
  const auto volume = [&](std::int64_t count) { return sampled(count, sampling.points, box_m3); };
  diagnosis.hull = volume(counts.hull);
  diagnosis.too_few = volume(counts.too_few);
  for (std::size_t i = 0; i < silhouettes.size(); ++i) {
    CameraContribution& contribution = diagnosis.cameras[i];
    const Counts::OfCamera& c = counts.cameras[i];
    contribution.removed = volume(c.removed);
    contribution.removed_alone = volume(c.alone);
    contribution.removed_alone_unseen = volume(c.not_seeing);
    contribution.kept_by_others = volume(c.kept_by_others);
  }
  return diagnosis;
}

}  // namespace fivepipe::hull
