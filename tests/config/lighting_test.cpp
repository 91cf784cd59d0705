// The light's view, and its keys in scene files.
#include "common/config/scene.h"
#include "common/config/views.h"
#include "tests/support/scene_files.h"

namespace fivepipe::config {
namespace {

using ::testing::ElementsAre;

class Lighting : public test::SceneFiles {
 protected:
  Scene load(const std::string& keys) {
    return test::load_scene(write("scene.yaml", "name: lit\nlight_m: [0, 0, 3]\n" + keys + R"(
objects:
  - {name: floor, box: {size_m: [1, 1, 1]}, position_m: [0, 0, 0]}
)"));
  }
};

TEST_F(Lighting, IsOffByDefault) {
  const Scene scene = load("");
  EXPECT_FALSE(scene.lights_real_objects);
  EXPECT_FALSE(scene.shadows);
  EXPECT_FALSE(light_view(scene));
}

TEST_F(Lighting, ReadsEveryKey) {
  const Scene scene = load(R"(lights_real_objects: true
shadows: {target_m: [1, 2, 0], fov_deg: 90, near_m: 0.5, far_m: 7, map_px: 256,
          hull_size_px: [160, 120]})");
  EXPECT_TRUE(scene.lights_real_objects);
  ASSERT_TRUE(scene.shadows);
  EXPECT_EQ(scene.shadows->target_world_m, Eigen::Vector3d(1, 2, 0));
  EXPECT_NEAR(scene.shadows->fov_rad, M_PI / 2, 1e-12);
  EXPECT_EQ(scene.shadows->near_m, 0.5);
  EXPECT_EQ(scene.shadows->far_m, 7);
  EXPECT_EQ(scene.shadows->map_px, 256);
  EXPECT_EQ(scene.shadows->hull_size_px, (std::array{160, 120}));
}

TEST_F(Lighting, TheLightSeesTheHullAndTheObjectsInOneView) {
  const Scene scene = load("shadows: {target_m: [1, 2, 0], fov_deg: 90}");
  const HullView view = *light_view(scene);
  EXPECT_EQ(view.name, kLightView);
  EXPECT_EQ(view.near_m, 0.1);
  EXPECT_EQ(view.far_m, 10);
  EXPECT_EQ(view.recon.width_px, 320);
  EXPECT_EQ(view.recon.height_px, 240);
  const Eigen::Vector3d target_light_m = *view.fixed * Eigen::Vector3d(1, 2, 0);
  EXPECT_NEAR(target_light_m.head<2>().norm(), 0, 1e-12);
  EXPECT_NEAR(target_light_m.z(), std::sqrt(14), 1e-12);
  EXPECT_NEAR((view.fixed->inverse() * Eigen::Vector3d::Zero() - scene.light_world_m).norm(), 0,
              1e-12);
  // The edges of both images are the same rays.
  const geometry::Pinhole map = shadow_map_pinhole(*scene.shadows);
  EXPECT_EQ(map.width_px, 512);
  EXPECT_EQ(map.height_px, 512);
  for (const auto& [hull_px, map_px] :
       {std::pair{(view.recon.width_px - 0.5 - view.recon.cx_px) / view.recon.fx_px,
                  (map.width_px - 0.5 - map.cx_px) / map.fx_px},
        {(view.recon.height_px - 0.5 - view.recon.cy_px) / view.recon.fy_px,
         (map.height_px - 0.5 - map.cy_px) / map.fy_px}}) {
    EXPECT_NEAR(hull_px, 1, 1e-12);
    EXPECT_NEAR(map_px, 1, 1e-12);
  }
}

TEST_F(Lighting, AVerticalLightHasAView) {
  const Scene scene = load("shadows: {target_m: [0, 0, 0], fov_deg: 90}");
  EXPECT_TRUE(light_view(scene)->fixed->matrix().allFinite());
}

TEST_F(Lighting, BadValuesAreRefusedWithFileLineAndValue) {
  EXPECT_THAT(problems_of([&] { load("shadows: {target_m: [0, 0, 3], fov_deg: 90}"); }),
              ElementsAre("scene.yaml:3:21: target_m is at the light: the light has no direction"));
  EXPECT_THAT(
      problems_of([&] { load("shadows: {target_m: [1e200, 0, 0], fov_deg: 90}"); }),
      ElementsAre(
          "scene.yaml:3:21: target_m is too far from the light: the light has no direction"));
  EXPECT_THAT(
      problems_of([&] {
        load(
            "shadows: {target_m: [0, 0, 0], fov_deg: 90, near_m: 2, far_m: 1, hull_size_px: [8, "
            "9000]}");
      }),
      ElementsAre("scene.yaml:3:63: far_m must be greater than near_m (2), is 1",
                  "scene.yaml:3:80: hull_size_px must be 16 to 4096, is 8",
                  "scene.yaml:3:80: hull_size_px must be 16 to 4096, is 9000"));
  EXPECT_THAT(problems_of([&] { load("shadows: {fov_deg: 180, map_px: 0}"); }),
              ElementsAre("scene.yaml:3:10: target_m is missing in shadows",
                          "scene.yaml:3:20: fov_deg must be from 1 to 150, is 180",
                          "scene.yaml:3:33: map_px must be from 16 to 8192, is 0"));
}

}  // namespace
}  // namespace fivepipe::config
