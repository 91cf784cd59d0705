#include "launch/study/spacing_request.h"

#include <gtest/gtest.h>

#include "common/base/usage_error.h"

namespace fivepipe::study {
namespace {

config::SceneObject part_named(const std::string& name) {
  return {.name = name,
          .shape = config::BoxShape{Eigen::Vector3d::Ones()},
          .spacing = config::Spacing{.at_m = 0.14, .low_m = -0.05, .high_m = 0.4}};
}

template <class Call>
std::string refusal(const Call& call) {
  try {
    call();
  } catch (const base::UsageError& error) {
    return error.what();
  }
  return "";
}

TEST(SpacingRequest, IsASpacingOrAStep) {
  const config::SceneObject part = part_named("a");
  EXPECT_DOUBLE_EQ(requested_spacing_m("18cm", 0.14, part), 0.18);
  EXPECT_DOUBLE_EQ(requested_spacing_m("180 mm", 0.14, part), 0.18);
  EXPECT_DOUBLE_EQ(requested_spacing_m("+5mm", 0.14, part), 0.145);
  EXPECT_DOUBLE_EQ(requested_spacing_m("-1cm", 0.14, part), 0.13);
  EXPECT_DOUBLE_EQ(requested_spacing_m("=-3cm", 0.14, part), -0.03);
  EXPECT_DOUBLE_EQ(requested_spacing_m("=3cm", 0.14, part), 0.03);
}

TEST(SpacingRequest, RefusesOtherTextsAndSpacingsOutsideOfTheRange) {
  const config::SceneObject part = part_named("a");
  for (const char* text : {"", "18", "=", "==3cm", "+-3cm", "+=3cm", "nan m", "cm", "=+-3cm"}) {
    EXPECT_NE(refusal([&] { check_spacing_text(text); }).find("is no spacing"), std::string::npos)
        << text;
    EXPECT_NE(refusal([&] { requested_spacing_m(text, 0.1, part); }), "") << text;
  }
  for (const char* text : {"41cm", "=-6cm", "+27cm", "-20cm", "1e300m"}) {
    EXPECT_EQ(refusal([&] { check_spacing_text(text); }), "") << text;
    EXPECT_NE(refusal([&] {
                requested_spacing_m(text, 0.14, part);
              }).find("is outside of the range of a: -5.0 cm to 40.0 cm"),
              std::string::npos)
        << text;
  }
}

TEST(SpacingRequest, OfTheOnlyPartOrTheNamedOne) {
  config::Scene scene;
  scene.name = "bench";
  scene.file = "scenes/bench.yaml";
  scene.objects = {part_named("a")};
  scene.objects[0].spacing.reset();
  EXPECT_EQ(refusal([&] { movable_part(scene, ""); }),
            "no object of scene bench can be moved: add `spacing` to one in scenes/bench.yaml");
  scene.objects.push_back(part_named("b"));
  EXPECT_EQ(movable_part(scene, "").name, "b");
  EXPECT_EQ(movable_part(scene, "b").name, "b");
  for (const char* name : {"a", "c"})
    EXPECT_EQ(refusal([&] { movable_part(scene, name); }),
              "--part: '" + std::string(name) + "' is no object with `spacing`; there is b");
  scene.objects.push_back(part_named("c"));
  EXPECT_EQ(refusal([&] { movable_part(scene, ""); }),
            "several parts can be moved: select one by --part: b, c");
  EXPECT_EQ(movable_part(scene, "c").name, "c");
}

}  // namespace
}  // namespace fivepipe::study
