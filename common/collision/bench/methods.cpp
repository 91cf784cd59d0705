#include "common/collision/bench/methods.h"

#include <chrono>
#include <cstdio>
#include <memory>
#include <stdexcept>

#include "common/collision/detection.h"
#include "common/collision/rivals/brute_force.h"
#include "common/collision/rivals/hull_fcl.h"
#include "common/collision/rivals/hull_polygons.h"

namespace fivepipe::collision_bench {

double timed_ms(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

Method paper_method(int viewport_px, int window_px, int threads) {
  return {"paper" + std::to_string(viewport_px), std::to_string(window_px), threads,
          [query = std::make_shared<TriangleVolumeQuery>(window_px, viewport_px)](const CollisionScene& scene) {
            Answer answer;
            answer.times.maps_ms = timed_ms([&] { query->set_silhouettes(scene.silhouettes); });
            Detection detection;
            answer.times.query_ms = timed_ms([&] { detection = detect(*query, scene.objects_world_m); });
            answer.objects = std::move(detection.objects);
            answer.counts["triangles_queried"] = double(detection.counts.triangles_queried);
            return answer;
          }};
}

Method brute_method(int across, int threads) {
  struct State {
    WorkerPool pool;
    rivals::BruteForce brute;
    State(int n, int across_) : pool(n), brute(across_) {}
  };
  return {"brute", std::to_string(across) + "x" + std::to_string(across), threads, [state = std::make_shared<State>(threads, across)](const CollisionScene& scene) {
            Answer answer;
            answer.times.maps_ms = timed_ms([&] { state->brute.set_silhouettes(scene.silhouettes); });
            answer.times.query_ms = timed_ms([&] { answer.objects = state->brute.detect(scene.objects_world_m, state->pool); });
            answer.counts["samples"] = double(state->brute.samples_asked());
            return answer;
          }};
}

#ifdef FIVEPIPE_FCL

namespace {

struct FclState {
  WorkerPool pool;
  CpuHull hull{pool};
  rivals::HullPolygons polygons;
  std::string scene;  // that the trees are of
  std::unique_ptr<rivals::HullFcl> fcl;
  FclState(int threads, double cell_m) : pool(threads), polygons(cell_m) {}

  void build_trees(const CollisionScene& of) {
    if (scene == of.name) return;
    fcl = std::make_unique<rivals::HullFcl>();
    for (const SceneObject& object : of.objects) fcl->add(object.mesh);
    scene = of.name;
  }

  std::vector<ObjectCollision> query(const CollisionScene& of) {
    std::vector<ObjectCollision> found(of.objects.size());
    for (std::size_t i = 0; i < of.objects.size(); ++i)
      if (of.objects[i].deforms) fcl->refit(i, of.objects[i].mesh.vertices_m);
    pool.run(int(found.size()), [&](int i, int) { found[std::size_t(i)] = fcl->query(std::size_t(i), of.objects[std::size_t(i)].world_from_mesh); });
    return found;
  }
};

}  // namespace

Method fcl_method(double cell_mm, int threads) {
  char setting[32];
  std::snprintf(setting, sizeof setting, "%gmm", cell_mm);
  return {"fcl", setting, threads, [state = std::make_shared<FclState>(threads, 1e-3 * cell_mm)](const CollisionScene& scene) {
            Answer answer;
            state->build_trees(scene);
            std::optional<HullQuery> query;
            answer.times.maps_ms = timed_ms([&] {
              state->hull.assign(scene.silhouettes);
              query.emplace(state->hull);
            });
            const Mesh* surface = nullptr;
            const double polygonise_ms = timed_ms([&] { surface = &state->polygons.polygonise(*query, scene.volume_world_m); });
            const double tree_ms = timed_ms([&] { state->fcl->set_hull(*surface); });
            answer.times.build_ms = polygonise_ms + tree_ms;
            answer.times.query_ms = timed_ms([&] { answer.objects = state->query(scene); });
            answer.counts = {{"hull_triangles", double(surface->triangles.size())}, {"hull_points_asked", double(state->polygons.points_asked())}, {"polygonise_ms", polygonise_ms}, {"tree_ms", tree_ms}};
            return answer;
          }};
}

std::string why_no_fcl() { return {}; }

#else

Method fcl_method(double, int) { throw std::logic_error(why_no_fcl()); }
std::string why_no_fcl() { return "built without the Flexible Collision Library (Debian: libfcl-dev)"; }

#endif

}  // namespace fivepipe::collision_bench
