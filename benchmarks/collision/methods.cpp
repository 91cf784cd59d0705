#include "benchmarks/collision/methods.h"

#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <stdexcept>

#include "benchmarks/collision/baselines/brute_force.h"
#include "benchmarks/collision/baselines/hull_fcl.h"
#include "benchmarks/collision/baselines/hull_polygons.h"
#include "common/collision/detection/cpu/cpu_detection.h"
#include "common/collision/detection/gl/gl_detection.h"
#include "common/collision/detection/paper/paper_detection.h"

namespace fivepipe::collision_bench {

double timed_ms(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
}

namespace {

double timed_maps_ms(const CollisionScene& scene, hull::CpuHull& hull,
                     std::optional<hull::HullQuery>& query) {
  return timed_ms([&] {
    hull.assign(scene.silhouettes);
    query.emplace(hull);
  });
}

struct TreeState {
  base::WorkerPool pool;
  hull::CpuHull hull{pool};
  std::string scene;  // of the trees
  std::vector<collision::Bvh> trees;
  explicit TreeState(int threads) : pool(threads) {}

  void build_trees(const CollisionScene& of) {
    if (scene == of.name) return;
    scene = of.name;
    trees.clear();
    for (const SceneObject& object : of.objects) trees.emplace_back(object.mesh);
  }

  std::vector<collision::DetectionObject> objects_of(const CollisionScene& of) {
    std::vector<collision::DetectionObject> objects;
    for (std::size_t i = 0; i < of.objects.size(); ++i) {
      if (of.objects[i].deforms) trees[i].refit(of.objects[i].mesh.vertices_m);
      objects.push_back({&trees[i], of.objects[i].world_from_mesh,
                         of.objects[i].world_from_mesh * trees[i].origin_m()});
    }
    return objects;
  }
};

constexpr std::size_t kAllPoints = std::size_t{1} << 24;

collision::DetectionOptions options_for(double eps_mm, bool points) {
  return {
      .eps_m = 1e-3 * eps_mm, .spacing_m = points ? 1e-3 * eps_mm : 0, .max_points = kAllPoints};
}

std::string eps_setting(double eps_mm) { return fmt::format("eps{:g}mm", eps_mm); }

}  // namespace

Method cpu_method(double eps_mm, bool points, int threads) {
  struct CpuState : TreeState {
    using TreeState::TreeState;
    collision::CpuDetection detection;
  };
  return {points ? "cpu" : "cpuverdict", eps_setting(eps_mm), threads,
          [options = options_for(eps_mm, points),
           state = std::make_shared<CpuState>(threads)](const CollisionScene& scene) {
            Answer answer;
            state->build_trees(scene);
            std::optional<hull::HullQuery> query;
            answer.times.maps_ms = timed_maps_ms(scene, state->hull, query);
            collision::CpuDetectionCounts counts;
            std::span<const collision::ObjectCollision> found;
            answer.times.query_ms = timed_ms([&] {
              found = state->detection.detect(*query, state->objects_of(scene), options, &counts);
            });
            answer.objects.assign(found.begin(), found.end());
            answer.counts = {{"boxes", double(counts.boxes)},
                             {"triangles_classified", double(counts.triangles_classified)},
                             {"triangles_walked", double(counts.triangles_walked)},
                             {"points_in_double", double(counts.points_in_double)},
                             {"over_budget", double(counts.over_budget)}};
            return answer;
          }};
}

Method gl_method(double eps_mm, bool points, int threads) {
  struct GlState : TreeState {
    using TreeState::TreeState;
    collision::GlDetection detection;
  };
  return {points ? "gl" : "glverdict", eps_setting(eps_mm), threads,
          [options = options_for(eps_mm, points),
           state = std::make_shared<GlState>(threads)](const CollisionScene& scene) {
            Answer answer;
            state->build_trees(scene);
            std::optional<hull::HullQuery> query;
            answer.times.maps_ms = timed_maps_ms(scene, state->hull, query);
            answer.times.build_ms = timed_ms([&] { state->detection.set_hull(*query); });
            collision::GlDetectionCounts counts;
            std::span<const collision::ObjectCollision> found;
            answer.times.query_ms = timed_ms([&] {
              found = state->detection.detect(state->objects_of(scene), options, &counts);
            });
            answer.objects.assign(found.begin(), found.end());
            answer.counts = {{"triangles_open", double(counts.triangles_open)},
                             {"triangles_on_cpu", double(counts.triangles_on_cpu)},
                             {"parts", double(counts.parts)},
                             {"found", double(counts.found)},
                             {"unconfirmed", double(counts.unconfirmed)},
                             {"over_budget", double(counts.over_budget)},
                             {"descent_ms", counts.descent_ms},
                             {"refine_ms", counts.refine_ms}};
            return answer;
          }};
}

Method paper_method(int viewport_px, int window_px, int threads) {
  return {"paper" + std::to_string(viewport_px), std::to_string(window_px), threads,
          [query = std::make_shared<collision::TriangleVolumeQuery>(window_px, viewport_px)](
              const CollisionScene& scene) {
            Answer answer;
            answer.times.maps_ms = timed_ms([&] { query->set_silhouettes(scene.silhouettes); });
            collision::Detection detection;
            answer.times.query_ms =
                timed_ms([&] { detection = collision::detect(*query, scene.objects_world_m); });
            answer.objects = std::move(detection.objects);
            answer.counts["triangles_queried"] = double(detection.counts.triangles_queried);
            return answer;
          }};
}

Method brute_method(int across, int threads) {
  struct State {
    base::WorkerPool pool;
    baselines::BruteForce brute;
    State(int n, int across_) : pool(n), brute(across_) {}
  };
  return {"brute", fmt::format("{0}x{0}", across), threads,
          [state = std::make_shared<State>(threads, across)](const CollisionScene& scene) {
            Answer answer;
            answer.times.maps_ms =
                timed_ms([&] { state->brute.set_silhouettes(scene.silhouettes); });
            answer.times.query_ms = timed_ms(
                [&] { answer.objects = state->brute.detect(scene.objects_world_m, state->pool); });
            answer.counts["samples"] = double(state->brute.samples_tested());
            return answer;
          }};
}

#ifdef FIVEPIPE_FCL

namespace {

struct FclState {
  base::WorkerPool pool;
  hull::CpuHull hull{pool};
  baselines::HullPolygons polygons;
  std::string scene;  // of the trees
  std::unique_ptr<baselines::HullFcl> fcl;
  std::vector<geometry::Mesh> meshes_world_m;
  Eigen::AlignedBox3d volume_world_m;  // the hull near the objects
  double cell_m;
  FclState(int threads, double cell_m_) : pool(threads), polygons(cell_m_), cell_m(cell_m_) {}

