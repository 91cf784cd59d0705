#include "common/collision/response/coverage_border.h"

#include <cmath>
#include <optional>

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;

// Between two samples along V_rec the border may cross one half at most once, because the coverage
// changes over about a pixel.
constexpr int kSamplesPerPixel = 8;
constexpr int kBisections = 40;

// Returns the distance from CP_hull along V_rec at which the coverage hull ends: the last one in
// [-reach_m, reach_m], so that the point beyond it is outside. Returns nullopt if there is none.
std::optional<double> end_of_hull_m(std::span<const hull::CoverageSilhouette> silhouettes,
                                    const hull::HullRule& rule, const Response& response,
                                    double reach_m) {
  const auto inside = [&](double at_m) {
    const Vector3d p = response.cp_hull_world_m + at_m * response.v_rec_world;
    return rule.within_world_m.contains(p) && hull::in_hull(silhouettes, p);
  };
  if (inside(reach_m)) return std::nullopt;
  const int samples = int(std::ceil(2 * kMaxBorderShift_px * kSamplesPerPixel));
  const double step_m = 2 * reach_m / samples;
  for (int i = samples - 1; i >= 0; --i) {
    double in_m = i * step_m - reach_m, out_m = in_m + step_m;
    if (!inside(in_m)) continue;
    for (int k = 0; k < kBisections; ++k) {
      const double center_m = 0.5 * (in_m + out_m);
      (inside(center_m) ? in_m : out_m) = center_m;
    }
    return out_m;
  }
  return std::nullopt;
}

}  // namespace

void refine_by_coverage(Response& response, std::span<const hull::CoverageSilhouette> silhouettes,
                        const hull::HullRule& rule) {
  if (!response.has_exit() || silhouettes.empty()) return;
  const auto end_m =
      end_of_hull_m(silhouettes, rule, response, kMaxBorderShift_px * response.pixel_footprint_m);
  if (!end_m) return;
  const Vector3d cp_hull_world_m = response.cp_hull_world_m + *end_m * response.v_rec_world;
  HullNormal found;
  for (std::size_t i = 0; i < silhouettes.size(); ++i) {
    // The point is just outside.
    if (hull::in_hull(silhouettes.subspan(i, 1), cp_hull_world_m)) continue;
    if (const auto normal = hull::outward_normal_world(silhouettes[i], cp_hull_world_m))
      found.cameras.push_back({int(i), *normal, kCoverageNormalError_rad, 0});
  }
  if (found.cameras.empty()) return;
  response.cp_hull_world_m = cp_hull_world_m;
  if (response.closed_form.status == NormalStatus::not_requested) return;
  found.status = NormalStatus::defined;
  found.normal_world = found.cameras.front().normal_world;
  found.error_rad = kCoverageNormalError_rad;
  response.closed_form = std::move(found);
}

}  // namespace fivepipe::collision
