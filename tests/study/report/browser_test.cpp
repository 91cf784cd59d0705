// The report in headless Chromium.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <set>

#include "common/study/report/page.h"
#include "tests/study/report/chromium.h"
#include "tests/study/report/example_study.h"
#include "tests/study/report/hostile.h"
#include "tests/support/optional_package.h"
#include "tests/support/test_folder.h"

namespace fivepipe::study::report {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

// The end of a script, an element with a script, and 1,000 characters without a blank. The other
// texts need no browser.
constexpr std::array<std::size_t, 3> kHostileIndices{3, 4, 12};

// What browser.py and checks.js found on each of the pages.
std::vector<json> visits(const std::vector<std::string>& pages) {
  const test::TestFolder folder;
  std::vector<std::filesystem::path> files;
  for (std::size_t i = 0; i < pages.size(); ++i) {
    files.push_back(folder.path / (std::to_string(i) + ".html"));
    std::ofstream(files.back(), std::ios::binary) << pages[i];
  }
  return test::visits(files);
}

// One participant with all measurements, and three with hostile texts.
Study hostile_study() {
  Study study = test::example_study();
  study.participants.resize(1);
  study.scenes.push_back({{"recorded crate", geometry::box_mesh({0.2, 0.2, 0.2})}});
  for (const std::size_t i : kHostileIndices) {
    const std::string& text = test::hostile_texts()[i];
    Participant participant{text, ParticipantKind::human, {Trial{}}};
    participant.trials[0].notes = {{0, text}};
    participant.trials[0].tool = text;
    participant.trials[0].scene = 1;
    participant.trials[0].answers.found = Answer{0.2, std::nullopt, text};
    study.participants.push_back(participant);
  }
  return study;
}

void expect_full_page(const json& found) {
  EXPECT_FALSE(found["attacked"]);
  EXPECT_LE(found["overflow_px"], 0) << "the page is wider than the window";
  EXPECT_EQ(found["table"][1][0], "(Pre) How much space is necessary?");
  EXPECT_EQ(found["table"][3][1], "15.0");
  std::set<std::string> charts;
  for (const json& chart : found["charts"]) {
    charts.insert(chart["chart"]);
    EXPECT_EQ(chart["drawn"], "yes");
    EXPECT_GT(chart["colours"], 8) << chart;
    EXPECT_THAT(chart["label"], ::testing::StartsWith("Chart: "));
  }
  EXPECT_EQ(charts, (std::set<std::string>{"answers", "clearance", "what-if-collision",
                                           "what-if-distance"}));
  ASSERT_GE(found["pictures"].size(), 1u);
  for (const json& picture : found["pictures"]) {
    EXPECT_EQ(picture["width"], 320);
    EXPECT_THAT(picture["alt"], ::testing::StartsWith("Collision of payload A"));
  }
}

void expect_view(const json& view) {
  EXPECT_GT(view["colours"], 50);
  EXPECT_THAT(view["label"], ::testing::HasSubstr("PMT, payload A, payload B"));
  EXPECT_EQ(view["spacing_cm"], 15);
  EXPECT_EQ(view["verdict"], "certified free");
  EXPECT_EQ(view["moved_verdict"], "not certified free");
  EXPECT_GT(view["moved"], 0.005);
  EXPECT_GT(view["turned"], 0.005);
  EXPECT_THAT(view["selected"], ::testing::HasSubstr("Selected: PMT"));
}

TEST(ReportInBrowser, ShowsTableChartsPicturesAndViewWithoutErrorOrRequest) {
  if (test::chromium().empty()) FIVEPIPE_SKIP_WITHOUT_PACKAGE("chromium is not installed");
  const std::string page = report_page(hostile_study());
  std::string tampered = report_page(test::study_of(1, ParticipantKind::human));
  const std::string image = "<img src=\"http://127.0.0.1:9/x.png\">";
  tampered.insert(tampered.find("<main>"), image + "<script>window.attacked = true</script>");
  std::string unprotected = tampered;
  const std::size_t policy = unprotected.find("<meta http-equiv");
  unprotected.erase(policy, unprotected.find('\n', policy) - policy);
  const auto found =
      visits({page, report_page(test::study_of(0, ParticipantKind::human)), tampered, unprotected});
  ASSERT_EQ(found.size(), 4u);
  test::expect_no_request_or_error(found[0]);
  expect_full_page(found[0]["value"]);
  expect_view(found[0]["value"]["views"][0]);
  EXPECT_EQ(found[0]["value"]["views"][1]["label"], "3D view of recorded crate");
  EXPECT_EQ(found[0]["value"]["names"].size(), 4u);
  EXPECT_EQ(found[0]["value"]["names"][1], test::hostile_texts()[3]);
  const json theme = found[0]["value"]["theme"];
  EXPECT_EQ(theme[1][0], "Theme: dark");
  EXPECT_NE(theme[0][1], theme[1][1]);
  test::expect_no_request_or_error(found[1]);
  EXPECT_EQ(found[1]["value"]["views"], json::array());
  // The policy stops what the escapes would let through, and the test sees a request.
  EXPECT_GE(found[2]["errors"].size(), 2u);
  EXPECT_FALSE(found[2]["value"]["attacked"]);
  EXPECT_TRUE(found[3]["value"]["attacked"]);
  EXPECT_THAT(found[3]["requests"].dump(), ::testing::HasSubstr("http://127.0.0.1:9/x.png"));
}

// The pages that Chromium sends to the printer.
struct Printed {
  std::string text;  // lines from left to right, columns apart
  // How often images of a width are on the pages, without their masks.
  std::map<int, std::size_t> images;
  std::vector<cv::Mat> pages;  // with few pixels
};

Printed printed(const std::string& page) {
  const test::TestFolder folder;
  const std::filesystem::path html = folder.path / "page.html";
  const std::string pdf = (folder.path / "page.pdf").string();
  std::ofstream(html, std::ios::binary) << page;
  // The system's theme is dark, and the reader has not scrolled.
  test::browse("--dark --pdf " + pdf, {html});
  Printed found{test::output_of("pdftotext -layout " + pdf + " -"), {}, {}};
  std::istringstream list(test::output_of("pdfimages -list " + pdf));
  for (std::string line; std::getline(list, line);) {
    std::istringstream words(line);
    int page_number = 0, number = 0, width = 0;
    std::string type;
    if (words >> page_number >> number >> type >> width && type == "image") ++found.images[width];
  }
  test::output_of("pdftoppm -r 20 -png " + pdf + " " + (folder.path / "page").string());
  for (const auto& entry : std::filesystem::directory_iterator(folder.path))
    if (entry.path().extension() == ".png")
      found.pages.push_back(cv::imread(entry.path().string(), cv::IMREAD_GRAYSCALE));
  return found;
}

std::size_t count_in(const std::string& text, const std::string& what) {
  std::size_t count = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1))
    ++count;
  return count;
}

