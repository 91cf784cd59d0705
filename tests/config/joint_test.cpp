// Hinges and sliders in scene files.
#include <numbers>

#include "common/config/scene.h"
#include "tests/support/scene_files.h"

namespace fivepipe::config {
namespace {

using ::testing::ElementsAre;

class JointInScene : public test::SceneFiles {
 protected:
  Scene load(const std::string& text) { return test::load_scene(write("scene.yaml", text)); }
  std::vector<std::string> problems(const std::string& text) {
    return problems_of([&] { load(text); });
  }
};

TEST_F(JointInScene, ReadsEveryKey) {
  const Scene scene = load(R"(
name: joints
objects:
  - name: door
    box: {size_m: [0.8, 0.04, 2]}
    position_m: [0, 0, 1]
    motion: dynamic
    hinge: {point_m: [-0.4, 0, 0.5], axis: [0, 0, 3], from_deg: -30, to_deg: 90, damping_1_s: 2}
  - name: drawer
    box: {size_m: [0.4, 0.4, 0.1]}
    position_m: [2, 0, 1]
    motion: dynamic
    slider: {axis: [0, -2, 0], to_m: 0.35}
  - name: ball
    sphere: {radius_m: 0.1}
    position_m: [3, 0, 1]
    motion: dynamic
)");
  ASSERT_EQ(scene.objects.size(), 3u);
  ASSERT_TRUE(scene.objects[0].joint && scene.objects[1].joint);
  const Joint &hinge = *scene.objects[0].joint, &slider = *scene.objects[1].joint;
  EXPECT_EQ(hinge.kind, JointKind::hinge);
  EXPECT_EQ(hinge.point_m, Eigen::Vector3d(-0.4, 0, 0.5));
  EXPECT_EQ(hinge.axis, Eigen::Vector3d(0, 0, 1)) << "of unit length";
  EXPECT_NEAR(hinge.lowest, -std::numbers::pi / 6, 1e-12);
  EXPECT_NEAR(hinge.highest, std::numbers::pi / 2, 1e-12);
  EXPECT_EQ(hinge.damping_1_s, 2);
  EXPECT_EQ(slider.kind, JointKind::slider);
  EXPECT_EQ(slider.axis, Eigen::Vector3d(0, -1, 0));
  EXPECT_EQ(slider.lowest, 0);
  EXPECT_EQ(slider.highest, 0.35);
  EXPECT_EQ(slider.damping_1_s, 0.5);
  EXPECT_FALSE(scene.objects[2].joint);
}

TEST_F(JointInScene, ListsEveryProblem) {
  EXPECT_THAT(
      problems(R"(name: joints
objects:
  - name: a
    box: {size_m: [1, 1, 1]}
    position_m: [0, 0, 0]
    motion: dynamic
    hinge: {axis: [0, 0, 0], from_deg: -171, to_deg: 1}
  - name: b
    box: {size_m: [1, 1, 1]}
    position_m: [5, 0, 0]
    motion: dynamic
    slider: {from_m: 1, to_m: -1, point_m: [0, 0, 0]}
  - name: c
    box: {size_m: [1, 1, 1]}
    position_m: [10, 0, 0]
    motion: dynamic
    hinge: {point_m: [0, 0, 0], axis: [0, 0, 1]}
    slider: {axis: [0, 0, 1], to_m: 1}
  - name: d
    box: {size_m: [1, 1, 1]}
    position_m: [15, 0, 0]
    slider: {axis: [0, 0, 1], to_m: 1}
  - name: e
    box: {size_m: [1, 1, 1]}
    position_m: [20, 0, 0]
    motion: dynamic
    reaction: bounce
    slider: {axis: [0, 0, 1], to_m: 1}
)"),
      ElementsAre(
          "scene.yaml:7:12: point_m is missing in hinge",
          "scene.yaml:7:19: axis must not be zero: it is a direction",
          "scene.yaml:7:40: from_deg must be from -170 to 170, is -171",
          "scene.yaml:12:13: axis is missing in slider",
          "scene.yaml:12:22: from_m must be at most 0, where the object starts, is 1",
          "scene.yaml:12:31: to_m must be at least 0, where the object starts, is -1",
          "scene.yaml:12:35: unknown key point_m; known keys: axis, from_m, to_m, damping_1_s",
          "scene.yaml:17:12: the joint cannot move: set from_deg, to_deg or both",
          "scene.yaml:18:13: hinge and slider are both set: an object has one joint",
          "scene.yaml:22:13: slider has no effect without motion dynamic",
          "scene.yaml:27:15: reaction bounce takes an object off its joint: use contact"));
}

// The frame's posts are 2 cm from the door; in the second scene one overlaps it by 5 mm.
TEST_F(JointInScene, ADoorNeedsAClearance) {
  const auto scene = [](const std::string& post_x_m) {
    return R"(name: doors
objects:
  - name: left_post
    box: {size_m: [0.1, 0.1, 2]}
    position_m: [-0.47, 0, 1]
  - name: door
    box: {size_m: [0.8, 0.04, 2]}
    position_m: [0, 0, 1]
    motion: dynamic
    hinge: {point_m: [-0.4, 0, 0], axis: [0, 0, 1], to_deg: 90}
  - name: right_post
    box: {size_m: [0.1, 0.1, 2]}
    position_m: [)" +
           post_x_m + R"(, 0, 1]
  - name: floor
    box: {size_m: [5, 5, 1]}
    position_m: [0, 0, -0.5]
)";
  };
  EXPECT_NO_THROW(load(scene("0.47")));
  EXPECT_NO_THROW(load(scene("0.45"))) << "it only touches";
  EXPECT_THAT(problems(scene("0.445")),
              ElementsAre("scene.yaml:10:12: door overlaps right_post by 0.005 m at the start and "
                          "could not move: leave a clearance between them"));
}

}  // namespace
}  // namespace fivepipe::config
