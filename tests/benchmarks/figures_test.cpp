// The measured figures of the documents: every table of them is in a block, and each block holds
// exactly what fivepipe_figures makes of the results in docs/benchmarks, which are of one machine
// and one commit.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <sstream>

#include "benchmarks/figures/blocks.h"
#include "benchmarks/figures/documents.h"
#include "benchmarks/figures/numbers.h"
#include "tests/support/source_text.h"
#include "tests/support/test_folder.h"

namespace fivepipe::figures {
namespace {

namespace fs = std::filesystem;
using test::kRoot, test::text_of;
using ::testing::HasSubstr;

std::vector<fs::path> documents() {
  std::vector<fs::path> files = {kRoot / "README.md", kRoot / "CONTRIBUTING.md"};
  for (const auto& entry : fs::directory_iterator(kRoot / "docs"))
    if (entry.path().extension() == ".md") files.push_back(entry.path());
  return files;
}

// Returns whether a row of a table holds measured figures: a cell that begins with numbers and a
// unit of measurement, a count with a comma, or at least two cells that consist of numbers.
// Settings and their limits are words and ranges ("0 to 64").
bool is_measured(const std::string& row) {
  static const std::string kNumber = R"([-<]?\d[\d.,]*(?:e-?\d+)?)";
  static const std::regex kWithUnit(
      R"(^\**[<~]?\d[\d.,;/+ e-]*(?:ms|us|mm|frames/s|million|triangles/s)\b)"),
      kLargeCount(R"(^\**\d{1,3}(?:,\d{3})+\**$)"),
      kNumbers("^\\**" + kNumber + "(?: ?[%°]| times)?(?:(?: ?[/;+] ?| and )" + kNumber +
               "(?: ?[%°])?)*\\**(?: \\([^)]*\\))?$");
  int numbers = 0;
  std::istringstream cells(row);
  for (std::string cell; std::getline(cells, cell, '|');) {
    const std::size_t begin = cell.find_first_not_of(' ');
    if (begin == std::string::npos) continue;
    cell = cell.substr(begin, cell.find_last_not_of(' ') - begin + 1);
    if (std::regex_search(cell, kWithUnit) || std::regex_match(cell, kLargeCount)) return true;
    numbers += std::regex_match(cell, kNumbers);
  }
  return numbers >= 2;
}

// The rows of all tables, without the heads.
std::vector<std::string> table_rows(const std::string& document) {
  std::vector<std::string> rows;
  std::istringstream lines(document);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("|---") && !rows.empty()) rows.pop_back();  // the head
    if (line.starts_with("| ")) rows.push_back(line);
  }
  return rows;
}

TEST(Figures, DocumentsHoldWhatTheResultFilesGive) {
  const Results results(kRoot / "docs/benchmarks");
  for (const fs::path& file : documents()) {
    const std::string text = text_of(file);
    EXPECT_EQ(with_figures(text, results), text)
        << file << " differs from docs/benchmarks; run build/release/bin/fivepipe_figures "
        << "docs/benchmarks README.md docs/*.md";
  }
}

// docs/gpu.md has the figures of another machine, on which launch/figures does not run.
TEST(Figures, NoTableOfMeasurementsIsOutsideABlock) {
  for (const fs::path& file : documents())
    for (const std::string& row : table_rows(without_blocks(text_of(file))))
      EXPECT_TRUE(file.filename() == "gpu.md" || !is_measured(row))
          << file << ": put this table into a block of figures: " << row;
}

TEST(Figures, RecognisesMeasuredRows) {
  for (const char* row :
       {"| exact, CPU (`cpu`) | 1.0 ms | 1.8 ms | none | none |",
        "| 10x10 samples per triangle, SIMD | 0.24 | 6.1 | 72 | 5 / 38 / 10 |",
        "| **cpu**, points 0.5 mm apart | 2.1 (285,000 points) | 43 (3.1 million) |",
        "| boxes ahead, 8x8 cells for far boxes | 21,300 | |",
        "| binary maps | 4.0; 15 | 2.8; 7.9 | 1.9; 5.9 |",
        "| brute force and the paper's, 10x10 | 5; 2.0 | 38 and 45 |",
        "| error | 7e-14; 4e-13 | 9e-14; 7e-13 |", "| tiles | **76.2** | 38 / 56 / 67 |",
        "| sweep | 103 / 181 / 196 ms |"})
    EXPECT_TRUE(is_measured(row)) << row;
  for (const char* row :
       {"| `cap_m`, `tolerance_m` | 0.05, 0.002 | 0.001 to 10, 1e-5 to 1 |",
        "| `domain` | integer | 0 | 0 to 230 | DDS domain |",
        "| `stream` | 8 | messages of a frame |",
        "| `warmth`: `heating_s` | 0.5, 4 | 0.001 to 3600 |", "| name | text | 3 words |",
        "| `late` | no message within 100 ms | wait |"})
    EXPECT_FALSE(is_measured(row)) << row;
}

