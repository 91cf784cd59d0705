#include "benchmarks/collision/proximities.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iostream>
#include <random>

#include "benchmarks/collision/baselines/distance_grid.h"
#include "benchmarks/collision/methods.h"
#include "common/base/text_table.h"
#include "common/base/timing.h"
#include "common/collision/oracle/distance_reference.h"
#include "common/collision/proximity/proximity.h"

namespace fivepipe::collision_bench {
namespace {

using base::percentile;
using Eigen::Vector3d;

constexpr double kCap_m = 0.05;
// The width of the reference's own bounds, and the rounding error allowed in both.
constexpr double kReference_m = 5e-5, kRounding_m = 1e-9;

std::vector<Vector3d> points_on(const std::vector<collision::Triangle>& triangles,
                                std::size_t count) {
  std::mt19937 random(5);
  const auto fraction = [&] { return double(random()) / double(std::mt19937::max()); };
  std::vector<double> area_sum;
  double area = 0;
  for (const collision::Triangle& t : triangles)
    area_sum.push_back(area += (t[1] - t[0]).cross(t[2] - t[0]).norm());
  std::vector<Vector3d> points;
  for (std::size_t i = 0; i < count; ++i) {
    const auto at = std::lower_bound(area_sum.begin(), area_sum.end() - 1, fraction() * area);
    const collision::Triangle& t = triangles[std::size_t(at - area_sum.begin())];
    const double root = std::sqrt(fraction()), second = fraction();
    points.push_back((1 - root) * t[0] + root * (1 - second) * t[1] + root * second * t[2]);
  }
  return points;
}

// The true distances of the first points of a seeded order.
struct Known {
  std::vector<std::size_t> points;
  std::vector<collision::Clearance> clearances;
};
Known reference_of(const CollisionScene& scene, const std::vector<Vector3d>& points,
                   std::size_t max_points, base::WorkerPool& pool) {
  std::vector<std::size_t> order(points.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::mt19937 random(6);
  for (std::size_t i = 0; i < std::min(max_points, order.size()); ++i)
    std::swap(order[i], order[i + random() % (order.size() - i)]);
  order.resize(std::min(max_points, order.size()));
  Known known{order, std::vector<collision::Clearance>(order.size())};
  const collision::HullDistance distance(scene.silhouettes);
  pool.run(int(order.size()), [&](int i, int) {
    known.clearances[std::size_t(i)] =
        distance.clearance_m(points[order[std::size_t(i)]], kCap_m, kReference_m);
  });
  return known;
}

// Adds violations for all known points, and errors for those that both the reference and the method
// place below the cap.
void judge(const Known& known, const std::function<collision::Proximity(std::size_t)>& found,
           ProximityResult& result) {
  std::vector<double> errors_mm;
  for (std::size_t i = 0; i < known.points.size(); ++i) {
    const collision::Proximity p = found(known.points[i]);
    const collision::Clearance& c = known.clearances[i];
    ++result.known;
    if (!(p.min_m <= c.max_m + kRounding_m) || !(p.max_m >= c.min_m - kRounding_m))
      ++result.violations;
    if (p.max_m <= kCap_m && c.max_m <= kCap_m)
      errors_mm.push_back(500 * std::abs(p.min_m + p.max_m - c.min_m - c.max_m));
  }
  result.error_median_mm = base::percentile(errors_mm, 0.5);
  result.error_worst_mm = base::percentile(errors_mm, 1);
}

void set_widths(std::span<const collision::Proximity> found, ProximityResult& result) {
  std::vector<double> widths_mm;
  for (const collision::Proximity& p : found)
    if (p.max_m <= kCap_m) widths_mm.push_back(1000 * (p.max_m - p.min_m));
  result.points = found.size();
  result.below_cap = widths_mm.size();
  result.width_median_mm = base::percentile(widths_mm, 0.5);
  result.width_widest_mm = base::percentile(widths_mm, 1);
}

// A scene with its hull, and the repetitions of each measurement.
struct Setup {
  std::string scene;
  const hull::HullQuery& query;
  const Known& known;
  int threads, runs;
};

std::string setting_of(double tolerance_mm, std::size_t points) {
  return fmt::format("tol{:g}mm-{}", tolerance_mm, points);
}

ProximityResult of_points(const Setup& setup, const std::vector<Vector3d>& points,
                          double tolerance_mm) {
  ProximityResult result{"proximity", setup.scene, setting_of(tolerance_mm, points.size()),
                         setup.threads};
  std::vector<collision::Proximity> found(points.size());
  for (int run = 0; run < setup.runs; ++run)
    result.ms.push_back(timed_ms([&] {
      collision::HullProximity(setup.query, {kCap_m, 1e-3 * tolerance_mm}).of_points(points, found);
    }));
  set_widths(found, result);
  judge(
      setup.known, [&](std::size_t i) { return found[i]; }, result);
  return result;
}

ProximityResult of_mesh(const Setup& setup, const SceneObject& object, double tolerance_mm) {
  ProximityResult result{"proximitymesh", setup.scene,
                         setting_of(tolerance_mm, object.mesh.vertices_m.size()), setup.threads};
  collision::MeshProximity found;
  for (int run = 0; run < setup.runs; ++run)
    result.ms.push_back(timed_ms([&] {
      found = collision::HullProximity(setup.query, {kCap_m, 1e-3 * tolerance_mm})
                  .of_mesh(object.mesh, object.world_from_mesh);
    }));
  set_widths(found.vertices, result);
  judge(
      setup.known, [&](std::size_t i) { return found.vertices[i]; }, result);
  return result;
}

// Chooses the voxel so that its diagonal is the tolerance.
ProximityResult by_grid(const Setup& setup, const std::vector<Vector3d>& points,
                        double tolerance_mm, baselines::DistanceGrid& grid) {
  ProximityResult result{"edt", setup.scene, setting_of(tolerance_mm, points.size()),
                         setup.threads};
  Eigen::AlignedBox3d box;
  for (const Vector3d& p : points) box.extend(p);
  box = {box.min() - Vector3d::Constant(kCap_m), box.max() + Vector3d::Constant(kCap_m)};
  std::vector<float> found_m(points.size());
  for (int run = 0; run < std::min(setup.runs, 2); ++run)
    result.ms.push_back(timed_ms([&] {
      grid.build(setup.query, box);
      for (std::size_t i = 0; i < points.size(); ++i) found_m[i] = grid.distance_m(points[i]);
    }));
  result.points = points.size();
  for (const float m : found_m) result.below_cap += m < kCap_m;
  // The grid has no bounds of its own; its distance plus and minus the tolerance replaces them.
  judge(
      setup.known,
      [&](std::size_t i) {
        return collision::Proximity{found_m[i] - 1e-3 * tolerance_mm,
                                    found_m[i] + 1e-3 * tolerance_mm};
      },
      result);
  return result;
}

}  // namespace

std::string ProximityResult::name() const {
  return fmt::format("{}/{}/{}/{}", method, scene, setting, threads);
}
double ProximityResult::ms_per_1000() const {
  return points ? 1000 * base::percentile(ms, 0.5) / double(points) : 0;
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
      const Setup setup{curtain.name, query, known, threads, runs};
      for (const double tolerance_mm : {5.0, 2.0, 0.5})
        results.push_back(of_points(setup, points, tolerance_mm));
      results.push_back(by_grid(setup, points, 5, coarse));
      if (!quick && count == 10000)
        results.push_back(
            by_grid(setup, points, 2, fine));  // takes two seconds for any number of points
    }
    hull::CpuHull payload_hull(pool, assembly.silhouettes);
    const hull::HullQuery payload_query(payload_hull);
    std::vector<Vector3d> vertices;
    for (const Vector3d& v : assembly.objects[0].mesh.vertices_m)
      vertices.push_back(assembly.objects[0].world_from_mesh * v);
    const Known known = reference_of(assembly, vertices, known_points, pool);
    results.push_back(
        of_mesh({assembly.name, payload_query, known, threads, runs}, assembly.objects[0], 2));
  }
  return results;
}

