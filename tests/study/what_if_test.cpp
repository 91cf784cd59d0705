// fivepipe study what-if on the kept recording.
#include "launch/study/what_if/what_if.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/base/usage_error.h"
#include "common/recording/files/recording.h"
#include "common/recording/schema/cdr.h"
#include "tests/support/recording/kept_recording.h"

namespace fivepipe::study {
namespace {

WhatIfOptions block() {
  WhatIfOptions options;
  options.recording = test::kKeptRecording;
  options.parts = {{.name = "block", .range = {-0.4, 0.4}}};
  options.layouts = 5;
  return options;
}

WhatIf run(const WhatIfOptions& options) {
  return what_if(options, [](double) {});
}

// The number of frames in which the recorded simulation saw the object collide.
std::size_t recorded_collisions(const std::string& object) {
  const recording::Recording recording(test::kKeptRecording);
  std::size_t colliding = 0;
  auto cursor = recording.messages();
  while (const auto message = cursor.next()) {
    if (message->channel->topic != "fivepipe/v1/CollisionResult" || message->key_change) continue;
    const auto json =
        schema::decode(recording.idl(*message->channel), message->channel->type, message->cdr);
    colliding += json["object"] == object && json["verdict"] == "colliding";
  }
  return colliding;
}

TEST(WhatIf, OfTheRecordedLayoutEqualsTheRecordedSimulation) {
  WhatIfOptions options = block();
  options.parts[0].range = {0, 0};
  const WhatIf found = run(options);
  EXPECT_EQ(found.frames, 33u);
  ASSERT_EQ(found.parts[0].result.layouts.size(), 1u) << "of one place there is one layout";
  EXPECT_GT(recorded_collisions("block"), 0u);
  EXPECT_EQ(found.parts[0].result.layouts[0].colliding_frames, recorded_collisions("block"));
}

TEST(WhatIf, SpacingIsMeasuredFromThatOfTheRecording) {
  WhatIfOptions moved = block();
  moved.parts[0].at_m = 0.14;
  moved.parts[0].range = {-0.26, 0.54};
  const WhatIf a = run(block()), b = run(moved);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_NEAR(b.parts[0].result.layouts[i].spacing_m,
                a.parts[0].result.layouts[i].spacing_m + 0.14, 1e-12);
    EXPECT_EQ(b.parts[0].result.layouts[i].colliding_frames,
              a.parts[0].result.layouts[i].colliding_frames);
  }
  WhatIfOptions mirrored = block();
  mirrored.parts[0].axis_world = -3 * Eigen::Vector3d::UnitX();
  const WhatIf c = run(mirrored);
  for (std::size_t i = 0; i < 5; ++i)
    EXPECT_EQ(c.parts[0].result.layouts[i].colliding_frames,
              a.parts[0].result.layouts[4 - i].colliding_frames);
}

TEST(WhatIf, TextStatesWhatIsCertified) {
  const WhatIf found = run(block());
  const std::string text = text_of(found);
  for (const char* part :
       {"33 frames", "scene kept", "Part block, spacing -40.0 cm to 40.0 cm", "penetration",
        "Free in all frames, certified at every spacing between the ends:\n  -40.00 to -",
        "The largest spacings of the range are not free", "would have moved differently"})
    EXPECT_NE(text.find(part), std::string::npos) << part << '\n' << text;
  const auto json = json_of(found)["parts"][0];
  EXPECT_EQ(json["layouts"].size(), 5u);
  EXPECT_EQ(json["min_free_spacing_m"], nullptr);
  EXPECT_EQ(json["free_m"][0][0], -0.4);
  EXPECT_EQ(json["layouts"][0]["clearance_m"]["max"], nullptr) << "more than is measured";
  const std::string csv = csv_of(found);
  EXPECT_EQ(std::ranges::count(csv, '\n'), 6);
  EXPECT_EQ(
      csv.rfind("part,spacing_m,colliding_frames,undecided_frames,collision_s,penetration_min_m,"
                "penetration_max_m,clearance_min_m,clearance_max_m\nblock,-0.4,0,0,0,0,0,0.1,\n",
                0),
      0u)
      << csv;
}

TEST(WhatIf, TextRoundsSoThatItStaysTrue) {
  WhatIf found = run(block());
  found.parts[0].result.free = {{-0.4, 0.123451}, {0.234549, 0.4}};
  found.parts[0].result.layouts = {
      {.spacing_m = 0.1,
       .colliding_frames = 1,
       .collision_s = 0.05,
       .clearance = {0, 0},
       .penetration = {0.012349, 0.013451}},
      {.spacing_m = 0.2, .undecided_frames = 2, .clearance = {0.1, HUGE_VAL}},
      {.spacing_m = 0.3,
       .colliding_frames = 1,
       .clearance = {0, 0},
       .penetration = {HUGE_VAL, HUGE_VAL}}};
  const std::string text = text_of(found);
  for (const char* part :
       {"-40.00 to 12.34 cm\n", "23.46 to 40.00 cm\n", "all are free: 23.46 cm\n",
        "1.23 to 1.35 cm", "undecided", "at least 10.00 cm", "whole range"})
    EXPECT_NE(text.find(part), std::string::npos) << part << '\n' << text;
}

TEST(WhatIf, TextNamesWhatLimitsTheResults) {
  WhatIf found = run(block());
  EXPECT_EQ(text_of(found).find("Frames without a hull"), std::string::npos);
  found.empty_frames = 3;
  found.incomplete_frames = 2;
  found.drops = {{"bad_map", 7}};
  found.damage = "unfinished";
  found.parts[0].in_view = collision::SpacingInterval{-0.1, 0.2};
  std::string text = text_of(found);
  for (const char* part :
       {"Frames without a hull: 3 of 33.", "In 2 frames the search reached its limit",
        "Dropped of the recording: bad_map (7).", "unfinished: only what could be read",
        "The whole part is in view of the cameras and in the volume from -10.00 to 20.00 cm."})
    EXPECT_NE(text.find(part), std::string::npos) << part << '\n' << text;
  found.parts[0].in_view = std::nullopt;
  text = text_of(found);
  EXPECT_NE(text.find("Nowhere in the range is the whole part in view"), std::string::npos);
}

TEST(WhatIf, FarFromTheVolumeIsOutOfView) {
  WhatIfOptions options = block();
  options.parts[0].range = {0, 5};
  const WhatIf found = run(options);
  ASSERT_TRUE(found.parts[0].in_view);
  EXPECT_LT(found.parts[0].in_view->high_m, 2);
  options.parts[0].range = {4, 5};
  EXPECT_FALSE(run(options).parts[0].in_view);
}

TEST(WhatIf, WithoutDistancesHasTheSameVerdicts) {
  WhatIfOptions verdicts = block();
  verdicts.with_distances = false;
  const WhatIf found = run(verdicts), all = run(block());
  for (std::size_t i = 0; i < 5; ++i)
    EXPECT_EQ(found.parts[0].result.layouts[i].collision_s,
              all.parts[0].result.layouts[i].collision_s);
  EXPECT_EQ(found.parts[0].result.free, all.parts[0].result.free);
  EXPECT_EQ(text_of(found).find("clearance"), std::string::npos);
  EXPECT_FALSE(json_of(found)["parts"][0]["layouts"][0].contains("clearance_m"));
  EXPECT_EQ(
      csv_of(found).rfind(
          "part,spacing_m,colliding_frames,undecided_frames,collision_s\nblock,-0.4,0,0,0\n", 0),
      0u);
}

TEST(WhatIf, NamesThePartsOfTheScene) {
  WhatIfOptions options = block();
  const auto error_of = [&](const std::string& part) -> std::string {
    options.parts[0].name = part;
    try {
      run(options);
    } catch (const base::UsageError& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_EQ(error_of("crate"),
            "the scene kept has no part 'crate'; it has: plate, block. A new part needs --mesh "
            "FILE,UNIT");
  EXPECT_EQ(error_of("ball"), "ball moves by itself; a part of a layout has motion: fixed");
}

TEST(WhatIf, ReportsItsProgress) {
  double last = 0;
  int calls = 0;
  what_if(block(), [&](double done) {
    EXPECT_GE(done, last);
    last = done;
    ++calls;
  });
  EXPECT_GE(calls, 33) << "one per frame";
  EXPECT_EQ(last, 1);
}

}  // namespace
}  // namespace fivepipe::study
