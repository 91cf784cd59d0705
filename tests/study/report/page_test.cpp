#include "common/study/report/page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

#include "common/study/report/answers_table.h"
#include "common/study/report/escape.h"
#include "common/study/report/html_sections.h"
#include "common/study/report/page_data.h"
#include "tests/study/report/example_study.h"
#include "tests/study/report/hostile.h"
#include "tests/support/base64.h"
#include "tests/support/not_finite.h"
#include "tests/support/test_folder.h"

namespace fivepipe::study::report {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::size_t count_of(const std::string& text, const std::string& what) {
  std::size_t count = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1))
    ++count;
  return count;
}

std::string error_of(const Study& study) {
  try {
    check(study);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(Escape, HtmlHasNoTagAndNoQuoteOfTheText) {
  EXPECT_EQ(html_text("<a href=\"x\">&'"), "&lt;a href=&quot;x&quot;&gt;&amp;&#39;");
  EXPECT_EQ(html_text("\xFF|a"), "\uFFFD|a");
  EXPECT_EQ(html_text(std::string("a\0b\x1B", 4)), "a\uFFFDb\uFFFD");
  EXPECT_EQ(html_text("14 \u00B5m \U0001F600"), "14 \u00B5m \U0001F600");
}

TEST(Escape, NoStringEndsTheScriptOfTheData) {
  for (const std::string& text : test::hostile_texts()) {
    const std::string json = script_json({{"name", text}});
    EXPECT_EQ(json.find_first_of("<>&"), std::string::npos) << json;
    EXPECT_EQ(nlohmann::json::parse(json)["name"],
              nlohmann::json::parse(nlohmann::json(text).dump(
                  -1, ' ', false, nlohmann::json::error_handler_t::replace)));
  }
}

TEST(Escape, Base64AndHashEqualPublishedValues) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("foob"), "Zm9vYg==");  // RFC 4648, section 10
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  const std::string bytes("\0\xFF\x10", 3);
  EXPECT_EQ(base64(bytes), test::base64(bytes));
  // From the example of the Content Security Policy specification, level 3.
  EXPECT_EQ(csp_hash("alert('Hello, world.');"),
            "'sha256-qznLcsROx4GACP2dm0UCKCzCG+HiZ1guq6ZZDob/Tng='");
}

TEST(AnswersTable, IsThatOfThePaper) {
  const auto columns = answers_columns(test::example_study());
  ASSERT_EQ(columns.size(), 4u);
  EXPECT_EQ(cm_text(*columns[2].answers.necessary_before), "15.0–16.0");
  EXPECT_EQ(cm_text(*columns[1].answers.necessary_before), "14.2");
  const auto found = comparisons(columns);
  EXPECT_NEAR(found[0].mean_m, 0.06025, 1e-9);
  EXPECT_NEAR(found[1].mean_m, 0.027, 1e-9);
  EXPECT_EQ(found[0].wilcoxon->p, 0.125);
  EXPECT_EQ(found[1].sign->p, 0.625);
}

TEST(AnswersTable, DiscardedTrialsDoNotCountAndTheLastFoundSpaceDoes) {
  Study study = test::study_of(1, ParticipantKind::human);
  Participant& participant = study.participants[0];
  participant.trials[0].is_kept = false;
  EXPECT_TRUE(answers_columns(study).empty());
  participant.trials.push_back({2});
  participant.trials[1].answers = {Answer{0.1}, Answer{0.11}, Answer{0.12}, std::nullopt};
  participant.trials.push_back({3});
  participant.trials[2].answers = {Answer{0.3}, std::nullopt, Answer{0.32}, Answer{0.33}};
  const auto columns = answers_columns(study);
  ASSERT_EQ(columns.size(), 1u);
  EXPECT_EQ(columns[0].answers.necessary_before->low_m, 0.1);
  EXPECT_EQ(columns[0].answers.allocated_before->low_m, 0.11);
  EXPECT_EQ(columns[0].answers.found->low_m, 0.32);
  EXPECT_EQ(columns[0].answers.allocated_after->low_m, 0.33);
}

TEST(AnswersTable, ScriptedActorsHaveNoP) {
  for (const std::size_t scripted : {1, 4}) {
    Study study = test::study_of(4, ParticipantKind::human);
    for (std::size_t i = 0; i < scripted; ++i)
      study.participants[i].kind = ParticipantKind::scripted;
    for (const Comparison& comparison : comparisons(answers_columns(study))) {
      EXPECT_FALSE(comparison.wilcoxon || comparison.sign);
      EXPECT_EQ(comparison.differences_m.size(), 4u);
    }
    const std::string html = answers_section(study);
    EXPECT_THAT(html, HasSubstr("No p-value: "));
    EXPECT_THAT(html, Not(HasSubstr("<td>0.125</td>")));
  }
  EXPECT_THAT(answers_section(test::study_of(4, ParticipantKind::human)),
              HasSubstr("<td>0.125</td>"));
}