  void build_trees(const CollisionScene& of) {
    if (scene == of.name) return;
    scene = of.name;
    fcl = std::make_unique<baselines::HullFcl>();
    meshes_world_m.clear();
    Eigen::AlignedBox3d bounds;
    for (const SceneObject& object : of.objects) {
      meshes_world_m.push_back(object.mesh);
      for (Eigen::Vector3d& v : meshes_world_m.back().vertices_m)
        bounds.extend(v = object.world_from_mesh * v);
      fcl->add(meshes_world_m.back());
    }
    // A margin of two cells keeps the objects away from the border where the surface is cut off.
    const Eigen::Vector3d margin_m = Eigen::Vector3d::Constant(2 * cell_m);
    volume_world_m =
        of.volume_world_m.intersection({bounds.min() - margin_m, bounds.max() + margin_m});
  }

  std::vector<collision::ObjectCollision> query(const CollisionScene& of) {
    std::vector<collision::ObjectCollision> found(of.objects.size());
    const auto in_volume = [&](const Eigen::Vector3d& p_m) { return polygons.contains(p_m); };
    for (std::size_t i = 0; i < of.objects.size(); ++i)
      if (of.objects[i].deforms) fcl->refit(i, meshes_world_m[i].vertices_m);
    pool.run(int(found.size()),
             [&](int i, int) { found[std::size_t(i)] = fcl->query(std::size_t(i), in_volume); });
    return found;
  }
};

}  // namespace

Method fcl_method(double cell_mm, int threads) {
  return {
      "fcl", fmt::format("{:g}mm", cell_mm), threads,
      [state = std::make_shared<FclState>(threads, 1e-3 * cell_mm)](const CollisionScene& scene) {
        Answer answer;
        state->build_trees(scene);
        std::optional<hull::HullQuery> query;
        answer.times.maps_ms = timed_maps_ms(scene, state->hull, query);
        const geometry::Mesh* surface = nullptr;
        const double polygonise_ms =
            timed_ms([&] { surface = &state->polygons.polygonise(*query, state->volume_world_m); });
        const double tree_ms = timed_ms([&] { state->fcl->set_hull(*surface); });
        answer.times.build_ms = polygonise_ms + tree_ms;
        answer.times.query_ms = timed_ms([&] { answer.objects = state->query(scene); });
        answer.counts = {{"hull_triangles", double(surface->triangles.size())},
                         {"hull_points_asked", double(state->polygons.points_tested())},
                         {"polygonise_ms", polygonise_ms},
                         {"tree_ms", tree_ms}};
        return answer;
      }};
}

std::string why_no_fcl() { return {}; }

#else

Method fcl_method(double, int) { throw std::logic_error(why_no_fcl()); }
std::string why_no_fcl() {
  return "built without the Flexible Collision Library (Debian: libfcl-dev)";
}

#endif

}  // namespace fivepipe::collision_bench
