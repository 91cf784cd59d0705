#include "benchmarks/collision/proximities.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <random>
#include <sstream>

#include "benchmarks/collision/baselines/distance_grid.h"
#include "benchmarks/collision/methods.h"
#include "common/base/result_file.h"
#include "common/base/timing.h"
#include "common/collision/oracle/distance_reference.h"
#include "common/collision/proximity/proximity.h"

namespace fivepipe::collision_bench {
namespace {

using base::percentile;
using Eigen::Vector3d;

constexpr double kCap_m = 0.05;
// How near the reference's own bounds lie, and what both may be off by rounding.
constexpr double kReference_m = 5e-5, kRounding_m = 1e-9;

std::vector<Vector3d> points_on(const std::vector<collision::Triangle>& triangles,
                                std::size_t count) {
  std::mt19937 random(5);
  const auto fraction = [&] { return double(random()) / double(std::mt19937::max()); };
  std::vector<double> area_until;
  double area = 0;
  for (const collision::Triangle& t : triangles)
    area_until.push_back(area += (t[1] - t[0]).cross(t[2] - t[0]).norm());
  std::vector<Vector3d> points;
  for (std::size_t i = 0; i < count; ++i) {
    const auto at = std::lower_bound(area_until.begin(), area_until.end() - 1, fraction() * area);
    const collision::Triangle& t = triangles[std::size_t(at - area_until.begin())];
    const double root = std::sqrt(fraction()), second = fraction();
    points.push_back((1 - root) * t[0] + root * (1 - second) * t[1] + root * second * t[2]);
  }
  return points;
}

// What is true of the first points of a seeded order.
struct Known {
  std::vector<std::size_t> points;
  std::vector<collision::Clearance> clearances;
};
Known reference_of(const CollisionScene& scene, const std::vector<Vector3d>& points,
                   std::size_t most, base::WorkerPool& pool) {
  std::vector<std::size_t> order(points.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::mt19937 random(6);
  for (std::size_t i = 0; i < std::min(most, order.size()); ++i)
    std::swap(order[i], order[i + random() % (order.size() - i)]);
  order.resize(std::min(most, order.size()));
  Known known{order, std::vector<collision::Clearance>(order.size())};
  const collision::HullDistance distance(scene.silhouettes);
  pool.run(int(order.size()), [&](int i, int) {
    known.clearances[std::size_t(i)] =
        distance.clearance_m(points[order[std::size_t(i)]], kCap_m, kReference_m);
  });
  return known;
}

// Errors where both the reference and the method tell a distance.
void judge(const Known& known, const std::function<collision::Proximity(std::size_t)>& said,
           ProximityResult& result) {
  std::vector<double> errors_mm;
  for (std::size_t i = 0; i < known.points.size(); ++i) {
    const collision::Proximity p = said(known.points[i]);
    const collision::Clearance& c = known.clearances[i];
    ++result.known;
    if (!(p.min_m <= c.max_m + kRounding_m) || !(p.max_m >= c.min_m - kRounding_m))
      ++result.violations;
    if (p.max_m <= kCap_m && c.max_m <= kCap_m)
      errors_mm.push_back(500 * std::abs(p.min_m + p.max_m - c.min_m - c.max_m));
  }
  result.error_median_mm = base::percentile(errors_mm, 0.5),
  result.error_worst_mm = base::percentile(errors_mm, 1);
}

void take_widths(std::span<const collision::Proximity> found, ProximityResult& result) {
  std::vector<double> widths_mm;
  for (const collision::Proximity& p : found)
    if (p.max_m <= kCap_m) widths_mm.push_back(1000 * (p.max_m - p.min_m));
  result.points = found.size(), result.below_cap = widths_mm.size();
  result.width_median_mm = base::percentile(widths_mm, 0.5),
  result.width_widest_mm = base::percentile(widths_mm, 1);
}

struct Asked {
  std::string scene;
  const hull::HullQuery& query;
  const Known& known;
  int threads, runs;
};

std::string setting_of(double tolerance_mm, std::size_t points) {
  std::ostringstream out;
  out << "tol" << tolerance_mm << "mm-" << points;
  return out.str();
}

ProximityResult of_points(const Asked& asked, const std::vector<Vector3d>& points,
                          double tolerance_mm) {
  ProximityResult result{"proximity", asked.scene, setting_of(tolerance_mm, points.size()),
                         asked.threads};
  std::vector<collision::Proximity> found(points.size());
  for (int run = 0; run < asked.runs; ++run)
    result.ms.push_back(timed_ms([&] {
      collision::HullProximity(asked.query, {kCap_m, 1e-3 * tolerance_mm}).of_points(points, found);
    }));
  take_widths(found, result);
  judge(
      asked.known, [&](std::size_t i) { return found[i]; }, result);
  return result;
}

ProximityResult of_mesh(const Asked& asked, const SceneObject& object, double tolerance_mm) {
  ProximityResult result{"proximitymesh", asked.scene,
                         setting_of(tolerance_mm, object.mesh.vertices_m.size()), asked.threads};
  collision::MeshProximity found;
  for (int run = 0; run < asked.runs; ++run)
    result.ms.push_back(timed_ms([&] {
      found = collision::HullProximity(asked.query, {kCap_m, 1e-3 * tolerance_mm})
                  .of_mesh(object.mesh, object.world_from_mesh);
    }));
  take_widths(found.vertices, result);
  judge(
      asked.known, [&](std::size_t i) { return found.vertices[i]; }, result);
  return result;
}

// A voxel's diagonal is the tolerance.
ProximityResult by_grid(const Asked& asked, const std::vector<Vector3d>& points,
                        double tolerance_mm, baselines::DistanceGrid& grid) {
  ProximityResult result{"edt", asked.scene, setting_of(tolerance_mm, points.size()),
                         asked.threads};
  Eigen::AlignedBox3d box;
  for (const Vector3d& p : points) box.extend(p);
  box = {box.min() - Vector3d::Constant(kCap_m), box.max() + Vector3d::Constant(kCap_m)};
  std::vector<float> found_m(points.size());
  for (int run = 0; run < std::min(asked.runs, 2); ++run)
    result.ms.push_back(timed_ms([&] {
      grid.build(asked.query, box);
      for (std::size_t i = 0; i < points.size(); ++i) found_m[i] = grid.distance_m(points[i]);
    }));
  result.points = points.size();
  for (const float m : found_m) result.below_cap += m < kCap_m;
  // Bounds that it claims: none. What it says, give or take the tolerance, stands for them.
  judge(
      asked.known,
      [&](std::size_t i) {
        return collision::Proximity{found_m[i] - 1e-3 * tolerance_mm,
                                    found_m[i] + 1e-3 * tolerance_mm};
      },
      result);
  return result;
}

}  // namespace

std::string ProximityResult::name() const {
  return method + "/" + scene + "/" + setting + "/" + std::to_string(threads);
}
double ProximityResult::ms_per_1000() const {
  return points ? 1000 * base::percentile(ms, 0) / double(points) : 0;
}

std::vector<ProximityResult> measure_proximity(int max_threads, bool quick) {
  std::vector<ProximityResult> results;
  const std::size_t known_points = quick ? 20 : 200;
  const int runs = quick ? 1 : 5;
  const CollisionScene curtain = curtain720(), assembly = payload();
  for (const int threads : max_threads > 1 ? std::vector{1, max_threads} : std::vector{1}) {
    base::WorkerPool pool(threads);
    hull::CpuHull hull(pool, curtain.silhouettes);
    const hull::HullQuery query(hull);
    baselines::DistanceGrid coarse(5e-3 / std::sqrt(3.0)), fine(2e-3 / std::sqrt(3.0));
    for (const std::size_t count : {1000, 10000}) {
      const auto points = points_on(curtain.objects_world_m[0], count);
      const Known known = reference_of(curtain, points, known_points, pool);
      const Asked asked{curtain.name, query, known, threads, runs};
      for (const double tolerance_mm : {5.0, 2.0, 0.5})
        results.push_back(of_points(asked, points, tolerance_mm));
      results.push_back(by_grid(asked, points, 5, coarse));
      if (!quick && count == 10000)
        results.push_back(by_grid(asked, points, 2, fine));  // two seconds for any number of points
    }
    hull::CpuHull reached(pool, assembly.silhouettes);
    const hull::HullQuery into(reached);
    std::vector<Vector3d> vertices;
    for (const Vector3d& v : assembly.objects[0].mesh.vertices_m)
      vertices.push_back(assembly.objects[0].world_from_mesh * v);
    const Known known = reference_of(assembly, vertices, known_points, pool);
    results.push_back(of_mesh({assembly.name, into, known, threads, runs}, assembly.objects[0], 2));
  }
  return results;
}

void print(const std::vector<ProximityResult>& results) {
  std::printf("\n%-38s %9s %9s %9s | %8s %8s | %9s %9s | %6s %8s %9s %9s\n",
              "proximity: method/scene/setting/threads", "ms best", "median", "per 1,000", "points",
              "in cap", "width med", "widest", "known", "broken", "error med", "worst");
  for (const ProximityResult& r : results) {
    char widths[2][32] = {"-", "-"};
    if (r.width_median_mm) std::snprintf(widths[0], 32, "%.3f", *r.width_median_mm);
    if (r.width_widest_mm) std::snprintf(widths[1], 32, "%.3f", *r.width_widest_mm);
    std::printf("%-38s %9.2f %9.2f %9.3f | %8zu %8zu | %9s %9s | %6zu %8zu %9.3f %9.3f\n",
                r.name().c_str(), base::percentile(r.ms, 0), base::percentile(r.ms, 0.5),
                r.ms_per_1000(), r.points, r.below_cap, widths[0], widths[1], r.known, r.violations,
                r.error_median_mm, r.error_worst_mm);
  }
  std::puts(
      "in cap: nearer than 5 cm; width: between the bounds of those [mm]; known: a seeded subset, "
      "against the exact reference; broken: its distance lies outside of the bounds (edt:\n"
      "of what it says, give or take the tolerance); error: of the bounds' middle [mm]. "
      "proximitymesh: its triangles in the same time. edt: voxels whose diagonal is the "
      "tolerance.");
}

std::string json_of(const ProximityResult& r) {
  std::ostringstream out;
  const auto width = [&](const char* name, const std::optional<double>& mm) {
    out << ", \"" << name << "\": ";
    if (mm)
      out << *mm;
    else
      out << "null";
  };
  out << "  {\"name\": " << base::quoted(r.name()) << ", \"time_ms\": " << base::times_json(r.ms)
      << ", \"ms_per_1000\": " << r.ms_per_1000()
      << ",\n   \"error\": {\"distance_median_mm\": " << r.error_median_mm
      << ", \"distance_worst_mm\": " << r.error_worst_mm;
  width("bounds_width_median_mm", r.width_median_mm);
  width("bounds_width_widest_mm", r.width_widest_mm);
  out << "}, \"counts\": {\"points\": " << r.points << ", \"below_cap\": " << r.below_cap
      << ", \"known\": " << r.known << ", \"violations\": " << r.violations << "}}";
  return out.str();
}

}  // namespace fivepipe::collision_bench
