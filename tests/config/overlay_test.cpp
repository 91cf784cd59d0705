// Overlays in scene files.
#include "common/config/scene.h"
#include "tests/support/scene_files.h"

namespace fivepipe::config {
namespace {

using ::testing::ElementsAre;

class OverlayKeys : public test::SceneFiles {
 protected:
  // `object`: further keys of the scene's object, a ball.
  Scene load(const std::string& overlays, const std::string& object) {
    return test::load_scene(write("scene.yaml", "name: marked\n" + overlays + R"(
objects:
  - {name: table, box: {size_m: [1, 1, 1]}, position_m: [0, 0, 0], reaction: none}
  - {name: ball, sphere: {radius_m: 0.1}, position_m: [0, 0, 1])" +
                                                    object + "}\n"));
  }
  std::vector<std::string> problems(const std::string& overlays, const std::string& object) {
    return problems_of([&] { load(overlays, object); });
  }
};

TEST_F(OverlayKeys, AreOffByDefault) {
  EXPECT_EQ(load("", "").overlays, std::set<Overlay>());
  EXPECT_EQ(load("overlays: []", "").overlays, std::set<Overlay>());
}

TEST_F(OverlayKeys, AreReadInAnyOrder) {
  const Scene scene = load("overlays: [proximity, hull_normals, collision_points, recovery]",
                           ", report: {response: {four_point_normal: true}, proximity: {}}");
  EXPECT_EQ(scene.overlays, (std::set{Overlay::collision_points, Overlay::recovery,
                                      Overlay::hull_normals, Overlay::proximity}));
  EXPECT_EQ(load("overlays: [recovery]", ", report: {response: {}}").overlays,
            std::set{Overlay::recovery});
}

TEST_F(OverlayKeys, ThatNoObjectReportsAreRefusedWithWhatToAdd) {
  const std::string all = R"(overlays:
  - collision_points
  - recovery
  - hull_normals
  - proximity)";
  EXPECT_THAT(
      problems(all, ", reaction: none"),
      ElementsAre("scene.yaml:3:5: overlay collision_points shows nothing, because no object "
                  "reports it: give an object another reaction than none; reaction contact also "
                  "needs a report",
                  "scene.yaml:4:5: overlay recovery shows nothing, because no object reports it: "
                  "add `report: {response: {}}` to an object",
                  "scene.yaml:5:5: overlay hull_normals shows nothing, because no object reports "
                  "it: add `report: {response: {closed_form_normal: true}}` to an object",
                  "scene.yaml:6:5: overlay proximity shows nothing, because no object reports it: "
                  "add `report: {proximity: {}}` to an object"));
  EXPECT_EQ(problems(all, "").size(), 3u);
  EXPECT_EQ(problems(all, ", report: {response: {}}").size(), 2u);
  EXPECT_EQ(problems(all, ", report: {response: {closed_form_normal: true}}").size(), 1u);
  EXPECT_EQ(problems(all, ", report: {proximity: {}}").size(), 2u);
}

// sim_node reports the response of each bounce, and nothing of an object in rigid contact without a
// report.
TEST_F(OverlayKeys, OfMovingObjectsFollowTheirReaction) {
  EXPECT_THAT(problems("overlays: [recovery]", ", motion: dynamic, reaction: bounce"),
              ElementsAre());
  EXPECT_EQ(problems("overlays: [collision_points]", ", motion: dynamic, reaction: contact").size(),
            1u);
  EXPECT_THAT(problems("overlays: [collision_points]",
                       ", motion: dynamic, reaction: contact, report: {contacts: 4}"),
              ElementsAre());
}

TEST_F(OverlayKeys, BadValuesAreRefusedWithFileLineAndValue) {
  EXPECT_THAT(problems("overlays: recovery", ""),
              ElementsAre("scene.yaml:2:11: overlays must be a list, is \"recovery\""));
  EXPECT_THAT(problems("overlays: [collision_points, points, {}, collision_points]", ""),
              ElementsAre("scene.yaml:2:30: overlays[1] must be one of collision_points, recovery, "
                          "hull_normals, proximity; is \"points\"",
                          "scene.yaml:2:38: overlays[2] must be a single value, is a mapping",
                          "scene.yaml:2:42: overlays[3] repeats collision_points: remove it"));
  EXPECT_THAT(problems("overlays:", ""), ElementsAre("scene.yaml:2:1: overlays has no value"));
}

}  // namespace
}  // namespace fivepipe::config
