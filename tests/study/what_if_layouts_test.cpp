// what-if of several parts, of parts that were not in the recording, and of tables of layouts, on
// the kept recording.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "common/base/usage_error.h"
#include "common/recording/replay/recorded_deployment.h"
#include "launch/study/what_if/what_if.h"
#include "tests/support/recording/kept_recording.h"
#include "tests/support/test_folder.h"

namespace fivepipe::study {
namespace {

WhatIfOptions options_of(std::vector<WhatIfPart> parts) {
  WhatIfOptions options;
  options.recording = test::kKeptRecording;
  options.parts = std::move(parts);
  options.layouts = 5;
  return options;
}

WhatIf results_of(const WhatIfOptions& options) {
  return what_if(options, [](double) {});
}

const WhatIfPart kBlock{.name = "block", .range = {-0.4, 0.4}};
const WhatIfPart kPlate{
    .name = "plate", .axis_world = Eigen::Vector3d::UnitZ(), .range = {-0.1, 0.3}};

void expect_same(const LayoutResult& a, const LayoutResult& b) {
  EXPECT_EQ(a.colliding_frames, b.colliding_frames) << a.spacing_m;
  EXPECT_EQ(a.collision_s, b.collision_s);
  EXPECT_EQ(a.penetration, b.penetration);
  EXPECT_EQ(a.clearance, b.clearance);
}

std::string usage_error_of(const WhatIfOptions& options) {
  try {
    results_of(options);
  } catch (const base::UsageError& error) {
    return error.what();
  }
  return "none";
}

TEST(WhatIfParts, HaveTheResultsOfEachAlone) {
  const WhatIf both = results_of(options_of({kBlock, kPlate})),
               block = results_of(options_of({kBlock})), plate = results_of(options_of({kPlate}));
  ASSERT_EQ(both.parts.size(), 2u);
  EXPECT_EQ(both.parts[0].result.free, block.parts[0].result.free);
  EXPECT_EQ(both.parts[1].result.free, plate.parts[0].result.free);
  EXPECT_NE(both.parts[0].result.free, both.parts[1].result.free);
  for (std::size_t i = 0; i < 5; ++i) {
    expect_same(both.parts[0].result.layouts[i], block.parts[0].result.layouts[i]);
    expect_same(both.parts[1].result.layouts[i], plate.parts[0].result.layouts[i]);
  }
  const std::string text = text_of(both);
  for (const char* part : {"Part block, spacing -40.0 cm to 40.0 cm", "Part plate, spacing -10.0",
                           "do not depend on where the others are"})
    EXPECT_NE(text.find(part), std::string::npos) << part << '\n' << text;
  const std::string csv = csv_of(both);
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 11);
  EXPECT_NE(csv.find("\nplate,-0.1,"), std::string::npos) << csv;
  EXPECT_EQ(json_of(both)["parts"].size(), 2u);
}

// The combinations are those of a table with the same layouts.
TEST(WhatIfParts, CombinationsAreLayoutsOfBoth) {
  WhatIfOptions options = options_of({kBlock, kPlate});
  options.with_distances = false;
  EXPECT_TRUE(results_of(options).combinations.empty());
  options.with_combinations = true;
  const WhatIf found = results_of(options);
  ASSERT_EQ(found.combinations.size(), 25u);
  WhatIfOptions by_table = options_of({kBlock, kPlate});
  by_table.with_distances = false;
  by_table.table = LayoutTable{"layouts.csv", {{"block", -1}, {"plate", -1}}, {}};
  for (const RowResult& row : found.combinations)
    by_table.table->rows.push_back({int(by_table.table->rows.size()), row.spacings_m});
  const WhatIf rows = results_of(by_table);
  std::size_t colliding = 0;
  for (std::size_t i = 0; i < 25; ++i) {
    const LayoutResult &a = found.combinations[i].layout, &b = rows.rows[i].layout;
    EXPECT_NEAR(found.combinations[i].spacings_m[0], -0.4 + 0.2 * double(i / 5), 1e-12);
    EXPECT_NEAR(found.combinations[i].spacings_m[1], -0.1 + 0.1 * double(i % 5), 1e-12);
    EXPECT_EQ(a.colliding_frames, b.colliding_frames) << i;
    EXPECT_EQ(a.collision_s, b.collision_s);
    EXPECT_EQ(found.combinations[i].colliding_parts, rows.rows[i].colliding_parts);
    colliding += a.colliding_frames > 0;
  }
  EXPECT_GT(colliding, 0u);
  EXPECT_LT(colliding, 25u);
  const std::string page = html_of(found);
  EXPECT_NE(page.find("of 25 layouts are certified free"), std::string::npos);
  // Of a figure; the style and the script name the chart, too.
  const std::string map = "data-chart=\"layout-map\" data-quantity=";
  EXPECT_NE(page.find(map), std::string::npos);
  EXPECT_NE(html_of(rows).find(map), std::string::npos);
}

// As many spacings of each as 2,500 combinations permit; a part at one place is in all of them.
TEST(WhatIfParts, CombinationsAreLimited) {
  WhatIfOptions options = options_of({kBlock, kPlate});
  options.layouts = 1000;
  options.with_combinations = true;
  options.with_distances = false;
  const std::vector<RowResult> found = results_of(options).combinations;
  ASSERT_EQ(found.size(), 2500u);
  EXPECT_EQ(found.front().spacings_m, (std::vector<double>{-0.4, -0.1}));
  EXPECT_NEAR(found.back().spacings_m[0], 0.4, 1e-12);
  EXPECT_NEAR(found.back().spacings_m[1], 0.3, 1e-12);
  options.parts[1].range = {0.1, 0.1};
  EXPECT_EQ(results_of(options).combinations.size(), 1000u);
  options.parts[0].range = {0, 0};
  EXPECT_EQ(results_of(options).combinations.size(), 1u);
  options.parts.pop_back();
  EXPECT_EQ(results_of(options).combinations.size(), 1u);
  options.parts[0].range = {0, 0.1};
  EXPECT_TRUE(results_of(options).combinations.empty());
}

// The block's own mesh, in millimetres, at its place.
struct BlockFile {
  test::TestFolder folder;
  std::filesystem::path file = folder.path / "bracket.obj";
  Eigen::Isometry3d world_from_block;
  BlockFile() {
    const recording::Recording recording(test::kKeptRecording);
    const replay::RecordedDeployment recorded(recording, {});
    for (const config::SceneObject& object : recorded.deployment().scene.objects) {
      if (object.name != "block") continue;
      world_from_block = object.world_from_object;
      std::ofstream out(file);
      const geometry::Mesh mesh = config::mesh_of(object);
      for (const Eigen::Vector3d& v : mesh.vertices_m)
        out << "v " << 1e3 * v.x() << ' ' << 1e3 * v.y() << ' ' << 1e3 * v.z() << '\n';
      for (const auto& t : mesh.triangles)
        out << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
    }
  }
  WhatIfPart part(double unit_m = 1e-3) const {
    return {.name = "bracket",
            .added = AddedMesh{file, unit_m, world_from_block},
            .axis_of_scene = true,
            .at_of_scene = true,
            .range_of_scene = true};
  }
};

TEST(WhatIfParts, ThatWereNotInTheRecordingAreHitAsThoseThatWere) {
  const BlockFile block;
  const WhatIf added = results_of(options_of({block.part()}));
  WhatIfPart there = kBlock;
  there.range = {0, 0};
  const WhatIf recorded = results_of(options_of({there}));
  ASSERT_EQ(added.parts[0].result.layouts.size(), 1u) << "at its place";
  const LayoutResult &a = added.parts[0].result.layouts[0],
                     &b = recorded.parts[0].result.layouts[0];
  EXPECT_GT(b.colliding_frames, 0u);
  EXPECT_EQ(a.colliding_frames, b.colliding_frames);
  EXPECT_EQ(a.collision_s, b.collision_s);
  EXPECT_NEAR(a.penetration.max_m, b.penetration.max_m, 1e-3);
  EXPECT_GT(b.penetration.max_m, 0);
  const std::string text = text_of(added);
  EXPECT_NE(text.find("Part bracket, which was not in the recording, "), std::string::npos) << text;
  EXPECT_EQ(json_of(added)["parts"][0]["was_in_recording"], false);
  EXPECT_TRUE(added.warnings.empty());

  // Along an axis it has a curve.
  WhatIfPart moved = block.part();
  moved.axis_of_scene = moved.range_of_scene = false;
  moved.range = {-0.4, 0.4};
  const WhatIf curve = results_of(options_of({moved})), of_block = results_of(options_of({kBlock}));
  for (std::size_t i = 0; i < 5; ++i)
    EXPECT_EQ(curve.parts[0].result.layouts[i].colliding_frames,
              of_block.parts[0].result.layouts[i].colliding_frames);
  EXPECT_NE(html_of(curve).find("bracket (only what-if)"), std::string::npos);
  EXPECT_EQ(html_of(of_block).find("block (only what-if)"), std::string::npos);
}

TEST(WhatIfParts, WithAWrongUnitOrFileAreFlagged) {
  const BlockFile block;
  const WhatIf large = results_of(options_of({block.part(1)}));
  ASSERT_EQ(large.warnings.size(), 1u);
  EXPECT_NE(text_of(large).find("warning: object bracket is "), std::string::npos);
  WhatIfOptions options = options_of({block.part()});
  options.parts[0].name = "plate";
  EXPECT_EQ(usage_error_of(options),
            "--mesh: the scene kept already has an object 'plate'; give the new part another name");
  options.parts[0].name = "bracket";
  options.parts[0].added->file = block.folder.path / "none.stl";
  EXPECT_EQ(
      usage_error_of(options).rfind("mesh " + options.parts[0].added->file.string() + ": ", 0), 0u);
}

// A row is a layout of all parts; those that move in one column share a line.
TEST(WhatIfTable, HasTheResultsOfItsParts) {
  WhatIfOptions options = options_of({kBlock});
  options.table = LayoutTable{"layouts.csv",
                              {{"block", -1}, {"plate", 2}},
                              {{2, {-0.4, -0.1}}, {3, {0, 0.3}}, {6, {0, -0.1}}}};
  const WhatIf found = results_of(options);
  ASSERT_EQ(found.rows.size(), 3u);
  EXPECT_TRUE(found.parts.empty());
  const WhatIf block = results_of(options_of({kBlock})), plate = results_of(options_of({kPlate}));
  const auto frames = [](const WhatIf& of, std::size_t layout) {
    return of.parts[0].result.layouts[layout].colliding_frames;
  };
  EXPECT_EQ(found.rows[0].layout.colliding_frames, 0u);
  EXPECT_TRUE(found.rows[0].colliding_parts.empty());
  // Each part alone is in frames of the union.
  const std::size_t joint = found.rows[1].layout.colliding_frames;
  EXPECT_GE(joint, std::max(frames(block, 2), frames(plate, 4)));
  EXPECT_LE(joint, frames(block, 2) + frames(plate, 4));
  EXPECT_EQ(found.rows[2].layout.colliding_frames, frames(block, 2));
  EXPECT_EQ(found.rows[2].colliding_parts, std::vector<std::string>{"block"});
  const std::string text = text_of(found);
  for (const char* part : {"line", "plate.z", "-40.00 cm", "colliding parts", "layouts.\n",
                           "would have moved differently"})
    EXPECT_NE(text.find(part), std::string::npos) << part << '\n' << text;
  const std::string csv = csv_of(found);
  EXPECT_EQ(csv.rfind("line,block_m,plate.z_m,colliding_frames,undecided_frames,collision_s,"
                      "penetration_min_m,penetration_max_m,clearance_min_m,clearance_max_m,"
                      "colliding_parts\n2,-0.4,-0.1,0,0,0,0,0,",
                      0),
            0u)
      << csv;
  const auto json = json_of(found);
  EXPECT_EQ(json["layouts"][1]["line"], 3);
  EXPECT_EQ(json["layouts"][1]["places_m"]["plate.z"], 0.3);
  EXPECT_FALSE(json.contains("parts"));
}

// Along two axes: the line is the axis with more values, and the results are those of the axis
// through the other offset.
TEST(WhatIfTable, MovesAPartAlongSeveralAxes) {
  WhatIfOptions options = options_of({});
  options.with_distances = false;
  options.table = LayoutTable{"layouts.csv", {{"block", 2}, {"block", 0}}, {}};
  for (const double z_m : {0.0, 0.05})
    for (int i = 0; i < 5; ++i) options.table->rows.push_back({0, {z_m, -0.4 + 0.2 * i}});
  WhatIfOptions alone = options_of({kBlock});
  alone.with_distances = false;
  const WhatIf found = results_of(options), block = results_of(alone);
  std::size_t differ = 0;
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(found.rows[i].layout.colliding_frames,
              block.parts[0].result.layouts[i].colliding_frames);
    differ += found.rows[5 + i].layout.colliding_frames != found.rows[i].layout.colliding_frames;
  }
  EXPECT_GT(differ, 0u);
}