void print(const std::vector<ProximityResult>& results) {
  using base::with_decimals;
  const auto or_dash = [](const std::optional<double>& mm) {
    return mm ? with_decimals(*mm, 3) : "-";
  };
  base::TextTable table({{"proximity: method/scene/setting/threads"},
                         {"ms best", true},
                         {"median", true},
                         {"per 1,000", true},
                         {"points", true},
                         {"in cap", true},
                         {"width med", true},
                         {"widest", true},
                         {"known", true},
                         {"broken", true},
                         {"error med", true},
                         {"worst", true}});
  for (const ProximityResult& r : results)
    table.add({r.name(), with_decimals(base::percentile(r.ms, 0), 2),
               with_decimals(base::percentile(r.ms, 0.5), 2), with_decimals(r.ms_per_1000(), 3),
               std::to_string(r.points), std::to_string(r.below_cap), or_dash(r.width_median_mm),
               or_dash(r.width_widest_mm), std::to_string(r.known), std::to_string(r.violations),
               with_decimals(r.error_median_mm, 3), with_decimals(r.error_worst_mm, 3)});
  std::cout << '\n'
            << table.text()
            << "in cap: points nearer than 5 cm; width: distance in mm between their two bounds.\n"
               "known: points of a seeded subset with an exact reference; broken: those whose true "
               "distance is outside the bounds (edt: outside\n"
               "its distance plus or minus the tolerance); error: of the bounds' midpoint in mm.\n"
               "proximitymesh: includes the triangles. edt: the diagonal of a voxel is the "
               "tolerance.\n";
}

}  // namespace fivepipe::collision_bench
