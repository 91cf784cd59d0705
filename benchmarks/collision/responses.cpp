#include "benchmarks/collision/responses.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>

#include "benchmarks/collision/analytic_normal.h"
#include "benchmarks/collision/baselines/hull_polygons.h"
#include "benchmarks/collision/baselines/rendered_response.h"
#include "common/base/timing.h"
#include "common/collision/detection/cpu/cpu_detection.h"
#include "common/collision/response/hull_normal.h"
#include "common/hull/oracle/reference.h"

namespace fivepipe::collision_bench {
namespace {

using Eigen::Vector3d;

constexpr collision::ResponseConfig kPaper;  // 5 cm, 10 degrees, 400 px
constexpr std::size_t kSeededCases = 60;

Vector3d center_world_m(const SceneObject& object) {
  return object.world_from_mesh * geometry::bounds_m(object.mesh).center();
}

std::optional<double> exact_d_rec_m(const CollisionScene& scene, const Vector3d& p,
                                    const Vector3d& direction, double height_m) {
  const auto in = hull::reference_intervals(scene.silhouettes, {p, direction}, 0, height_m);
  if (in.empty() || !(in.back().leave < height_m)) return std::nullopt;
  return in.back().leave;
}

// Returns whether the camera limits the hull of the maps at the case's exit.
bool limits(const hull::HullQuery& query, const ResponseCase& c, std::size_t camera) {
  const auto exit =
      collision::exit_from_base(query, c.cp_object_world_m, c.v_rec_world, c.height_m);
  if (!exit) return false;
  const collision::HullNormal normal =
      collision::closed_form_normal(query, {c.cp_object_world_m, c.v_rec_world, c.height_m, *exit});
  return std::any_of(normal.cameras.begin(), normal.cameras.end(),
                     [&](const hull::LimitingCamera& l) { return l.camera == int(camera); });
}

// Searches the surface of the hull of the true silhouettes, from the exact exit at most two pixels
// back along V_rec. Returns nullopt if it is farther, or if another camera limits it: it is then
// another part of the hull.
std::optional<ResponseCase::Surface> surface_at(const CollisionScene& scene,
                                                const hull::HullQuery& query,
                                                const ResponseCase& c) {
  if (scene.real_objects.empty()) return std::nullopt;
  std::vector<geometry::Camera> cameras;
  for (const hull::Silhouette& s : scene.silhouettes) cameras.push_back(s.camera);
  constexpr double kStep_m = 1e-4;
  const geometry::Ray ray{c.cp_object_world_m, c.v_rec_world};
  const double min_m =
      c.d_rec_m -
      2 * collision::pixel_footprint_m(query, ray.origin_world_m + c.d_rec_m * ray.direction_world);
  for (double m = c.d_rec_m; m > min_m; m -= kStep_m)
    if (const auto exit =
            analytic_exit(scene.real_objects, cameras, ray, m,
                          std::min(m + kStep_m, c.d_rec_m + collision::kMaxRounding_m)))
      return limits(query, c, exit->camera)
                 ? std::optional(ResponseCase::Surface{exit->camera, exit->normal_world})
                 : std::nullopt;
  return std::nullopt;
}

// The last point at which the ray leaves the mesh.
struct MeshExit {
  double distance_m;
  Vector3d normal_world;
};
std::optional<MeshExit> mesh_exit(const geometry::Mesh& mesh, const Vector3d& p,
                                  const Vector3d& direction, double height_m) {
  MeshExit exit{-1, Vector3d::Zero()};
  for (const auto& [a, b, c] : mesh.triangles) {  // Moeller and Trumbore 1997
    const Vector3d ab = mesh.vertices_m[b] - mesh.vertices_m[a],
                   ac = mesh.vertices_m[c] - mesh.vertices_m[a], h = direction.cross(ac),
                   s = p - mesh.vertices_m[a];
    const double det = ab.dot(h), u = s.dot(h) / det, v = direction.dot(s.cross(ab)) / det,
                 t = ac.dot(s.cross(ab)) / det;
    if (!(u >= 0 && v >= 0 && u + v <= 1 && t >= 0 && t < height_m && t > exit.distance_m))
      continue;
    exit = {t, ab.cross(ac).normalized()};
  }
  if (exit.distance_m < 0) return MeshExit{0, Vector3d::Zero()};     // p is outside the mesh
  if (!(exit.normal_world.dot(direction) > 0)) return std::nullopt;  // the base is inside the mesh
  return exit;
}

Quantiles quantiles(std::vector<double> values) {
  return {base::percentile(values, 0.5), base::percentile(values, 0.95),
          base::percentile(values, 1), values.size()};
}

struct Exit {
  double d_rec_m;
  Vector3d cp_hull_world_m;
  std::optional<Vector3d> normal_world;
};

}  // namespace

struct Responses::Work {
  const CollisionScene& scene;
  base::WorkerPool pool{1};
  hull::CpuHull hull;
  hull::HullQuery query;
  baselines::RenderedResponse rendered{kPaper.window_px};
  std::vector<ResponseCase> cases;
  std::map<std::string, ResponseErrors> errors;  // by method of response
  std::optional<double> refit_ms;
  std::vector<Vector3d> centers_world_m;  // of the objects