TEST(Figures, EveryBlockIsInADocument) {
  std::set<std::string> used;
  for (const fs::path& file : documents())
    with_blocks(text_of(file), [&](const std::string& name) { return used.insert(name), ""; });
  for (const auto& [name, block] : blocks())
    EXPECT_TRUE(used.contains(name)) << "no document has block " << name;
  for (const char* name : {"hull scenes", "collision summary", "pipeline"})
    EXPECT_THAT(text_of(kRoot / "README.md"), HasSubstr("<!-- figures: " + std::string(name)));
}

// A folder with result files.
class ResultFolder {
 public:
  void add(const std::string& name, const json& results, const std::string& commit = "c0ffee") {
    std::ofstream(folder_.path / (name + ".json"))
        << json{{"commit", commit},
                {"machine", {{"cpu", "Xeon"}, {"cores", 2}, {"build_type", "Release"}}},
                {"results", results}};
  }
  Results results() const { return Results(folder_.path); }

 private:
  test::TestFolder folder_;
};

json hull_result(const std::string& name, double median_ms, double error_mm) {
  return {{"name", name},
          {"time_ms", {{"best", 0.1 * median_ms}, {"median", median_ms}}},
          {"error", {{"depth_mean_mm", error_mm}}},
          {"counts",
           {{"cameras", 16},
            {"map_width_px", 1280},
            {"map_height_px", 720},
            {"maps_covered_percent", 15}}}};
}

std::string block_text(const std::string& name, const Results& results) {
  return with_figures("<!-- figures: " + name + " -->\n<!-- end of figures -->\n", results);
}

