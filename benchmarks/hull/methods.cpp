#include "benchmarks/hull/methods.h"

#include <fmt/format.h>

#include <algorithm>

#include "benchmarks/hull/baselines/cpu_plane_sweep.h"
#include "benchmarks/hull/baselines/image_based_hull.h"
#include "benchmarks/hull/baselines/voxel_carving.h"
#include "common/hull/cpu/cpu_hull.h"
#include "common/hull/gl/gl_hull.h"
#include "common/hull/paper/plane_sweep.h"

namespace fivepipe::hull_bench {
namespace {

hull::PixelRect whole(const hull::View& view) {
  return {0, 0, view.camera.pinhole.width_px, view.camera.pinhole.height_px};
}
double plane_spacing_mm(const hull::View& view, int planes) {
  return (view.far_m - view.near_m) * 1000 / planes;
}

}  // namespace

Method cpu_method(int threads) {
  struct State {
    base::WorkerPool pool;
    hull::CpuHull hull{pool};
    explicit State(int n) : pool(n) {}
  };
  return {"cpu", threads, true,
          [state = std::make_shared<State>(threads)](const HullScene& scene, const hull::View& view,
                                                     std::span<float> depth_m) {
            state->hull.assign(scene.silhouettes);
            state->hull.depth(view, whole(view), depth_m);
          }};
}

Method gl_method(int threads) {
  return {"gl", threads, true,
          [hull = std::make_shared<hull::GlHull>()](const HullScene& scene, const hull::View& view,
                                                    std::span<float> depth_m) {
            hull->set_silhouettes(scene.silhouettes);
            const hull::PixelRect rect = whole(view);
            const auto tiles = hull->depth(view, std::span(&rect, 1));
            std::ranges::copy(tiles.front().depth_m, depth_m.begin());
          }};
}

Method image_based_method(int threads) {
  struct State {
    base::WorkerPool pool;
    baselines::ImageBasedHull hull;
    explicit State(int n) : pool(n) {}
  };
  return {"ibvh", threads, false,
          [state = std::make_shared<State>(threads)](const HullScene& scene, const hull::View& view,
                                                     std::span<float> depth_m) {
            state->hull.depth(scene.silhouettes, view, state->pool, depth_m);
          }};
}

namespace {

Method sweep_method(const std::string& name, int planes, baselines::SweptDepth depth,
                    baselines::SweptPlanes swept, int threads) {
  struct State {
    base::WorkerPool pool;
    baselines::CpuPlaneSweep sweep;
    State(int p, baselines::SweptDepth d, baselines::SweptPlanes s, int n)
        : pool(n), sweep(p, d, s) {}
  };
  return {name + std::to_string(planes), threads, false,
          [state = std::make_shared<State>(planes, depth, swept, threads)](
              const HullScene& scene, const hull::View& view, std::span<float> depth_m) {
            state->sweep.depth(scene.silhouettes, view, state->pool, depth_m);
          },
          [planes](const hull::View& view) { return plane_spacing_mm(view, planes); }};
}

}  // namespace

Method cpu_sweep_method(int planes, bool centered, int threads) {
  return sweep_method(centered ? "cpusweepmid" : "cpusweep", planes,
                      centered ? baselines::SweptDepth::centered : baselines::SweptDepth::plane,
                      baselines::SweptPlanes::by_counts, threads);
}

Method plain_sweep_method(int planes, int threads) {
  return sweep_method("plainsweep", planes, baselines::SweptDepth::centered,
                      baselines::SweptPlanes::by_bounds, threads);
}

Method carving_method(double voxel_mm, int threads) {
  struct State {
    base::WorkerPool pool;
    std::string scene;  // of the carver's volume
    std::unique_ptr<baselines::VoxelCarving> carver;
    explicit State(int n) : pool(n) {}
  };
  return {fmt::format("carve{:g}mm", voxel_mm),
          threads,
          false,
          [state = std::make_shared<State>(threads), voxel_mm](
              const HullScene& scene, const hull::View& view, std::span<float> depth_m) {
            if (state->scene != scene.name)
              state->carver =
                  std::make_unique<baselines::VoxelCarving>(scene.volume_world_m, 1e-3 * voxel_mm),
              state->scene = scene.name;
            state->carver->depth(scene.silhouettes, view, state->pool, depth_m);
          },
          [voxel_mm](const hull::View&) { return 2 * voxel_mm; },
          [](const HullScene& scene) {
            return scene.silhouettes.size() <= baselines::kMaxCarvingCameras;
          }};
}

Method gl_sweep_method(int planes, int threads) {
  struct State {
    std::unique_ptr<hull::PlaneSweep> sweep;  // has the last view's size
  };
  return {"glsweep" + std::to_string(planes), threads, false,
          [state = std::make_shared<State>(), planes](
              const HullScene& scene, const hull::View& view, std::span<float> depth_m) {
            const hull::PixelRect rect = whole(view);
            if (!state->sweep || state->sweep->width_px() != rect.u1_px ||
                state->sweep->height_px() != rect.v1_px)
              state->sweep = std::make_unique<hull::PlaneSweep>(rect.u1_px, rect.v1_px, planes);
            state->sweep->set_silhouettes(scene.silhouettes);
            const auto tiles =
                state->sweep->depth(view, {view.near_m, view.far_m}, std::span(&rect, 1));
            std::ranges::copy(tiles.front().depth_m, depth_m.begin());
          },
          [planes](const hull::View& view) { return plane_spacing_mm(view, planes); }};
}

}  // namespace fivepipe::hull_bench
