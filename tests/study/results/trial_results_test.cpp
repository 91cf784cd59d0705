// What the report shows of a trial, from copies of the kept recording.
#include "launch/study/results/trial_results.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "common/recording/replay/recorded_frames.h"
#include "launch/study/results/scene_parts.h"
#include "launch/study/what_if/what_if.h"
#include "tests/study/results/recording_copy.h"
#include "tests/support/deployments.h"
#include "tests/support/recording/kept_recording.h"
#include "tests/support/test_folder.h"
#include "tests/support/text.h"

namespace fivepipe::study {
namespace {

using report::ParticipantKind;
using test::contains;
namespace fs = std::filesystem;

constexpr const char* kBlockPosition = "position_m: [-0.10, 0.10, 0.25]\n";

// The block with a spacing, which is 12 cm in the recorded scene.
std::string with_spacing(const std::string& name, const std::string& text) {
  return name.ends_with("scene.yaml")
             ? test::replaced(
                   text, kBlockPosition,
                   std::string(kBlockPosition) +
                       "    spacing: {axis: [1, 0, 0], at_m: 0.12, range_m: [0, 0.48]}\n")
             : text;
}
// The rig's volume ends left of the middle of the table, where the hand is.
std::string with_small_volume(const std::string& name, const std::string& text) {
  return name.ends_with("rig.yaml")
             ? test::replaced(text, "max: [0.75, 0.6, 0.9]", "max: [-0.2, 0.6, 0.9]")
             : text;
}
// The block 3 m away.
std::string with_far_block(const std::string& name, const std::string& text) {
  return name.ends_with("scene.yaml")
             ? test::replaced(text, kBlockPosition, "position_m: [2.90, 0.10, 0.25]\n")
             : text;
}

class TrialResults : public testing::Test {
 protected:
  test::TestFolder folder_;
  StudyFolder study_ =
      StudyFolder::create(folder_.path / "study",
                          {"Name", FIVEPIPE_SOURCE_DIR "/launch/deployments/demo.yaml", {}, ""});