// A spacing is counted from that of the scene; an axis from the place in the scene.
TEST(WhatIfTable, PlacesAPartByItsSpacingOrFromItsPlace) {
  WhatIfPart block = kBlock;
  block.at_m = 0.14;
  WhatIfOptions options = options_of({block});
  options.with_distances = false;
  options.table = LayoutTable{"layouts.csv", {{"block", -1}}, {{2, {0.14}}}};
  const WhatIf by_spacing = results_of(options);
  options.table->columns[0].axis = 0;
  options.table->rows[0].cell_m[0] = 0;
  const WhatIf by_axis = results_of(options);
  // Without a column it stays at its place, and counts.
  options.table = LayoutTable{"layouts.csv", {{"plate", 2}}, {{2, {-0.1}}}};
  const WhatIf stays = results_of(options);
  EXPECT_GT(by_spacing.rows[0].layout.colliding_frames, 0u);
  for (const WhatIf* other : {&by_axis, &stays})
    EXPECT_EQ(by_spacing.rows[0].layout.colliding_frames, other->rows[0].layout.colliding_frames);
  EXPECT_EQ(stays.rows[0].colliding_parts, std::vector<std::string>{"block"});
}

TEST(WhatIfTable, NeedsAnAxisForASpacing) {
  WhatIfOptions options = options_of({});
  options.table = LayoutTable{"layouts.csv", {{"block", -1}}, {{2, {0.1}}}};
  EXPECT_EQ(usage_error_of(options),
            "layouts.csv: column block: the part has no `spacing` in the scene; write block.x, .y "
            "or .z, or give its axis: --part block --axis z");
  options.table->columns[0].part = "crate";
  EXPECT_EQ(usage_error_of(options).rfind("the scene kept has no part 'crate'", 0), 0u);
}

