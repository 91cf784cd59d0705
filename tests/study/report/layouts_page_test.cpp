#include "common/study/report/layouts_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "tests/study/report/example_study.h"
#include "tests/study/report/hostile.h"
#include "tests/support/not_finite.h"

namespace fivepipe::study::report {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// In the text of a figure. The style names the same chart.
const std::string kMap = "data-chart=\"layout-map\" data-quantity=";

nlohmann::json data_of(const std::string& page) {
  const std::string begin = "id=\"data\">";
  const std::size_t at = page.find(begin) + begin.size();
  return nlohmann::json::parse(page.substr(at, page.find("</script>", at) - at));
}

PlacedLayout placed(std::vector<double> places_m, double collision_s, std::size_t undecided = 0) {
  PlacedLayout layout{"", std::move(places_m), {}};
  layout.result.collision_s = collision_s;
  layout.result.colliding_frames = collision_s > 0 ? 1 : 0;
  layout.result.undecided_frames = undecided;
  return layout;
}

TEST(LayoutsPage, SortsTheLongestCollisionFirstThenUndecidedThenFree) {
  LayoutsPage page{.recording = "a.mcap", .scene = "s", .version = "1", .limits = "none"};
  page.places = {"A"};
  page.layouts = {placed({0.1}, 0), placed({0.2}, 0, 2), placed({0.3}, 1.5), placed({0.4}, 2.5)};
  page.layouts[2].name = "line 4";
  page.layouts[2].colliding_parts = {"A"};
  page.layouts[2].result.penetration = {0.01, std::numeric_limits<double>::infinity()};
  page.layouts[2].result.clearance = {0.01238, 0.01312};
  const std::string html = layouts_page(page);
  const nlohmann::json joint = data_of(html)["joint"];
  ASSERT_EQ(joint["layouts"].size(), 4u);
  std::vector<double> places_cm;
  std::vector<std::string> verdicts;
  for (const nlohmann::json& layout : joint["layouts"]) {
    places_cm.push_back(layout["places_cm"][0]);
    verdicts.push_back(layout["verdict"]);
  }
  EXPECT_EQ(places_cm, (std::vector<double>{40, 30, 20, 10}));
  EXPECT_EQ(verdicts, (std::vector<std::string>{"colliding", "colliding", "undecided", "free"}));
  EXPECT_EQ(joint["layouts"][1]["name"], "line 4");
  EXPECT_EQ(joint["layouts"][1]["penetration_cm"], nlohmann::json::parse("[1.0, null]"));
  EXPECT_EQ(joint["layouts"][1]["penetration"], "at least 1.00 cm");
  EXPECT_EQ(joint["layouts"][1]["clearance"], "1.23–1.32 cm") << "rounded outwards";
  EXPECT_THAT(
      html,
      HasSubstr("1 of 4 layouts are certified free in all frames, 2 collide, 1 are undecided."));
  EXPECT_THAT(html, HasSubstr("data-chart=\"layout-bars\""));
  EXPECT_THAT(html, Not(HasSubstr(kMap)));
}

TEST(LayoutsPage, HasAMapIfTheLayoutsAreAllCombinationsOfTwoPlaces) {
  const auto has_map = [](const LayoutsPage& page) {
    return layouts_page(page).find(kMap) != std::string::npos;
  };
  LayoutsPage page = test::example_layouts();
  EXPECT_TRUE(has_map(page));
  page.layouts.pop_back();
  EXPECT_FALSE(has_map(page)) << "a combination is missing";
  page.layouts.push_back(page.layouts[0]);
  EXPECT_FALSE(has_map(page)) << "one is twice";
  page.layouts = {placed({0.1, 0.2}, 0), placed({0.1, 0.3}, 1)};
  EXPECT_FALSE(has_map(page)) << "one place has one value";
  page.layouts.push_back(placed({0.2, 0.2}, 0));
  page.layouts.push_back(placed({0.2, 0.3}, 0));
  EXPECT_TRUE(has_map(page));
  for (PlacedLayout& layout : page.layouts) layout.places_m[1] *= 1e-5;
  EXPECT_FALSE(has_map(page)) << "the page rounds two values to one";
  page.places = {"A", "B", "C"};
  for (PlacedLayout& layout : page.layouts) layout.places_m.push_back(0);
  EXPECT_FALSE(has_map(page)) << "three places";
}

TEST(LayoutsPage, WithoutDistancesShowsCollisionsAlone) {
  LayoutsPage page = test::example_layouts();
  page.with_distances = false;
  for (WhatIfCurve& curve : page.curves) curve.with_distances = false;
  const std::string html = layouts_page(page);
  EXPECT_THAT(html, HasSubstr("data-quantity=\"collision\""));
  for (const char* word : {"data-quantity=\"penetration\"", "data-quantity=\"clearance\"",
                           "data-quantity=\"distance\"", "deepest penetration</th>"})
    EXPECT_THAT(html, Not(HasSubstr(word)));
  EXPECT_FALSE(data_of(html)["joint"]["layouts"][0].contains("clearance_cm"));
}

TEST(LayoutsPage, DrawsAtMostSomeLayoutsAndSaysSo) {
  LayoutsPage page{.recording = "a.mcap", .scene = "s", .version = "1", .limits = "none"};
  page.places = {"A"};
  for (int i = 0; i < 12'000; ++i) page.layouts.push_back(placed({1e-3 * i}, 1e-3 * i));
  const std::string html = layouts_page(page);
  const nlohmann::json layouts = data_of(html)["joint"]["layouts"];
  ASSERT_EQ(layouts.size(), kMaxDrawnLayouts);
  EXPECT_EQ(layouts.front()["collision_s"], 11.999);
  EXPECT_EQ(layouts.back()["collision_s"], 0);
  EXPECT_THAT(html, HasSubstr("The charts show 5000 of them."));
  EXPECT_THAT(html, HasSubstr("of 12000 layouts"));
}

TEST(LayoutsPage, EscapesAllTexts) {
  for (const std::string& text : test::hostile_texts()) {
    LayoutsPage page = test::example_layouts();
    page.recording = page.scene = page.version = page.limits = page.places[0] = text;
    page.curves[0].part = page.layouts[0].name = text;
    page.layouts[0].colliding_parts = {text};
    const std::string all = layouts_page(page),
                      html = all.substr(0, all.find("<script type="));  // not the JSON
    EXPECT_GT(html.size(), 10'000u);
    EXPECT_THAT(html, Not(HasSubstr("<script>window"))) << text;
    EXPECT_THAT(html, Not(HasSubstr("<img"))) << text;
    EXPECT_THAT(html, Not(HasSubstr("\" onmouseover"))) << text;
  }
}

TEST(LayoutsPage, RefusesPlacesThatAreMissingOrNotFinite) {
  LayoutsPage page = test::example_layouts();
  page.layouts[3].places_m.pop_back();
  EXPECT_THROW(layouts_page(page), std::invalid_argument);
  page = test::example_layouts();
  page.layouts[3].places_m[1] = test::kNaN;
  EXPECT_THROW(layouts_page(page), std::invalid_argument);
  page = test::example_layouts();
  page.layouts[3].result.collision_s = test::kNaN;
  EXPECT_THROW(layouts_page(page), std::invalid_argument);
}

TEST(LayoutsPage, WithoutLayoutsHasTheCurvesOfTheParts) {
  LayoutsPage page = test::example_layouts();
  page.layouts.clear();
  const std::string html = layouts_page(page);
  EXPECT_THAT(html, Not(HasSubstr("id=\"layouts\"")));
  EXPECT_THAT(html,
              HasSubstr("data-chart=\"what-if-collision\" data-trial=\"0\" data-curve=\"1\""));
  EXPECT_EQ(data_of(html)["trials"][0]["what_if"].size(), 2u);
}

}  // namespace
}  // namespace fivepipe::study::report
