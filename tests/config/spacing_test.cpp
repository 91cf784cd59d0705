// The key `spacing` of objects in scene files.
#include "common/config/scene.h"
#include "tests/support/scene_files.h"

namespace fivepipe::config {
namespace {

using ::testing::ElementsAre;

class SpacingInScene : public test::SceneFiles {
 protected:
  Scene load(const std::string& text) { return test::load_scene(write("scene.yaml", text)); }
  std::vector<std::string> problems(const std::string& spacing, const std::string& more = "") {
    return problems_of([&] {
      load(
          "name: parts\nobjects:\n  - name: part\n    box: {size_m: [1, 1, 1]}\n    position_m: "
          "[0, 0, 0]\n    spacing: " +
          spacing + "\n" + more);
    });
  }
};

TEST_F(SpacingInScene, IsReadWithAUnitAxis) {
  const Scene scene = load(R"(
name: parts
objects:
  - name: part
    box: {size_m: [0.1, 0.1, 0.1]}
    position_m: [1, 2, 3]
    spacing: {axis: [0, 3, 4], at_m: 0.14, range_m: [-0.1, 0.4]}
  - {name: other, box: {size_m: [0.1, 0.1, 0.1]}, position_m: [2, 2, 3]}
)");
  ASSERT_TRUE(scene.objects[0].spacing);
  const Spacing& spacing = *scene.objects[0].spacing;
  EXPECT_TRUE(spacing.axis_world.isApprox(Eigen::Vector3d(0, 0.6, 0.8), 1e-15));
  EXPECT_EQ(spacing.at_m, 0.14);
  EXPECT_EQ(spacing.low_m, -0.1);
  EXPECT_EQ(spacing.high_m, 0.4);
  EXPECT_TRUE(spacing.move_world_m(0.24).isApprox(Eigen::Vector3d(0, 0.06, 0.08), 1e-12));
  EXPECT_EQ(spacing.move_world_m(0.14), Eigen::Vector3d(0, 0, 0));
  for (const double inside : {-0.1, 0.0, 0.4}) EXPECT_TRUE(spacing.permits(inside)) << inside;
  for (const double outside : {-0.1001, 0.4001, double(NAN), HUGE_VAL, -HUGE_VAL})
    EXPECT_FALSE(spacing.permits(outside)) << outside;
  EXPECT_FALSE(scene.objects[1].spacing);
  EXPECT_TRUE(has_spacings(scene));
  EXPECT_FALSE(has_spacings(
      load("name: a\nobjects: [{name: b, box: {size_m: [1, 1, 1]}, position_m: [0, 0, 0]}]\n")));
}

TEST_F(SpacingInScene, NamesWhatIsWrong) {
  EXPECT_THAT(problems("{axis: [0, 0, 0], at_m: 0.1, range_m: [0, 0.4]}"),
              ElementsAre("scene.yaml:6:21: axis must not be zero: it is a direction"));
  EXPECT_THAT(problems("{axis: [1, .nan, 0], at_m: .inf, range_m: [0, .nan]}"),
              ElementsAre("scene.yaml:6:25: axis[1] must be finite, is .nan",
                          "scene.yaml:6:41: at_m must be finite, is .inf",
                          "scene.yaml:6:60: range_m[1] must be finite, is .nan"));
  EXPECT_THAT(problems("{axis: [1, 0, 0], at_m: 0.5, range_m: [0, 0.4]}"),
              ElementsAre("scene.yaml:6:38: at_m must be in range_m [0, 0.4], is 0.5"));
  EXPECT_THAT(problems("{axis: [1, 0, 0], at_m: 0.1, range_m: [0.4, 0]}"),
              ElementsAre("scene.yaml:6:52: range_m must be [FROM, TO] with FROM < TO, is "
                          "[0.4, 0]"));
  EXPECT_THAT(problems("{axis: [1, 0, 0], at_m: 0, range_m: [0, 0]}"),
              ElementsAre("scene.yaml:6:50: range_m must be [FROM, TO] with FROM < TO, is [0, 0]"));
  EXPECT_THAT(problems("{axis: [1, 0, 0], at_m: 0, range_m: [0, 1, 2]}"),
              ElementsAre("scene.yaml:6:50: range_m must be a list of 2, is a list of 3"));
  EXPECT_THAT(problems("{axis: [1, 0, 0], at_m: 0, range_m: [-101, 1]}"),
              ElementsAre("scene.yaml:6:51: range_m[0] must be from -100 to 100, is -101"));
  EXPECT_THAT(problems("{at: 0}"), ElementsAre("scene.yaml:6:14: axis is missing in spacing",
                                               "scene.yaml:6:14: range_m is missing in spacing",
                                               "scene.yaml:6:15: unknown key at: use at_m"));
}

TEST_F(SpacingInScene, IsForFixedObjects) {
  const std::string spacing = "{axis: [1, 0, 0], at_m: 0, range_m: [0, 1]}";
  EXPECT_THAT(problems(spacing, "    motion: dynamic\n"),
              ElementsAre("scene.yaml:6:14: spacing needs motion fixed: the simulation moves the "
                          "other objects itself"));
  EXPECT_TRUE(problems(spacing, "    motion: fixed\n").empty());
}

}  // namespace
}  // namespace fivepipe::config
