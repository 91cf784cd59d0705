#include "launch/study/recorded/recorded_spacings.h"

#include <gtest/gtest.h>

#include "common/base/usage_error.h"
#include "common/pipeline/bus/topics.h"
#include "launch/study/what_if/what_if.h"
#include "tests/support/recording/kept_recording.h"
#include "tests/support/recording/synthetic_recordings.h"
#include "tests/support/test_folder.h"

namespace fivepipe::study {
namespace {

using test::kStart_ns;
using Topic = bus::topics::ObjectSpacing;

// Names have one letter.
std::vector<std::byte> spacing(char name, std::int64_t stamp_ns, double spacing_m) {
  std::vector<std::byte> cdr = test::cdr_header();
  test::append_value(cdr, std::uint32_t(2));
  test::append_value(cdr, name);
  for (int i = 0; i < 3; ++i) test::append_value(cdr, '\0');  // end, padding
  test::append_value(cdr, std::uint64_t(0));
  test::append_value(cdr, stamp_ns);
  test::append_value(cdr, spacing_m);
  test::append_value(cdr, std::uint8_t(1));
  return cdr;
}

TEST(RecordedSpacings, AreThoseOfThePartWithTheirTimes) {
  const test::TestFolder folder;
  const std::filesystem::path file = folder.path / "moved.mcap";
  {
    recording::RecordingWriter writer(file, "tests", {});
    const mcap::Id channel = writer.add_channel(
        Topic::name, Topic::type, schema::fivepipe_schema(Topic::type), {{"writer", "w"}});
    std::int64_t at_ns = kStart_ns;
    const auto add = [&](const std::vector<std::byte>& cdr) {
      at_ns += 1000;
      writer.add(channel, at_ns, at_ns, cdr);
    };
    add(spacing('a', kStart_ns - 5'000'000'000, 0.14));  // latched, from before the recording
    add(spacing('b', kStart_ns, 0.5));
    add(spacing('a', kStart_ns + 1000 + 2'500'000'000, 0.18));
    add(spacing('a', kStart_ns + 2'600'000'000, std::numeric_limits<double>::quiet_NaN()));
    std::vector<std::byte> cut = spacing('a', kStart_ns, 0.3);
    cut.resize(20);
    add(cut);
    add(spacing('a', kStart_ns + 1000 + 3'000'000'000, 0.16));
  }
  const std::vector<RecordedSpacing> found = recorded_spacings(recording::Recording(file), "a");
  ASSERT_EQ(found.size(), 3u);
  EXPECT_EQ(found[0].time_s, 0);
  EXPECT_EQ(found[0].spacing_m, 0.14);
  EXPECT_NEAR(found[1].time_s, 2.5, 1e-9);
  EXPECT_EQ(found[1].spacing_m, 0.18);
  EXPECT_NEAR(found[2].time_s, 3, 1e-9);
  EXPECT_EQ(found[2].spacing_m, 0.16);
  EXPECT_TRUE(recorded_spacings(recording::Recording(file), "c").empty());
  EXPECT_TRUE(recorded_spacings(recording::Recording(test::kKeptRecording), "block").empty());
}

TEST(RecordedSpacings, AreInTheTextThePageAndTheJsonIfThePartWasMoved) {
  WhatIf found;
  found.parts.push_back({.part = {.name = "a", .range = {0, 0.4}}, .recorded = {{0, 0.14}}});
  EXPECT_EQ(text_of(found).find("Recorded with"), std::string::npos);
  found.parts[0].recorded.push_back({2.54, 0.18});
  EXPECT_NE(text_of(found).find("Recorded with a at 14.0 cm, 18.0 cm from 2.5 s on. The results do "
                                "not depend on it.\n"),
            std::string::npos)
      << text_of(found);
  EXPECT_NE(html_of(found).find("Recorded with a at 14.0 cm, 18.0 cm from 2.5 s on."),
            std::string::npos);
  const auto json = json_of(found)["parts"][0]["recorded"];
  ASSERT_EQ(json.size(), 2u);
  EXPECT_EQ(json[1]["time_s"], 2.54);
  EXPECT_EQ(json[1]["spacing_m"], 0.18);
}

// The kept recording's scene has no spacing.
TEST(WhatIfOfTheScene, NeedsARangeWithoutASpacing) {
  WhatIfOptions options;
  options.recording = test::kKeptRecording;
  options.parts = {
      {.name = "block", .axis_of_scene = true, .at_of_scene = true, .range_of_scene = true}};
  options.layouts = 1;
  try {
    what_if(options, [](double) {});
    FAIL() << "no UsageError";
  } catch (const base::UsageError& error) {
    EXPECT_STREQ(error.what(), "--range is required: the part block has no `spacing` in the scene");
  }
  options.parts[0].range_of_scene = false;
  options.parts[0].range = {0, 0.1};
  const WhatIf found = what_if(options, [](double) {});
  EXPECT_EQ(found.parts[0].part.axis_world, Eigen::Vector3d(1, 0, 0));
  EXPECT_EQ(found.parts[0].part.at_m, 0);
}

}  // namespace
}  // namespace fivepipe::study