// Of 1,000 layouts, 30 are printed; the CSV file has all.
TEST(WhatIfText, ShowsAtMost30LayoutsAndNamesTheFileWithAll) {
  WhatIf found;
  found.parts.push_back({.part = kBlock});
  for (int i = 0; i < 1000; ++i)
    found.parts[0].result.layouts.push_back({.spacing_m = 0.001 * i, .clearance = {0.1, HUGE_VAL}});
  const std::string text = text_of(found, "all.csv");
  EXPECT_NE(text.find("30 of 1000 layouts are shown; all.csv has all."), std::string::npos) << text;
  EXPECT_NE(text_of(found).find("shown; --csv FILE writes all."), std::string::npos);
  EXPECT_LT(std::count(text.begin(), text.end(), '\n'), 45);
  for (const char* end : {"\n 0.00 cm ", "\n99.90 cm "})
    EXPECT_NE(text.find(end), std::string::npos) << "both ends\n" << text;
  const std::string csv = csv_of(found);
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 1001);
  found.parts[0].result.layouts.resize(30);
  EXPECT_EQ(text_of(found).find("are shown"), std::string::npos);

  WhatIf table;
  table.options.table = LayoutTable{"t.csv", {{"block", -1}}, {}};
  for (int i = 0; i < 1000; ++i) {
    table.options.table->rows.push_back({i + 2, {0.001 * i}});
    table.rows.push_back({{.colliding_frames = 1}, {"block"}});
  }
  const std::string rows = text_of(table, "all.csv");
  EXPECT_NE(rows.find("The first 30 of 1000 layouts are shown; all.csv has all."),
            std::string::npos);
  EXPECT_LT(std::count(rows.begin(), rows.end(), '\n'), 45);
  EXPECT_NE(rows.find("Free in all frames: 0 of 1000 layouts."), std::string::npos);
}

}  // namespace
}  // namespace fivepipe::study