std::string error_of_call(const std::function<void()>& call) {
  try {
    call();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

TEST(Figures, ResultsOfTwoCommitsOrOfAChangedTreeAreRefused) {
  ResultFolder folder;
  folder.add("hull", json::array());
  folder.add("collision", json::array(), "decade");
  EXPECT_THAT(error_of_call([&] { folder.results(); }), HasSubstr("measured with commit 'c0ffee'"));
  folder.add("hull", json::array(), "decade");
  EXPECT_NO_THROW(folder.results());
  folder.add("hull", json::array(), "decade+");
  folder.add("collision", json::array(), "decade+");
  EXPECT_THAT(error_of_call([&] { folder.results(); }), HasSubstr("decade+"));
}

TEST(Figures, UnknownAndOpenBlocksAreRefused) {
  ResultFolder folder;
  folder.add("hull", json::array());
  const Results results = folder.results();
  EXPECT_THAT(error_of_call([&] { block_text("hulls", results); }),
              HasSubstr("no block of figures 'hulls'"));
  EXPECT_THAT(error_of_call([&] { with_figures("<!-- figures: machine -->\n", results); }),
              HasSubstr("machine is not closed"));
}

TEST(Figures, AnIndentedMarkerIsAnExample) {
  const std::string example = "a\n    <!-- figures: x -->\n    <!-- end of figures -->\nb\n";
  const auto fail = [](const std::string& name) { return ADD_FAILURE() << name, ""; };
  EXPECT_EQ(with_blocks(example, fail), example);
  EXPECT_EQ(without_blocks(example), example);
}

TEST(Figures, AMissingResultIsNamed) {
  ResultFolder folder;
  folder.add("hull", json::array());
  EXPECT_THAT(error_of_call([&] { block_text("pipeline", folder.results()); }),
              HasSubstr("block 'pipeline': no results paper_tiles.json"));
}

TEST(Figures, ABlockWithoutARowIsRefused) {
  ResultFolder folder;
  folder.add("collision", json::array());
  EXPECT_THAT(error_of_call([&] { block_text("normals", folder.results()); }),
              HasSubstr("collision.json has no result normals/"));
  EXPECT_THAT(error_of_call([&] { block_text("proximity", folder.results()); }),
              HasSubstr("collision.json has no result with ms_per_1000"));
}

TEST(Figures, StepsOfSegmentationNameTheirWorstSequence) {
  const auto step = [](const std::string& name, const json& error) {
    return json{{"name", "capture/" + name}, {"error", error}};
  };
  ResultFolder folder;
  const auto block = [&] { return block_text("segmentation steps", folder.results()); };
  const json method = step("fivepipe", json::object());
  folder.add("capture", json::array({method,
                                     step("steps/the defaults", {{"missed_noise", 0.0},
                                                                 {"missed_waving", 0.02},
                                                                 {"false_px_noise", 10},
                                                                 {"false_px_waving", 20}}),
                                     step("steps/max_hole_px: 0", {{"missed_passers_by", 0.5},
                                                                   {"false_px_passers_by", 0}})}));
  EXPECT_THAT(block(), HasSubstr("| the defaults | 1.00 %; 2.00 % (waving) | 15; 20 (waving) |\n"
                                 "| `max_hole_px: 0` | 50.00 %; 50.00 % (passers-by) | 0 |\n"));
  folder.add("capture", json::array({method}));
  EXPECT_THAT(error_of_call(block), HasSubstr("capture.json has no result capture/steps/"));
  folder.add("capture", json::array({step("steps/a: 0", {{"missed_noise", 0}})}));
  EXPECT_THAT(error_of_call(block), HasSubstr("capture/steps/a: 0 has no error false_px_"));
}

// The table of scenes omits none, and marks those where a baseline is faster than cpu.
TEST(Figures, ScenesWithFasterBaselinesAreListedInBold) {
  ResultFolder folder;
  folder.add(
      "hull",
      {hull_result("cpu/hand16/640x480/2", 4.0, 0), hull_result("ibvh/hand16/640x480/2", 2.0, 0),
       hull_result("cpusweepmid160/hand16/640x480/2", 1.5, 1.6),
       hull_result("carve8mm/hand16/640x480/2", 0.5, 2.5),
       hull_result("cpu/hand4/640x480/2", 1.0, 0), hull_result("ibvh/hand4/640x480/2", 1.1, 0),
       hull_result("cpu/hand4/640x480/1", 9.0, 0), hull_result("cpu/ring4/640x480/2", 1.0, 0),
       hull_result("carve8mm/ring4/640x480/2", 0.5, 2.5)});
  EXPECT_THAT(block_text("hull scenes", folder.results()),
              HasSubstr("| hand16 | 16 of 1280x720, 15 % | 4.0 | - | **2.0** | "
                        "**1.5 (plane sweep, 160 planes, 1.6 mm)** |\n"
                        "| hand4 | 16 of 1280x720, 15 % | 1.0 | - | 1.1 | - |\n"
                        "| ring4 | 16 of 1280x720, 15 % | 1.0 | - | - | none |\n"));
}

TEST(Figures, TheTableOfEveryPixelHasEachViewOfBothBackends) {
  const auto result = [](const std::string& name, int wrong, double difference) {
    return json{{"name", name},
                {"error", {{"max_depth_relative", difference}}},
                {"counts", {{"pixels", 19200}, {"hits", 1500}, {"wrong", wrong}}}};
  };
  ResultFolder folder;
  folder.add("hull_every_pixel",
             json::array({result("hand4/160x120/cpu", 0, 6e-8), result("hand4/160x120/gl", 2, 1e-7),
                          result("hand64/160x120/cpu", 0, 0)}));
  const std::string text = block_text("hull every pixel", folder.results());
  EXPECT_THAT(text,
              HasSubstr("| hand4 | 160x120 | 19,200 | 1,500 | 0 and 2 | 6.0e-08 and 1.0e-07 |\n"
                        "| hand64 | 160x120 | 19,200 | 1,500 | 0 and - | 0.0e+00 and - |\n"));
  EXPECT_THAT(text, HasSubstr("wrong in 2 of 57,600 pixels"));
  EXPECT_THAT(text, HasSubstr("1.0e-07 of themselves"));
}

// Without CAP_NET_RAW the benchmark measures no time outside the nodes.
TEST(Figures, AnAccountWithoutOutsideTimesIsRefused) {
  ResultFolder folder;
  const json stage = {{"name", "pipeline/paper/outside/render"},
                      {"counts",
                       {{"frames", 9},
                        {"nodes_mean_ms", 1},
                        {"outside_mean_ms", 1.1},
                        {"limit_ms", 0.3},
                        {"tail_limit_ms", 3},
                        {"difference_p5_ms", -0.1},
                        {"difference_p95_ms", 0.25},
                        {"agrees", true}}}};
  json with_capture = stage;
  with_capture["name"] = "pipeline_with_capture/paper_files/outside/render";
  folder.add("pipeline", json::array({stage}));
  folder.add("pipeline_1", json::array({stage}));
  folder.add("paper_files", json::array({with_capture}));
  const std::string text = block_text("account", folder.results());
  EXPECT_THAT(text, HasSubstr("All stages agree within both limits."));
  EXPECT_THAT(
      text, HasSubstr("| render | 9 | 1.000 | 1.100 | 0.100 | 0.300 | -0.100 / 0.250 | 3.000 |\n"));
  with_capture["counts"]["agrees"] = false;
  folder.add("paper_files", json::array({with_capture}));
  EXPECT_THAT(block_text("account", folder.results()), HasSubstr("NOT all stages agree."));
  folder.add("paper_files", json::array());
  EXPECT_THAT(
      error_of_call([&] { block_text("account", folder.results()); }),
      HasSubstr("paper_files.json has no result pipeline_with_capture/paper_files/outside"));
}

TEST(Figures, TheCostOfSecurityIsPerMessage) {
  ResultFolder folder;
  folder.add("security",
             json::array({{{"name", "security/40000/encrypt"},
                           {"time_ms", {{"median", 0.391}, {"p99", 1.25}}},
                           {"error", {{"lost", 0}}},
                           {"counts", {{"cpu_us_per_message", 487.6}, {"cpu_ms_per_mb", 12.2}}}}}));
  EXPECT_THAT(block_text("security", folder.results()),
              HasSubstr("| 40,000 | encrypt | 0.39 | 1.25 | 0.49 | 0 |\n"));
}

json detection(const std::string& name, int crossing, int missed, int wrong, double own_ms = 1.5,
               double maps_ms = 0.5) {
  return {{"name", name},
          {"time_ms", {{"median", own_ms}}},
          {"maps_ms", {{"median", maps_ms}}},
          {"query_ms", {{"median", own_ms}}},
          {"error", {{"deepest_missed_mm", 3.0}}},
          {"counts",
           {{"triangles", 720},
            {"crossing", crossing},
            {"missed", missed},
            {"false", wrong},
            {"near", 100},
            {"undecided", 0}}}};
}

// The denominators are the triangles that cross the hull by the reference, for all methods.
TEST(Figures, MissesAreOfTheTrianglesThatTrulyCross) {
  ResultFolder folder;
  folder.add("collision", {detection("cpuverdict/curtain720/eps0.5mm/1", 98, 0, 0),
                           detection("fcl/curtain720/2mm/1", 98, 24, 7)});
  const std::string table = block_text("detection errors", folder.results());
  EXPECT_THAT(table, HasSubstr("| curtain720, 98 collide |"));
  EXPECT_THAT(table, HasSubstr("| hull polygonised at 2 mm, FCL | 24 (3.0 mm); 7 |"));
}

// Preparing the maps takes cpu longer than brute force, so a method that is slower without the
// preparation may be faster with it.
TEST(Figures, RatesAndComparisonsIncludeThePreparationOfTheMaps) {
  ResultFolder folder;
  folder.add("collision", {detection("cpuverdict/curtain720/eps0.5mm/1", 98, 0, 0, 0.2, 0.3),
                           detection("cpuverdict/dense/eps0.5mm/1", 98, 0, 0, 0.2, 0.3),
                           detection("cpuverdict/payload/eps0.5mm/1", 98, 0, 0, 4.0, 0.3),
                           detection("brute/curtain720/10x10/1", 98, 5, 0, 0.3, 0.02),
                           detection("brute/dense/10x10/1", 98, 5, 0, 20, 0.02),
                           detection("brute/payload/10x10/1", 98, 5, 0, 8.0, 0.02)});
  const std::string rates =
      std::regex_replace(block_text("detection rates", folder.results()), std::regex("\\s+"), " ");
  EXPECT_THAT(rates, HasSubstr("720 triangles in 0.50 ms, with the preparation of the maps, are "
                               "1.4 million per second"));
  EXPECT_THAT(rates, HasSubstr("takes 1.5 (curtain720) to 100 (dense) times the time of cpu's"));
  EXPECT_THAT(rates, HasSubstr("it takes 0.64 (curtain720) to 40 (dense) times the time, and is "
                               "faster in: curtain720."));
  const std::string times = block_text("detection times", folder.results());
  EXPECT_THAT(times, HasSubstr("| preparation of the maps for **cpu** | 0.30 | 0.30 | 0.30 |"));
  EXPECT_THAT(times, HasSubstr("| the same for brute force | 0.020 | 0.020 | 0.020 |"));
}

}  // namespace
}  // namespace fivepipe::figures
