#include "render_node/output/spacing_keys.h"

#include <gtest/gtest.h>

namespace fivepipe::render {
namespace {

using namespace std::chrono_literals;
using Key = KeyPress::Key;

const SpacingKeys::Clock::time_point kPressed = SpacingKeys::Clock::now();

config::Scene two_parts() {
  config::Scene scene;
  for (const char* name : {"a", "fixed", "b"})
    scene.objects.push_back(
        {.name = name,
         .shape = config::BoxShape{Eigen::Vector3d::Ones()},
         .spacing = config::Spacing{.at_m = 0.14, .low_m = 0.13, .high_m = 0.4}});
  scene.objects[1].spacing.reset();
  return scene;
}

double spacing_of(const std::optional<SpacingKeys::Request>& request) {
  return request ? request->spacing_m : -1;
}

TEST(SpacingKeys, MoveTheSelectedPartBySteps) {
  SpacingKeys keys(two_parts());
  EXPECT_EQ(keys.title(), "a");
  EXPECT_FALSE(keys.press({Key::up}, kPressed)) << "its spacing is not known";
  keys.set("a", 0.14, kPressed);
  keys.set("fixed", 0.3, kPressed);
  keys.set("b", 0.2, kPressed);
  EXPECT_EQ(keys.title(), "a: 14.0 cm");
  const auto request = keys.press({Key::up}, kPressed);
  ASSERT_TRUE(request);
  EXPECT_EQ(request->object, "a");
  EXPECT_DOUBLE_EQ(request->spacing_m, 0.145);
  EXPECT_EQ(keys.title(), "a: 14.0 cm") << "the simulation has not moved it yet";
  keys.set("a", 0.145, kPressed + 10ms);
  EXPECT_EQ(keys.title(), "a: 14.5 cm");
  EXPECT_DOUBLE_EQ(spacing_of(keys.press({Key::up, true}, kPressed + 5s)), 0.146);
  keys.set("a", 0.146, kPressed + 5s);
  EXPECT_DOUBLE_EQ(spacing_of(keys.press({Key::down}, kPressed + 10s)), 0.141);

  EXPECT_FALSE(keys.press({Key::next}, kPressed + 11s));
  EXPECT_EQ(keys.title(), "b: 20.0 cm");
  EXPECT_EQ(keys.press({Key::down, true}, kPressed + 11s)->object, "b");
  keys.press({Key::next}, kPressed + 12s);
  EXPECT_EQ(keys.title(), "a: 14.6 cm") << "after the last one";
}

TEST(SpacingKeys, QuickKeysAddUpBeforeTheAnswer) {
  SpacingKeys keys(two_parts());
  keys.set("a", 0.2, kPressed);
  EXPECT_DOUBLE_EQ(spacing_of(keys.press({Key::up}, kPressed)), 0.205);
  EXPECT_DOUBLE_EQ(spacing_of(keys.press({Key::up}, kPressed + 30ms)), 0.21);
  keys.set("a", 0.205, kPressed + 40ms);
  EXPECT_DOUBLE_EQ(spacing_of(keys.press({Key::up}, kPressed + 60ms)), 0.215);
  // Another person moves it meanwhile.
  keys.set("a", 0.3, kPressed + 5s);
  EXPECT_DOUBLE_EQ(spacing_of(keys.press({Key::up}, kPressed + 5s)), 0.305);
}

TEST(SpacingKeys, StopAtTheEndsOfTheRange) {
  SpacingKeys keys(two_parts());
  keys.set("a", 0.133, kPressed);
  EXPECT_EQ(spacing_of(keys.press({Key::down}, kPressed)), 0.13);
  EXPECT_FALSE(keys.press({Key::down}, kPressed + 1ms));
  keys.set("a", 0.4, kPressed + 5s);
  EXPECT_FALSE(keys.press({Key::up}, kPressed + 5s));
}

TEST(SpacingKeys, IgnoreOtherObjectsAndNumbersThatAreNotFinite) {
  SpacingKeys keys(two_parts());
  keys.set("c", 0.2, kPressed);
  keys.set("a", NAN, kPressed);
  EXPECT_EQ(keys.title(), "a");
  EXPECT_FALSE(keys.press({Key::up}, kPressed));
}

}  // namespace
}  // namespace fivepipe::render