  explicit Work(const CollisionScene& of)
      : scene(of), hull(pool, of.silhouettes), query(hull), cases(response_cases(of)) {
    rendered.set_silhouettes(of.silhouettes);
    for (const SceneObject& object : of.objects) centers_world_m.push_back(center_world_m(object));
  }

  // `limiting` selects the camera whose normal is returned if several cameras limit the hull.
  std::optional<Exit> exact(const Vector3d& cp, const Vector3d& v_rec, double height_m,
                            std::optional<std::size_t> limiting) const {
    const auto exit = collision::exit_from_base(query, cp, v_rec, height_m);
    if (!exit) return std::nullopt;
    Exit found{exit->distance_m, cp + exit->distance_m * v_rec, std::nullopt};
    const collision::HullNormal normal =
        collision::closed_form_normal(query, {cp, v_rec, height_m, *exit});
    if (normal.status != collision::NormalStatus::defined) return found;
    found.normal_world = normal.normal_world;
    for (const hull::LimitingCamera& c : normal.cameras)
      if (limiting && c.camera == int(*limiting)) found.normal_world = c.normal_world;
    return found;
  }
  std::optional<Exit> by_window(const Vector3d& cp, const Vector3d& v_rec, double height_m) {
    const auto exit = rendered.respond(cp, v_rec, height_m, kPaper.apex_angle_rad);
    if (!exit) return std::nullopt;
    return Exit{exit->d_rec_m, exit->cp_hull_world_m, exit->normal_world};
  }

  template <class Respond>
  ResponseErrors errors_of(const Respond& respond) const {
    ResponseErrors e{.cases = cases.size()};
    std::vector<double> cp_hull_mm, d_rec_mm, n_hull_deg;
    for (const ResponseCase& c : cases) {
      const std::optional<Exit> exit = respond(c);
      if (!exit) {
        ++e.no_exit;
        continue;
      }
      cp_hull_mm.push_back(
          1000 *
          (exit->cp_hull_world_m - (c.cp_object_world_m + c.d_rec_m * c.v_rec_world)).norm());
      d_rec_mm.push_back(1000 * std::abs(exit->d_rec_m - c.d_rec_m));
      if (c.surface && exit->normal_world)
        n_hull_deg.push_back(angle_deg(*exit->normal_world, c.surface->normal_world));
    }
    e.cp_hull_mm = quantiles(cp_hull_mm), e.d_rec_mm = quantiles(d_rec_mm),
    e.n_hull_deg = quantiles(n_hull_deg);
    return e;
  }

  ResponseErrors errors_of_polygons(double cell_m) const {
    // The polygons of the method, within a margin that contains every exit.
    Eigen::AlignedBox3d bounds;
    for (const ResponseCase& c : cases) bounds.extend(c.cp_object_world_m);
    const Vector3d margin_m = Vector3d::Constant(kPaper.height_m + 2 * cell_m);
    const Eigen::AlignedBox3d volume =
        scene.volume_world_m.intersection({bounds.min() - margin_m, bounds.max() + margin_m});
    baselines::HullPolygons polygons(cell_m);
    const geometry::Mesh& mesh =
        cases.empty() ? geometry::Mesh{} : polygons.polygonise(query, volume);
    return errors_of([&](const ResponseCase& c) -> std::optional<Exit> {
      const auto exit = mesh_exit(mesh, c.cp_object_world_m, c.v_rec_world, c.height_m);
      if (!exit) return std::nullopt;
      std::optional<Vector3d> normal;
      if (exit->normal_world.squaredNorm() > 0) normal = exit->normal_world;
      return Exit{exit->distance_m, c.cp_object_world_m + exit->distance_m * c.v_rec_world, normal};
    });
  }

