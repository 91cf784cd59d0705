#include "launch/study/what_if/part_words.h"

#include <gtest/gtest.h>

#include "common/base/usage_error.h"

namespace fivepipe::study {
namespace {

std::string error_of(const std::vector<PartWord>& words) {
  try {
    for (const PartWords& part : parts_of_words(words)) part_from(part);
  } catch (const base::UsageError& error) {
    return error.what();
  }
  return "none";
}

TEST(PartWords, BelongToThePartBeforeThem) {
  const std::vector<PartWords> parts = parts_of_words({{"--range", "1cm:2cm"},
                                                       {"--part", "a"},
                                                       {"--axis", "-y"},
                                                       {"--part", "b"},
                                                       {"--at", "3cm"},
                                                       {"--part", "c"}});
  ASSERT_EQ(parts.size(), 3u);
  const WhatIfPart a = part_from(parts[0]), b = part_from(parts[1]), c = part_from(parts[2]);
  EXPECT_EQ(a.name, "a");
  EXPECT_EQ(a.range, (collision::SpacingInterval{0.01, 0.02}));
  EXPECT_EQ(a.axis_world, Eigen::Vector3d(0, -1, 0));
  EXPECT_TRUE(a.at_of_scene && !a.axis_of_scene && !a.range_of_scene);
  EXPECT_EQ(b.at_m, 0.03);
  EXPECT_TRUE(!b.at_of_scene && b.axis_of_scene && b.range_of_scene);
  EXPECT_TRUE(c.at_of_scene && c.axis_of_scene && c.range_of_scene && !c.added);
  EXPECT_TRUE(parts_of_words({}).empty());
}

TEST(PartWords, OfAMeshStateItsUnitAndItsPlace) {
  const WhatIfPart part = part_from({.part = "bracket",
                                     .mesh = "a,b.stl,mm",
                                     .position = "30cm,-5mm,0.5m",
                                     .rotation = "90,0,90"});
  ASSERT_TRUE(part.added);
  EXPECT_EQ(part.added->file, "a,b.stl");
  EXPECT_EQ(part.added->unit_m, 0.001);
  // About x first: y to z, z to -y; then about z: x to y, y to -x.
  EXPECT_TRUE((part.added->world_from_mesh * Eigen::Vector3d(1, 2, 3))
                  .isApprox(Eigen::Vector3d(0.3 + 3, -0.005 + 1, 0.5 + 2)));
  for (const char* mesh : {"b.glb", "b.step", "b.STP"})
    EXPECT_FALSE(part_from({.part = "b", .mesh = mesh}).added->unit_m) << mesh;
  EXPECT_EQ(part_from({.part = "b", .mesh = "b.step,mm"}).added->unit_m, 0.001);
  EXPECT_EQ(part_from({.part = "b", .mesh = "b.obj,in"}).added->unit_m, 0.0254);
}

TEST(PartWords, AreRefusedWithTheirOption) {
  EXPECT_EQ(error_of({{"--part", "a"}, {"--axis", "x"}, {"--axis", "y"}}),
            "--axis: twice for the part a; write the options of a part after its --part");
  EXPECT_EQ(error_of({{"--axis", "x"}, {"--at", "1cm"}}), "--axis: name its part: --part NAME");
  EXPECT_EQ(error_of({{"--part", "a"}, {"--part", "a"}}), "--part: a is there twice");
  EXPECT_EQ(error_of({{"--part", "a"}, {"--axis", "up"}}).rfind("--axis: 'up' is none of", 0), 0u);
  EXPECT_EQ(error_of({{"--part", "a"}, {"--axis", "nan,0,0"}}).rfind("--axis: ", 0), 0u);
  EXPECT_EQ(error_of({{"--part", "a"}, {"--range", "3cm:1cm"}}),
            "--range: 3cm:1cm begins after its end");
  EXPECT_EQ(error_of({{"--part", "a"}, {"--at", "900m"}}), "--at: '900m' is longer than 500 m");
  EXPECT_NE(error_of({{"--part", "a"}, {"--position", "0m,0m,0m"}}).find("--mesh FILE,UNIT"),
            std::string::npos);
  for (const char* mesh : {"b.stl", "b.stl,", "b.stl,km", "b.stl,e3m"})
    EXPECT_NE(error_of({{"--part", "a"}, {"--mesh", mesh}}).find("is not FILE,UNIT"),
              std::string::npos)
        << mesh;
  EXPECT_NE(error_of({{"--part", "A b"}, {"--mesh", "b.stl,m"}}).find("no name of a-z"),
            std::string::npos);
  for (const char* position : {"1cm,2cm", "1cm,2cm,3cm,4cm", "1,2,3", "x"})
    EXPECT_EQ(error_of({{"--part", "a"}, {"--mesh", "b.stl,m"}, {"--position", position}})
                  .rfind("--position: '", 0),
              0u)
        << position;
  for (const char* rotation : {"1,2", "0,0,inf", "up"})
    EXPECT_EQ(error_of({{"--part", "a"}, {"--mesh", "b.stl,m"}, {"--rotation", rotation}})
                  .rfind("--rotation: '", 0),
              0u)
        << rotation;
}

}  // namespace
}  // namespace fivepipe::study
