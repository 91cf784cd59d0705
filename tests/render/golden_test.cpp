// Compares a composited scene with the image in tests/golden.
#include "render_node/renderer.h"
#include "tests/support/checked_gl_context.h"
#include "tests/support/golden_image.h"
#include "tests/support/render_scenes.h"

namespace fivepipe::render {
namespace {

// Another driver may round a shade to the next level and assign edge pixels to the other surface.
// The image has about 1,500 edge pixels; a tenth of them, wrong by 100 levels, give a mean of 0.8.
// The mean could hide a misplaced surface, so only few pixels may differ by more than shading can.
constexpr test::GoldenTolerance kTolerance{.mean_levels = 1, .pixel_levels = 12};

config::Scene table_scene() {
  config::Scene scene;
  scene.light_world_m = {-0.6, -0.7, 1.6};
  scene.objects = {
      test::object("table", config::BoxShape{{1.2, 0.8, 0.04}}, {0, 0, -0.02}, {0.72, 0.66, 0.58},
                   config::Pattern::checker, 0.1),
      test::object("payload_a", config::BoxShape{{0.18, 0.14, 0.22}}, {-0.25, 0.05, 0.11},
                   {0.35, 0.5, 0.75}),
      test::object("payload_b", config::BoxShape{{0.12, 0.2, 0.12}}, {0.22, 0.12, 0.06},
                   {0.8, 0.65, 0.3}),
      test::object("ball", config::SphereShape{0.06, 3}, {0.05, -0.18, 0.06}, {0.9, 0.9, 0.88}),
      test::object("curtain", config::CurtainShape{0.6, 0.5, 18, 20, 0.03, 4}, {0.3, 0.3, 0.55},
                   {0.55, 0.75, 0.6})};
  return scene;
}

TEST(Golden, TableWithARealBallIsUnchanged) {
  test::CheckedGlContext context;
  config::Viewer viewer;
  viewer.render_width_px = 160;
  viewer.render_height_px = 120;
  viewer.recon_width_px = 80;
  viewer.recon_height_px = 60;
  const geometry::Camera eye{config::recon_pinhole(viewer),
                             geometry::look_at({-0.35, -1.1, 0.65}, {0.02, 0.05, 0.12})};
  const std::array<std::uint8_t, 3> skin = {120, 150, 225};
  const HullFrame hull =
      test::hull_of(eye.camera_from_world, eye.pinhole, &skin, [&](int u, int v) {
        return test::ball_depth_m(eye, u, v, {0.12, 0.1, 0.14}, 0.11);
      });
  Renderer renderer(table_scene(), viewer);
  renderer.draw(hull, {}, {"payload_b"});
  test::expect_golden(renderer.image_bgr(), "table_with_real_ball.png", kTolerance);
}

}  // namespace
}  // namespace fivepipe::render
