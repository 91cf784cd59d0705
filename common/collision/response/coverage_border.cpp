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
                                    const Response& response, double reach_m) {
  const auto inside = [&](double at_m) {
    return hull::in_hull(silhouettes, response.cp_hull_world_m + at_m * response.v_rec_world);
  };
  if (inside(reach_m)) return std::nullopt;
  const int samples = int(std::ceil(2 * kMaxBorderShift_px * kSamplesPerPixel));
  const double step_m = 2 * reach_m / samples;
  for (int i = samples - 1; i >= 0; --i) {
    double in_m = i * step_m - reach_m, out_m = in_m + step_m;
    if (!inside(in_m)) continue;
    for (int k = 0; k < kBisections; ++k) {
      const double middle_m = 0.5 * (in_m + out_m);
      (inside(middle_m) ? in_m : out_m) = middle_m;
    }
    return out_m;
  }
  return std::nullopt;
}

}  // namespace

void refine_by_coverage(Response& response, std::span<const hull::CoverageSilhouette> silhouettes) {
  if (!response.has_exit() || silhouettes.empty()) return;
  const auto end_m =
      end_of_hull_m(silhouettes, response, kMaxBorderShift_px * response.pixel_footprint_m);
  if (!end_m) return;
  response.cp_hull_world_m += *end_m * response.v_rec_world;
  if (response.closed_form.status == NormalStatus::not_requested) return;
  HullNormal found;
  found.status = NormalStatus::no_border;
  for (std::size_t i = 0; i < silhouettes.size(); ++i) {
    // CP_hull is outside: the cameras that see it so limit the hull there.
    if (hull::in_hull(silhouettes.subspan(i, 1), response.cp_hull_world_m)) continue;
    const auto normal = hull::outward_normal_world(silhouettes[i], response.cp_hull_world_m);
    if (normal) found.cameras.push_back({int(i), *normal, kCoverageNormalError_rad, 0});
  }
  if (found.cameras.empty()) return;
  found.status = NormalStatus::defined;
  found.normal_world = found.cameras.front().normal_world;
  found.error_rad = kCoverageNormalError_rad;
  response.closed_form = std::move(found);
}

}  // namespace fivepipe::collision