  // Adds a trial with copies of the kept recording.
  StoredTrial trial(const std::vector<test::ChangeFile>& copies) {
    StoredTrial trial = study_.add_trial("P1", ParticipantKind::human);
    trial.state = TrialState::kept;
    for (const test::ChangeFile& change : copies) {
      trial.recordings.push_back("recording_" + std::to_string(trial.recordings.size() + 1) +
                                 ".mcap");
      test::copy_recording(test::kKeptRecording, file(trial, trial.recordings.size()), change);
    }
    study_.save(trial);
    return trial;
  }
  fs::path file(const StoredTrial& trial, std::size_t part) {
    return study_.folder_of(trial.number) / ("recording_" + std::to_string(part) + ".mcap");
  }
  report::Trial results(const StoredTrial& trial, const TrialRequest& request = small()) {
    return trial_results(
        study_, trial, request, [](double) {}, shown_);
  }
  static TrialRequest small() {
    TrialRequest request;
    request.layouts = 2;
    request.pictures = request.swept = false;
    return request;
  }
  std::string remarks() const {
    std::string all;
    for (const std::string& remark : shown_.remarks) all += remark + '\n';
    return all;
  }
  report::Study shown_;
};

const report::PartResult& part_of(const report::Trial& trial, const std::string& name) {
  for (const report::PartResult& part : trial.parts)
    if (part.part == name) return part;
  throw std::runtime_error("no results of " + name);
}

TEST_F(TrialResults, EqualWhatIfOfTheRecordedLayout) {
  const report::Trial found = results(trial({with_spacing}));
  WhatIfOptions layout;
  layout.recording = test::kKeptRecording;
  layout.parts = {{.name = "block"}};
  layout.layouts = 1;
  const LayoutResult expected = what_if(layout, [](double) {}).parts.at(0).result.layouts.at(0);
  const report::PartResult& block = part_of(found, "block");
  EXPECT_GT(expected.collision_s, 0);
  EXPECT_NEAR(block.collision_s, expected.collision_s, 1e-9);
  ASSERT_EQ(found.parts.size(), 2u) << "the ball moves by itself";
  EXPECT_EQ(found.parts[0].part, "plate");
  EXPECT_NEAR(found.duration_s, block.clearance->times_s.back(), 0.3);
  ASSERT_EQ(found.what_if.size(), 1u);
  EXPECT_EQ(found.what_if[0].result.layouts.size(), 2u);
  ASSERT_EQ(found.layout_changes.size(), 1u);
  EXPECT_EQ(found.layout_changes[0].spacing_m, 0.12);
  EXPECT_FALSE(block.clearance->errors[1].bound_mm) << "the rig states no calibration error";
  EXPECT_DOUBLE_EQ(*block.clearance->errors[2].bound_mm, 0.5) << "eps";
  EXPECT_GT(*block.clearance->errors[0].bound_mm, 0.5) << "a pixel of the maps";
}

// The event's depth is that of the same frames in what-if, at the recorded spacing.
TEST_F(TrialResults, EventsHaveTheirDepth) {
  const report::Trial found = results(trial({with_spacing}));
  WhatIfOptions layout;
  layout.recording = file(study_.trials()[0], 1);
  layout.parts = {
      {.name = "block", .axis_of_scene = true, .at_of_scene = true, .range_of_scene = true}};
  layout.layouts = 1 + 48 / 4;  // 0, 4, 8, 12 cm ...
  const Bracket expected =
      what_if(layout, [](double) {}).parts.at(0).result.layouts.at(3).penetration;
  Bracket deepest{0, 0};
  for (const report::Event& event : part_of(found, "block").events) {
    ASSERT_TRUE(event.penetration);
    deepest = {std::max(deepest.min_m, event.penetration->min_m),
               std::max(deepest.max_m, event.penetration->max_m)};
  }
  EXPECT_GT(deepest.min_m, 1e-3);
  EXPECT_LE(deepest.min_m, expected.max_m);
  EXPECT_GE(deepest.max_m, expected.min_m);
  EXPECT_LE(deepest.max_m - deepest.min_m, 2e-3);
}

// The block at a spacing where some frames are undecided: one of thousands.
TEST_F(TrialResults, UndecidedSecondsAreReported) {
  trial({with_spacing});
  WhatIfOptions layouts;
  layouts.recording = file(study_.trials()[0], 1);
  layouts.parts = {
      {.name = "block", .range = {0.02, 0.22}, .axis_of_scene = true, .at_of_scene = true}};
  layouts.layouts = 6000;
  layouts.with_distances = false;
  const LineResult line = what_if(layouts, [](double) {}).parts.at(0).result;
  const auto found = std::ranges::find_if(
      line.layouts, [](const LayoutResult& layout) { return layout.undecided_frames > 0; });
  ASSERT_NE(found, line.layouts.end());
  const std::string at_m = fmt::format("{}", found->spacing_m);
  const report::Trial moved = results(trial({[&](const std::string& name, const std::string& text) {
    if (!name.ends_with("scene.yaml")) return text;
    return test::replaced(
        text, kBlockPosition,
        fmt::format("position_m: [{}, 0.10, 0.25]\n    spacing: {{axis: [1, 0, 0], at_m: {}, "
                    "range_m: [0, 0.48]}}\n",
                    -0.22 + found->spacing_m, at_m));
  }}));
  const report::PartResult& block = part_of(moved, "block");
  EXPECT_GT(block.undecided_s, 0);
  EXPECT_NEAR(block.collision_s, found->collision_s, 1e-9);
  // The frames are of different length, but none is longer than this.
  EXPECT_LE(block.undecided_s, double(found->undecided_frames) * replay::kMaxFrame_s);
}

// The study's present scene is another one.
TEST_F(TrialResults, ShowTheRecordedScene) {
  const report::Trial first = results(trial({nullptr})), same = results(trial({nullptr})),
                      other = results(trial({with_spacing}));
  EXPECT_EQ(first.scene, 0u);
  EXPECT_EQ(same.scene, 0u);
  EXPECT_EQ(other.scene, 1u);
  ASSERT_EQ(shown_.scenes.size(), 2u);
  ASSERT_EQ(shown_.scenes[0].size(), 2u);
  const report::Part& block = shown_.scenes[0][1];
  EXPECT_EQ(block.name, "block");
  EXPECT_TRUE(geometry::bounds_m(block.mesh).center().isApprox(Eigen::Vector3d(-0.1, 0.1, 0.25)));
  EXPECT_FALSE(block.axis);
  EXPECT_EQ(shown_.scenes[1][1].axis->mesh_spacing_m, 0.12);
  EXPECT_FALSE(are_equal(shown_.scenes[0], report_parts(study_.deployment().scene)));
}

TEST_F(TrialResults, OfAResumedTrialFollowOneAnother) {
  StoredTrial stored = trial({with_spacing, with_spacing});
  const std::int64_t end_ns = recording::Recording(file(stored, 2)).end_ns();
  stored.notes = {{0, "before"}, {end_ns + 1'000'000'000, "after"}};
  const report::Trial one = results(trial({with_spacing})), two = results(stored);
  EXPECT_NEAR(two.duration_s, 2 * one.duration_s, 1e-9);
  const report::PartResult &first = part_of(one, "block"), &both = part_of(two, "block");
  EXPECT_NEAR(both.collision_s, 2 * first.collision_s, 1e-9);
  ASSERT_EQ(both.events.size(), 2 * first.events.size());
  EXPECT_NEAR(both.events[first.events.size()].start_s, first.events[0].start_s + one.duration_s,
              1e-9);
  EXPECT_EQ(two.layout_changes.size(), 1u) << "the spacing is the same";
  ASSERT_EQ(two.what_if.size(), 1u) << "one curve";
  EXPECT_NEAR(two.what_if[0].result.layouts[0].collision_s,
              2 * one.what_if[0].result.layouts[0].collision_s, 1e-9);
  ASSERT_EQ(two.notes.size(), 2u);
  EXPECT_EQ(two.notes[0].time_s, 0);
  EXPECT_EQ(two.notes[1].time_s, two.duration_s);
}

TEST_F(TrialResults, RemarkThatTheSceneWasChangedBetweenRecordings) {
  const report::Trial found = results(trial({nullptr, with_far_block}));
  EXPECT_TRUE(contains(remarks(), "Trial 1: the scene was changed between its recordings"))
      << remarks();
  ASSERT_EQ(found.scene, 0u);
  EXPECT_LT(geometry::bounds_m(shown_.scenes[0][1].mesh).center().x(), 0);
  // The second recording is computed with its own scene.
  const report::Trial one = results(trial({nullptr}));
  EXPECT_NEAR(part_of(found, "block").collision_s, part_of(one, "block").collision_s, 1e-9);
}

TEST_F(TrialResults, WithoutAUsableRecordingHaveNoScene) {
  const StoredTrial stored = trial({nullptr});
  fs::resize_file(file(stored, 1), 100);
  const report::Trial found = results(stored);
  EXPECT_TRUE(contains(remarks(), "Trial 1: not used: ")) << remarks();
  EXPECT_FALSE(found.scene);
  EXPECT_TRUE(found.parts.empty());
  EXPECT_TRUE(shown_.scenes.empty());
  fs::remove(file(stored, 1));
  EXPECT_FALSE(results(stored).scene) << "the file is missing";
}

TEST_F(TrialResults, HaveTheSweptVolumeAndAReasonForMissingPictures) {
  TrialRequest request = small();
  request.pictures = request.swept = true;
  request.swept_cell_m = 0.02;
  const report::Trial found = results(trial({nullptr}), request);
  ASSERT_EQ(found.swept.size(), 1u);
  EXPECT_GT(found.swept[0].mesh.triangles.size(), 100u);
  EXPECT_TRUE(contains(remarks(), "Trial 1: the swept volume is ")) << remarks();
  EXPECT_TRUE(contains(remarks(), "run_1/composite.mp4 cannot be read")) << remarks();
}

// The second recording's hulls are where the first one's rig has no volume.
TEST_F(TrialResults, SweptVolumeHoldsTheHullsOfEachRecordingsRig) {
  TrialRequest request = small();
  request.swept = true;
  request.swept_cell_m = 0.02;
  const auto swept = [&](const std::vector<test::ChangeFile>& copies) {
    const report::Trial found = results(trial(copies), request);
    return found.swept.empty() ? Eigen::AlignedBox3d() : geometry::bounds_m(found.swept[0].mesh);
  };
  const Eigen::AlignedBox3d whole = swept({nullptr}), part = swept({with_small_volume}),
                            both = swept({with_small_volume, nullptr});
  EXPECT_GT(whole.max().x(), -0.1);
  EXPECT_TRUE(part.isEmpty() || part.max().x() < -0.15);
  EXPECT_TRUE(both.min().isApprox(whole.min()) && both.max().isApprox(whole.max()))
      << both.max().transpose() << " instead of " << whole.max().transpose();
}

}  // namespace
}  // namespace fivepipe::study