TEST(AnswersTable, StatesTheLimitOfAnExactTest) {
  EXPECT_THAT(answers_section(test::study_of(4, ParticipantKind::human)),
              HasSubstr("cannot reach p &lt; 0.125"));
  EXPECT_THAT(answers_section(test::study_of(7, ParticipantKind::human)),
              HasSubstr("With the 7 participants here, the limit is p = 0.0156"));
}

TEST(ReportPage, HasAllTrialsWithTheirPicturesAndNoExternalAddress) {
  const Study study = test::example_study();
  const std::string page = report_page(study);
  EXPECT_EQ(count_of(page, "<article"), 5u);
  std::size_t events = 0;
  for (const Participant& participant : study.participants)
    for (const Trial& trial : participant.trials)
      for (const PartResult& result : trial.parts) events += result.events.size();
  EXPECT_EQ(count_of(page, "src=\"data:image/png;base64,"), events);
  EXPECT_THAT(page, HasSubstr("default-src 'none'"));
  for (const char* attribute : {" src=\"http", " href=\"http", "@import", "url(http", " style=\""})
    EXPECT_THAT(page.substr(0, page.find("<script")), Not(HasSubstr(attribute)));
  EXPECT_LT(page.size(), 3u << 20);
}

TEST(ReportPage, OfOneOrManyOrNoTrials) {
  for (const std::size_t participants : {0, 1, 20}) {
    const std::string page = report_page(test::study_of(participants, ParticipantKind::human));
    EXPECT_EQ(count_of(page, "<article"), participants);
    EXPECT_EQ(count_of(page.substr(0, page.find("<script")), "nan"), 0u);
  }
  EXPECT_THAT(report_page(test::study_of(0, ParticipantKind::human)),
              HasSubstr("The study has no trials."));
}

TEST(ReportPage, HostileTextsAddNoElement) {
  const auto elements = [](const std::string& page) {
    return std::vector{count_of(page, "<script"), count_of(page, "</script"),
                       count_of(page, "<img"), count_of(page, "<bdi>"), count_of(page, "<b>")};
  };
  Study harmless = test::study_of(1, ParticipantKind::human), hostile = harmless;
  const auto fill = [](Study& study, const std::string& text) {
    study.name = study.date = study.version = study.machine = study.rig = study.scene =
        study.spacing_of = text;
    study.remarks = {text};
    study.scenes = {{{text, geometry::box_mesh({0.1, 0.1, 0.1})}}};
    Participant& participant = study.participants[0];
    participant.pseudonym = text;
    Trial& trial = participant.trials[0];
    trial.scene = 0;
    trial.tool = trial.discarded_because = trial.answers.found->remark = text;
    trial.notes = {{1, text}};
    trial.layout_changes = {{0, text, 0.1}};
    trial.parts = {{text,
                    1,
                    {{0, 1, std::nullopt, test::example_png(8, 8, 0), text}},
                    Clearance{{0}, {{0.01, 0.02}}, 0.1, {{text, 1}}}}};
    trial.what_if = {{text, {0, 1}, {{LayoutResult{}}, {{0.5, 1}}}}};
    trial.swept = {{text, geometry::box_mesh({0.1, 0.1, 0.1})}};
  };
  fill(harmless, "x");
  const auto expected = elements(report_page(harmless));
  for (const std::string& text : test::hostile_texts()) {
    fill(hostile, text);
    EXPECT_EQ(elements(report_page(hostile)), expected) << text;
  }
}

TEST(ReportPage, LengthsAreRoundedSoThatTheStatementStaysTrue) {
  EXPECT_EQ(cm_at_most(0.146001), "14.61");
  EXPECT_EQ(cm_at_most(0.1460), "14.60");
  EXPECT_EQ(cm_at_least(0.149999), "14.99");
  EXPECT_EQ(bracket_text({0.00123, 0.00187}), "0.12–0.19 cm");
  EXPECT_EQ(bracket_text({0.1, test::kInfinity}), "at least 10.00 cm");
  EXPECT_EQ(bracket_text({0, test::kInfinity}), "unknown");
  EXPECT_EQ(bracket_text({test::kInfinity, test::kInfinity}), "the whole range");
  EXPECT_EQ(bracket_text({0, 0}), "0");
}