  double median_refit_ms() const {
    double sum_ms = 0;
    for (const SceneObject& object : scene.objects) {
      if (!object.deforms) continue;
      collision::Bvh tree(object.mesh);
      std::vector<double> ms;
      for (int i = 0; i < 20; ++i)
        ms.push_back(timed_ms([&] { tree.refit(object.mesh.vertices_m); }));
      sum_ms += base::percentile(ms, 0.5);
    }
    return sum_ms;
  }
};

std::vector<ResponseCase> response_cases(const CollisionScene& scene) {
  base::WorkerPool pool(1);
  hull::CpuHull hull(pool, scene.silhouettes);
  const hull::HullQuery query(hull);
  std::vector<collision::Bvh> trees;
  trees.reserve(scene.objects.size());
  std::vector<collision::DetectionObject> objects;
  for (const SceneObject& object : scene.objects)
    objects.push_back(
        {&trees.emplace_back(object.mesh), object.world_from_mesh, center_world_m(object)});
  collision::CpuDetection detection;
  const auto found = detection.detect(query, objects);
  std::vector<ResponseCase> cases;
  const auto add = [&](const Vector3d& cp, const Vector3d& direction, double height_m) {
    const auto d_rec_m = exact_d_rec_m(scene, cp, direction, height_m);
    if (!d_rec_m) return;
    cases.push_back({cp, direction, height_m, *d_rec_m, {}});
    cases.back().surface = surface_at(scene, query, cases.back());
  };
  std::vector<std::pair<std::size_t, collision::CollisionPoint>> all;
  for (std::size_t o = 0; o < found.size(); ++o) {
    for (const collision::CollisionPoint& p : found[o].points) all.emplace_back(o, p);
    if (found[o].points.empty()) continue;
    const Vector3d cp = collision::cp_object(query, found[o].points, objects[o].rp_object_world_m)
                            .p_world_m,
                   to_center_m = objects[o].rp_object_world_m - cp;
    if (to_center_m.norm() > 0)
      add(cp, to_center_m.normalized(), std::min(kPaper.height_m, to_center_m.norm()));
  }
  std::mt19937 random(4);
  for (std::size_t i = 0; i < std::min(kSeededCases, all.size()); ++i) {
    std::swap(all[i], all[i + random() % (all.size() - i)]);
    const auto& [o, p] = all[i];
    const collision::Triangle& t = scene.objects_world_m[o][p.triangle];
    const Vector3d normal = (t[1] - t[0]).cross(t[2] - t[0]).normalized();
    const auto up_m = exact_d_rec_m(scene, p.p_world_m, normal, kPaper.height_m),
               down_m = exact_d_rec_m(scene, p.p_world_m, -normal, kPaper.height_m);
    if (up_m || down_m)
      add(p.p_world_m, !down_m || (up_m && *up_m <= *down_m) ? normal : Vector3d(-normal),
          kPaper.height_m);
  }
  return cases;
}

Responses::Responses(const CollisionScene& scene) : work_(std::make_unique<Work>(scene)) {}
Responses::~Responses() = default;

std::optional<double> Responses::frame_ms(const Method& method,
                                          std::span<const collision::ObjectCollision> found) {
  if (method.name == "fcl") return std::nullopt;
  const bool paper = method.name.starts_with("paper");
  bool points = false;
  const double ms = timed_ms([&] {
    for (std::size_t o = 0; o < found.size(); ++o) {
      if (found[o].points.empty()) continue;
      points = true;
      const Vector3d& center = work_->centers_world_m[o];
      const collision::CollisionPoint& cp =
          collision::cp_object(work_->query, found[o].points, center);
      const collision::Triangle& t = work_->scene.objects_world_m[o][cp.triangle];
      // If the center is inside the hull, the simulation must provide a direction. The benchmark
      // uses the triangle's normal.
      const bool by_default = !work_->query.contains(center);
      const Vector3d to_m =
          by_default ? Vector3d(center - cp.p_world_m) : Vector3d((t[1] - t[0]).cross(t[2] - t[0]));
      const double height_m = by_default ? std::min(kPaper.height_m, to_m.norm()) : kPaper.height_m;
      if (paper)
        work_->by_window(cp.p_world_m, to_m.normalized(), height_m);
      else
        work_->exact(cp.p_world_m, to_m.normalized(), height_m, std::nullopt);
    }
  });
  if (!points || method.name.ends_with("verdict")) return std::nullopt;
  return ms;
}

std::optional<ResponseErrors> Responses::errors(const Method& method) {
  if (method.name.ends_with("verdict")) return std::nullopt;
  const bool paper = method.name.starts_with("paper"), fcl = method.name == "fcl";
  const std::string kind = paper ? "window" : fcl ? method.setting : "exact";
  const auto [at, first] = work_->errors.try_emplace(kind);
  if (!first) return at->second;
  if (paper)
    at->second = work_->errors_of([&](const ResponseCase& c) {
      return work_->by_window(c.cp_object_world_m, c.v_rec_world, c.height_m);
    });
  else if (fcl)
    at->second = work_->errors_of_polygons(1e-3 * std::atof(method.setting.c_str()));
  else
    at->second = work_->errors_of([&](const ResponseCase& c) {
      return work_->exact(c.cp_object_world_m, c.v_rec_world, c.height_m,
                          c.surface ? std::optional(c.surface->camera) : std::nullopt);
    });
  return at->second;
}

std::optional<double> Responses::refit_ms(const Method& method) {
  if (method.name == "fcl") return std::nullopt;
  if (method.name.starts_with("paper") || method.name == "brute") return 0;
  if (!work_->refit_ms) work_->refit_ms = work_->median_refit_ms();
  return work_->refit_ms;
}

}  // namespace fivepipe::collision_bench
