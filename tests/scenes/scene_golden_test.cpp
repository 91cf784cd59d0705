// Compares a frame of each shipped scene with the image in tests/golden/scenes. The frame is the
// deployment's still_frame, in which the scene shows what it is for.
//   FIVEPIPE_WRITE_GOLDEN=1 tests/run -R LooksLikeItsGoldenImage
// replaces the images; inspect each of them before you commit it.
#include "tests/scenes/golden_scenes.h"
#include "tests/support/checked_gl_context.h"

namespace fivepipe::test {
namespace {

class ShippedScene : public testing::TestWithParam<GoldenScene> {
 protected:
  CheckedGlContext context_;

  static cv::Mat still(const config::Deployment& deployment, std::int64_t first_frame) {
    ScenePlayer player(deployment);
    player.simulate(first_frame, node_config<config::RenderConfig>(deployment).still_frame);
    return player.composite();
  }
};

TEST_P(ShippedScene, LooksLikeItsGoldenImage) {
  const GoldenScene& scene = GetParam();
  expect_golden(still(shipped_deployment(scene.name), scene.first_frame), golden_file(scene),
                scene.tolerance);
}

INSTANTIATE_TEST_SUITE_P(Scenes, ShippedScene, testing::ValuesIn(kGoldenScenes),
                         [](const auto& scene) { return scene.param.name; });

// Changes of a scene that its golden image must refuse.
class ChangedScene : public ShippedScene {
 protected:
  const GoldenScene& scene_ = GetParam();
  config::Deployment deployment_ = shipped_deployment(scene_.name);

  config::SceneObject& object(const std::string& name) {
    for (config::SceneObject& object : deployment_.scene.objects)
      if (object.name == name) return object;
    throw std::invalid_argument("no object " + name);
  }
  void expect_refused() const {
    EXPECT_NE(
        why_not_golden(still(deployment_, scene_.first_frame), golden_of(scene_), scene_.tolerance),
        "");
  }
};

class Demo : public ChangedScene {};

TEST_P(Demo, RefusesAnObjectOfAnotherColour) {
  std::swap(object("side_block").colour_rgb[0], object("side_block").colour_rgb[2]);
  expect_refused();
}

TEST_P(Demo, RefusesAnObjectAtAnotherPlace) {
  object("side_block").world_from_object.translation().x() += 0.01;
  expect_refused();
}

TEST_P(Demo, RefusesAHandAtAnotherTime) {
  deployment_.frame_rate_hz += 0.25;
  expect_refused();
}

class Door : public ChangedScene {};

TEST_P(Door, RefusesASceneWithoutShadows) {
  deployment_.scene.shadows.reset();
  expect_refused();
}

INSTANTIATE_TEST_SUITE_P(Scene, Demo, testing::Values(golden_scene("demo")));
INSTANTIATE_TEST_SUITE_P(Scene, Door, testing::Values(golden_scene("door")));

}  // namespace
}  // namespace fivepipe::test