// A trial shows the scene that was recorded, and none if no recording can be used.
TEST(ReportPage, ShowsTheSceneOfEachTrial) {
  Study study = test::study_of(3, ParticipantKind::human);
  study.scenes = {{{"first part", geometry::box_mesh({0.1, 0.1, 0.1})}},
                  {{"second part", geometry::box_mesh({0.1, 0.1, 0.1})}}};
  study.participants[0].trials[0].scene = 1;
  study.participants[1].trials[0].scene = 0;
  const nlohmann::ordered_json data = page_data(study);
  ASSERT_EQ(data["scenes"].size(), 2u);
  EXPECT_EQ(data["scenes"][1][0]["name"], "second part");
  EXPECT_EQ(data["trials"][0]["scene"], 1);
  EXPECT_EQ(data["trials"][1]["scene"], 0);
  EXPECT_EQ(data["trials"][2]["scene"], nullptr);
  const std::string page = report_page(study);
  EXPECT_EQ(count_of(page, "<figure class=\"view3d\""), 2u);
  EXPECT_EQ(count_of(page, "so its parts are not known"), 1u);
}

TEST(ReportPage, StatesTheDepthOfEachEventAndTheLargestOne) {
  Study study = test::study_of(1, ParticipantKind::human);
  study.participants[0].trials[0].parts = {
      {"part", 2, {{0, 1, Bracket{0.01, 0.0125}}, {2, 3, Bracket{0.002, 0.02}}, {4, 5}}}};
  const std::string page = report_page(study);
  EXPECT_THAT(page, HasSubstr("0.00 to 1.00 s, depth 1.00–1.25 cm"));
  EXPECT_THAT(page, HasSubstr("<td>1.00–2.00 cm</td>"));
  EXPECT_THAT(page, HasSubstr("4.00 to 5.00 s</figcaption>"));
}

// Seconds in which a part may have collided are no collision, and not silent.
TEST(ReportPage, StatesTheUndecidedSecondsOfEachPart) {
  Study study = test::study_of(1, ParticipantKind::human);
  study.participants[0].trials[0].parts = {
      {.part = "both", .collision_s = 1.2, .events = {{0, 1.2}}, .undecided_s = 0.067},
      {.part = "near", .events = {}, .undecided_s = 0.5},
      {.part = "far", .events = {}}};
  const Participant& participant = study.participants[0];
  const std::string page = trial_section(participant, participant.trials[0], 0);
  EXPECT_THAT(page, HasSubstr("<bdi>both</bdi></th><td>1.20 and 0.07 undecided</td>"));
  EXPECT_THAT(page, HasSubstr("<bdi>near</bdi></th><td>0.00 and 0.50 undecided</td>"));
  EXPECT_THAT(page, HasSubstr("<bdi>far</bdi></th><td>0.00</td>"));
}

TEST(ReportPage, ListsEachBadValue) {
  Study study = test::example_study();
  EXPECT_EQ(error_of(study), "");
  Trial& trial = study.participants[0].trials[0];
  trial.duration_s = test::kNaN;
  trial.answers.found->low_m = test::kInfinity;
  trial.parts[0].clearance->distances[3].max_m = test::kNaN;
  trial.parts[1].events[0].picture_png = "GIF89a";
  trial.swept[0].mesh.triangles[5][1] = 1 << 30;
  study.scenes[0][1].axis->direction *= 2;
  study.scenes[0][0].mesh.vertices_m[2].y() = test::kNaN;
  study.participants[3].pseudonym = "P1";
  study.participants[3].trials[0].scene = 1;
  const std::string error = error_of(study);
  for (const char* text :
       {"trial 1, duration: nan", "an answer: inf", "part PMT, clearance: no bracket",
        "a picture is no PNG", "has vertex 1073741824", "no unit vector", "is not finite",
        "participant P1: two participants", "the study does not have its scene"})
    EXPECT_THAT(error, HasSubstr(text));
  EXPECT_THROW(report_page(study), std::invalid_argument);
}

TEST(ReportPage, RefusesListsThatDoNotAscend) {
  const auto refused = [](const std::function<void(Trial&)>& change) {
    Study study = test::example_study();
    change(study.participants[0].trials[0]);
    return error_of(study);
  };
  EXPECT_THAT(refused([](Trial& t) { std::swap(t.layout_changes[0], t.layout_changes[1]); }),
              HasSubstr("the layout changes do not ascend"));
  EXPECT_THAT(refused([](Trial& t) { t.parts[0].clearance->times_s[4] = 0.1; }),
              HasSubstr("times do not ascend"));
  EXPECT_THAT(refused([](Trial& t) { t.parts[0].clearance->times_s.pop_back(); }),
              HasSubstr("times and"));
  EXPECT_THAT(refused([](Trial& t) { t.what_if[0].result.layouts[3].spacing_m = 0; }),
              HasSubstr("spacings do not ascend"));
  EXPECT_THAT(refused([](Trial& t) { t.parts[1].events[0].end_s = 0; }),
              HasSubstr("ends before it starts"));
}

