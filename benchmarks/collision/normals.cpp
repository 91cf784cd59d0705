#include "benchmarks/collision/normals.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <random>

#include "benchmarks/collision/analytic_normal.h"
#include "benchmarks/support/gnuplot.h"
#include "common/base/text_table.h"
#include "common/base/timing.h"
#include "common/collision/response/hull_normal.h"
#include "common/hull/coverage/coverage_hull.h"

namespace fivepipe::collision_bench {
namespace {

using Eigen::Vector3d;

constexpr double kBallRadius_m = 0.05, kReach_m = 0.05;
constexpr int kCameras = 6, kQueriesPerRig = 10;

class Random {
 public:
  double between(double low, double high) {
    return low + (high - low) * double(random_()) / double(std::mt19937::max());
  }
  Vector3d in_ball() {
    for (;;)
      if (const Vector3d v{between(-1, 1), between(-1, 1), between(-1, 1)}; v.squaredNorm() < 1)
        return v;
  }
  Vector3d direction() { return in_ball().normalized(); }

 private:
  std::mt19937 random_{71};
};

// A ball at the origin whose silhouettes have the given radius, at random subpixel positions.
struct BallRig {
  std::vector<hull::Capsule> ball{{Vector3d::Zero(), Vector3d::Zero(), kBallRadius_m}};
  std::vector<geometry::Camera> cameras;
  std::vector<hull::Silhouette> binary;
  std::vector<hull::CoverageSilhouette> coverage;
  BallRig(Random& random, double radius_px) {
    const int size_px = int(2.6 * radius_px) + 12;
    for (int i = 0; i < kCameras; ++i) {
      const double distance_m = random.between(1.2, 1.8),
                   f_px = radius_px * distance_m / kBallRadius_m;
      const geometry::Pinhole pinhole{size_px,
                                      size_px,
                                      f_px,
                                      f_px,
                                      0.5 * size_px + random.between(-0.5, 0.5),
                                      0.5 * size_px + random.between(-0.5, 0.5)};
      const Vector3d eye_m = distance_m * random.direction();
      cameras.push_back({pinhole, geometry::look_at(eye_m, Vector3d::Zero(), random.direction())});
      binary.push_back({cameras.back(),
                        hull::true_object_pixels(ball, cameras.back(), hull::PixelRule::center)});
      coverage.push_back({cameras.back(), hull::true_coverage(ball, cameras.back())});
    }
  }
};

// Returns the normal of camera `limiting` at the point where the ray leaves the hull of the
// coverage maps, found by bisection: the hull of a ball is nearly convex, so there is one such
// point. Returns nullopt if the ray does not start inside and end outside.
std::optional<Vector3d> coverage_normal(const BallRig& rig, const geometry::Ray& ray,
                                        std::size_t limiting) {
  const auto inside = [&](double m) {
    return hull::in_hull(rig.coverage, ray.origin_world_m + m * ray.direction_world);
  };
  if (!inside(0) || inside(kReach_m)) return std::nullopt;
  double in_m = 0, out_m = kReach_m;
  while (out_m - in_m > collision::kMinRounding_m) {
    const double center_m = 0.5 * (in_m + out_m);
    if (center_m == in_m || center_m == out_m) break;
    (inside(center_m) ? in_m : out_m) = center_m;
  }
  return hull::outward_normal_world(rig.coverage[limiting],
                                    ray.origin_world_m + in_m * ray.direction_world);
}

NormalError error_of(std::vector<double>& deg) {
  return {base::percentile(deg, 0.5), base::percentile(deg, 0.95), int(deg.size())};
}

NormalsAt measure(double radius_px, int rigs) {
  Random random;
  base::WorkerPool pool(1);
  NormalsAt at{.radius_px = radius_px};
  std::vector<double> binary_deg, coverage_deg, four_deg;
  for (int r = 0; r < rigs; ++r) {
    const BallRig rig(random, radius_px);
    hull::CpuHull hull(pool, rig.binary);
    const hull::HullQuery query(hull);
    for (int i = 0; i < kQueriesPerRig; ++i) {
      const double radius_m = random.between(0.8, 0.9) * kBallRadius_m;
      const Vector3d p = radius_m * random.direction();
      const Vector3d v_rec = (p.normalized() + 0.5 * random.in_ball()).normalized();
      const auto truth = analytic_exit(rig.ball, rig.cameras, {p, v_rec}, 0, kReach_m);
      const auto exit = collision::exit_from_base(query, p, v_rec, kReach_m);
      if (!truth || !exit || !query.contains(p))
        continue;  // the point may be outside the hull of a very small map
      ++at.queries;
      const collision::Recovery recovery{p, v_rec, kReach_m, *exit};
      if (const collision::HullNormal n = collision::closed_form_normal(query, recovery);
          n.status != collision::NormalStatus::no_border) {
        const auto same = std::find_if(
            n.cameras.begin(), n.cameras.end(),
            [&](const hull::LimitingCamera& c) { return c.camera == int(truth->camera); });
        binary_deg.push_back(angle_deg(
            same == n.cameras.end() ? n.normal_world : same->normal_world, truth->normal_world));
      }
      if (const auto n = coverage_normal(rig, {p, v_rec}, truth->camera))
        coverage_deg.push_back(angle_deg(*n, truth->normal_world));
      const collision::HullNormal four =
          collision::four_point_normal(query, recovery, {.search = collision::HullSearch::sampled});
      if (four.normal_world.squaredNorm() > 0)
        four_deg.push_back(angle_deg(four.normal_world, truth->normal_world));
      at.four_points_defined += four.status == collision::NormalStatus::defined;
    }
  }
  at.binary = error_of(binary_deg), at.coverage = error_of(coverage_deg),
  at.four_points = error_of(four_deg);
  return at;
}

}  // namespace

std::vector<NormalsAt> measure_normals(bool quick) {
  std::vector<NormalsAt> sweep;
  for (const double radius_px :
       quick ? std::vector<double>{3, 20, 80}
             : std::vector<double>{2, 3, 4, 6, 8, 12, 16, 20, 28, 40, 56, 80})
    sweep.push_back(measure(radius_px, quick            ? 6
                                       : radius_px < 30 ? 40
                                                        : 15));  // large maps take long to render
  return sweep;
}

void print(const std::vector<NormalsAt>& sweep) {
  std::vector<base::TextTable::Column> columns{{"radius px", true}};
  for (const NormalCurve& curve : kNormalCurves)
    columns.insert(columns.end(), {{curve.title, true}, {"p95", true}, {"given", true}});
  columns.push_back({"trusted", true});
  base::TextTable table(columns);
  for (const NormalsAt& at : sweep) {
    std::vector<std::string> cells{fmt::format("{:g}", at.radius_px)};
    for (const NormalCurve& curve : kNormalCurves) {
      const NormalError& e = at.*curve.error;
      cells.insert(cells.end(),
                   {base::with_decimals(e.median_deg, 2), base::with_decimals(e.p95_deg, 2),
                    fmt::format("{} of {}", e.given, at.queries)});
    }
    cells.push_back(std::to_string(at.four_points_defined));
    table.add(std::move(cells));
  }
  std::cout
      << "\nError of N_hull in degrees (median, p95) against the hull of the true silhouettes, "
      << "for balls seen by " << kCameras << " cameras\n"
      << table.text()
      << "given: queries for which the method returns a normal.\n"
         "trusted: queries whose four points estimate their own error at below 45 degrees.\n";
}

bool plot(const std::vector<NormalsAt>& sweep, const std::filesystem::path& file) {
  bench::Series series;
  for (const NormalsAt& at : sweep)
    for (const NormalCurve& c : kNormalCurves) {
      if ((at.*c.error).given == 0) continue;
      series[std::string(c.title) + ", median"].push_back({at.radius_px, (at.*c.error).median_deg});
      series[std::string(c.title) + ", p95"].push_back({at.radius_px, (at.*c.error).p95_deg});
    }
  std::string settings =
      "set title 'N_{hull} against the hull of true silhouettes'; set xlabel 'radius of the "
      "silhouette, px'; set ylabel 'error, degrees'; "
      "set logscale xy; set xrange [1.8:90]; set yrange [0.05:180]; set key at graph 0.99,0.63 "
      "samplen 3; "
      "set xtics (2,3,4,6,8,12,20,40,80); set ytics (0.1,0.2,0.5,1,2,5,10,20,45,90,180); ";
  // One color per method: the median as a solid line, the p95 dashed.
  const char* colors[] = {"#1f77b4", "#2ca02c", "#d62728"};
  for (int i = 0; i < 6; ++i)
    settings +=
        fmt::format("set linetype {} lc rgb '{}' lw 2 dt {}; ", i + 1, colors[i / 2], i % 2 + 1);
  bench::Plots plots(file);
  plots.add(settings + "\n", series);
  return plots.draw();
}

}  // namespace fivepipe::collision_bench