TEST(ReportInBrowser, PrintsTableChartsPicturesAndViewsWithoutButtons) {
  if (test::chromium().empty()) FIVEPIPE_SKIP_WITHOUT_PACKAGE("chromium is not installed");
  for (const char* program : {"pdftotext", "pdfimages", "pdftoppm"})
    if (test::program_in_path(program).empty())
      FIVEPIPE_SKIP_WITHOUT_PACKAGE("poppler-utils is not installed");
  const std::string page = report_page(test::example_study());
  const Printed found = printed(page);
  EXPECT_THAT(found.text, ::testing::ContainsRegex(
                              "How much space is necessary\\? +14.0 +14.2 +15.0.{1,3}16.0 +15.0"));
  // The axes of the charts are text, too.
  const std::size_t clearances = count_in(page, "data-chart=\"clearance\""),
                    what_ifs = count_in(page, "data-chart=\"what-if-collision\"");
  EXPECT_GT(clearances, 10u);
  EXPECT_GT(what_ifs, 3u);
  EXPECT_EQ(count_in(found.text, "time, s"), clearances);
  EXPECT_EQ(count_in(found.text, "cap of the measurement"), clearances);
  EXPECT_EQ(count_in(found.text, "undecided"), what_ifs) << "in the chart's key";
  EXPECT_THAT(found.text, HasSubstr("space, cm")) << "the chart of the answers";
  EXPECT_EQ(found.images.at(320), count_in(page, "<img ")) << "pictures of collisions";
  std::size_t views = 0;
  for (const auto& [width, count] : found.images)
    if (width != 320) views += count;
  EXPECT_EQ(views, count_in(page, "<figure class=\"view3d\""));
  for (const char* button : {"Theme", "Print", "Reset", "Front", "Drag to turn", "Skip"})
    EXPECT_THAT(found.text, Not(HasSubstr(button)));
  // Light: each page has a white border and is mostly white.
  ASSERT_GT(found.pages.size(), 5u);
  for (const cv::Mat& image : found.pages) {
    EXPECT_EQ(image.at<std::uint8_t>(2, 2), 255);
    EXPECT_GT(cv::mean(image)[0], 200);
  }
}