std::string unpacked(const nlohmann::ordered_json& mesh) {
  const std::string text = mesh["packed"];
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  for (std::size_t i = 0; i + 3 < text.size(); i += 4) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 4; ++k)
      group = group << 6 | std::uint32_t(text[i + k] == '=' ? 0 : digits.find(text[i + k]));
    for (int k = 2; k >= 0; --k) bytes += char(group >> (8 * k));
  }
  std::string out(6 * std::size_t(mesh["vertices"]) + 12 * std::size_t(mesh["triangles"]), '\0');
  uLongf size = out.size();
  EXPECT_EQ(uncompress(reinterpret_cast<Bytef*>(out.data()), &size,
                       reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()),
            Z_OK);
  EXPECT_EQ(size, out.size());
  return out;
}

TEST(PageData, PackedMeshIsTheMeshWithinHalfAStep) {
  geometry::Mesh mesh = geometry::sphere_mesh(0.3, 4);
  for (auto& p_m : mesh.vertices_m) p_m = p_m.cwiseProduct(Eigen::Vector3d(1, 2, 0)).eval();
  const auto json = packed_mesh(mesh);
  const std::string bytes = unpacked(json);
  const auto at = [&](std::size_t i, int size) {
    std::uint32_t value = 0;
    for (int k = 0; k < size; ++k) value |= std::uint32_t(std::uint8_t(bytes[i + k])) << (8 * k);
    return value;
  };
  const std::size_t n = mesh.vertices_m.size();
  for (int axis = 0; axis < 3; ++axis) {
    std::uint16_t steps = 0;
    const double step_m = json["step_m"][axis], low_m = json["low_m"][axis];
    for (std::size_t i = 0; i < n; ++i) {
      steps = std::uint16_t(steps + at(2 * (axis * n + i), 2));
      ASSERT_NEAR(low_m + steps * step_m, mesh.vertices_m[i][axis], 0.5 * step_m + 1e-12);
    }
  }
  std::uint32_t index = 0;
  for (std::size_t i = 0; i < 3 * mesh.triangles.size(); ++i) {
    index += at(6 * n + 4 * i, 4);
    ASSERT_EQ(index, mesh.triangles[i / 3][i % 3]);
  }
  EXPECT_LT(json["packed"].get<std::string>().size(), 8 * mesh.triangles.size());
}

TEST(PageData, AnEmptyMeshHasNoBytes) { EXPECT_EQ(unpacked(packed_mesh({})), ""); }

TEST(PageData, FreeIntervalsAreRoundedInwards) {
  Study study = test::study_of(1, ParticipantKind::human);
  study.participants[0].trials[0].what_if = {{"A", {0.1, 0.3}, {{}, {{0.1234567, 0.2345678}}}}};
  const auto curve = page_data(study)["trials"][0]["what_if"][0];
  EXPECT_EQ(curve["free_cm"][0][0], 12.346);
  EXPECT_EQ(curve["free_cm"][0][1], 23.456);
}

// The chart has a ring for these.
TEST(PageData, MarksTheLayoutsWithUndecidedFrames) {
  Study study = test::study_of(1, ParticipantKind::human);
  WhatIfCurve curve{"A", {0.1, 0.3}, {}};
  curve.result.layouts = {{.spacing_m = 0.1, .colliding_frames = 3, .collision_s = 0.1},
                          {.spacing_m = 0.2, .undecided_frames = 1},
                          {.spacing_m = 0.3}};
  study.participants[0].trials[0].what_if = {curve};
  EXPECT_EQ(page_data(study)["trials"][0]["what_if"][0]["undecided"],
            nlohmann::ordered_json({false, true, false}));
}

TEST(WriteReport, WritesThePageAndTheCsvFiles) {
  const test::TestFolder folder;
  const Study study = test::study_of(2, ParticipantKind::human);
  write_report(study, folder.path / "new/report");
  const std::ifstream file(folder.path / "new/report/report.html", std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  EXPECT_EQ(text.str(), report_page(study));
  for (const char* name : {"trials.csv", "events.csv", "clearance.csv", "what-if.csv"})
    EXPECT_TRUE(std::filesystem::exists(folder.path / "new/report" / name)) << name;
}

}  // namespace
}  // namespace fivepipe::study::report
