// Backends `cpu` and `gl` against the independent reference in every pixel of the benchmark's
// scenes. The quick run takes five scenes with small views. With FIVEPIPE_LONG it takes every scene
// of `fivepipe bench hull --full` at every size.
#include "benchmarks/hull/every_pixel.h"

#include <algorithm>
#include <cstdlib>
#include <thread>

#include "tests/support/hull/backends.h"

namespace fivepipe::hull_bench {
namespace {

std::vector<Views> small_views() {
  return {{{hand_scene("hand4", 0.68, 1.0), hand_scene("hand4-near", 0.395, 1.0),
            hand_scene("sparse", 0.68, 2.0), hand_scene("dense", 0.68, 0.46),
            ring_scene("ring8", 8, 720, 486, 0.5)},
           {{128, 96}}}};
}

TEST(EveryPixel, CpuAndGlEqualTheReference) {
  base::WorkerPool pool(std::max(2u, std::thread::hardware_concurrency()));
  std::vector<PixelRow> rows;
  for (const Views& views : std::getenv("FIVEPIPE_LONG") ? all_views() : small_views())
    for (const HullScene& scene : views.scenes)
      for (const auto& [width_px, height_px] : views.sizes_px) {
        const hull::View view = view_of(scene, width_px, height_px);
        const std::vector<double> reference_m = reference_depths_m(scene, view, pool);
        for (const char* backend : {"cpu", "gl"}) {
          test::HullBackend& hull = test::backends->get(backend);
          hull.set_silhouettes(scene.silhouettes);
          const auto depth_m = test::depth_of(hull, {0, 0, width_px, height_px}, view).depth_m;
          rows.push_back({scene.name, backend, width_px, height_px,
                          compare_every_pixel(depth_m, reference_m)});
          EXPECT_EQ(rows.back().errors.wrong, 0u) << scene.name << ' ' << backend;
          EXPECT_GT(rows.back().errors.hits, 50u) << scene.name;
        }
      }
  std::printf("%s", every_pixel_table(rows).c_str());
}

TEST(EveryPixel, CountsOtherVerdictsAndDepths) {
  const std::vector<double> reference_m{0, 0, 1, 1, 1, 1};
  const std::vector<float> depth_m{0, 1, 0, 1, 1 + 1e-6f, 1 + 3e-6f};
  const PixelErrors errors = compare_every_pixel(depth_m, reference_m);
  EXPECT_EQ(errors.pixels, 6u);
  EXPECT_EQ(errors.hits, 4u);
  EXPECT_EQ(errors.wrong, 3u);  // a hit, a miss, a depth
  EXPECT_NEAR(errors.max_depth_error, 3e-6, 1e-7);
}

}  // namespace
}  // namespace fivepipe::hull_bench