void expect_map(const json& map, const std::string& quantity) {
  EXPECT_EQ(map["quantity"], quantity);
  EXPECT_EQ(map["free"], 47);
  EXPECT_EQ(map["colliding"], 69);
  EXPECT_EQ(map["undecided"], 1);
  EXPECT_EQ(map["hatched"], 1);
  EXPECT_EQ(map["rings"], quantity == "clearance" ? 0 : 47) << "free differs by its shape, too";
  EXPECT_EQ(map["darkest"], 1);
  EXPECT_LT(map["lightest"], 0.4);
  EXPECT_GT(map["width_px"], 5);
  EXPECT_EQ(map["readout"],
            "payload A 12.00 cm, payload B 10.00 cm: collision 7.50 s, penetration 12.50–12.58 cm, "
            "clearance 0 (payload A)");
  EXPECT_EQ(map["title"], map["readout"]);
}

TEST(LayoutsInBrowser, ShowMapsBarsAndCurvesWithoutErrorOrRequest) {
  if (test::chromium().empty()) FIVEPIPE_SKIP_WITHOUT_PACKAGE("chromium is not installed");
  LayoutsPage rows = test::example_layouts();
  rows.curves.clear();
  rows.places[0] = test::hostile_texts()[3];
  rows.layouts.pop_back();
  rows.layouts[0].name = test::hostile_texts()[4];
  const auto found = visits({layouts_page(test::example_layouts()), layouts_page(rows)});
  ASSERT_EQ(found.size(), 2u);
  for (const json& visit : found) {
    test::expect_no_request_or_error(visit);
    EXPECT_FALSE(visit["value"]["attacked"]);
    EXPECT_LE(visit["value"]["overflow_px"], 0) << "the page is wider than the window";
    for (const json& chart : visit["value"]["charts"]) {
      EXPECT_EQ(chart["drawn"], "yes");
      if (chart["chart"] != "layout-map") {
        EXPECT_GT(chart["colours"], 4) << chart;
      }
      EXPECT_THAT(chart["label"], ::testing::StartsWith("Chart: "));
    }
  }
  const json& maps = found[0]["value"]["maps"];
  ASSERT_EQ(maps.size(), 3u);
  expect_map(maps[0], "collision");
  expect_map(maps[1], "penetration");
  expect_map(maps[2], "clearance");
  EXPECT_EQ(found[0]["value"]["charts"].size(), 9u) << "maps, bars, and two curves of each part";
  EXPECT_EQ(found[1]["value"]["maps"], json::array()) << "a combination is missing";
  EXPECT_EQ(found[1]["value"]["charts"].size(), 2u);
}

}  // namespace
}  // namespace fivepipe::study::report
