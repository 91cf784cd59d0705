#include "common/study/report/csv.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "common/study/report/escape.h"
#include "tests/study/report/example_study.h"
#include "tests/study/report/hostile.h"
#include "tests/support/not_finite.h"

namespace fivepipe::study::report {
namespace {

using Rows = std::vector<std::vector<std::string>>;

// Reads a CSV file as RFC 4180 defines it. Fails at anything else.
Rows rows_of(const std::string& text) {
  Rows rows{{""}};
  for (std::size_t i = 0; i < text.size(); ++i) {
    std::string& field = rows.back().back();
    if (text[i] == '"') {
      EXPECT_TRUE(field.empty()) << "a quote in the middle of a field";
      for (++i; i < text.size(); ++i) {
        if (text[i] == '"' && i + 1 < text.size() && text[i + 1] == '"')
          ++i;
        else if (text[i] == '"')
          break;
        field += text[i];
      }
    } else if (text[i] == ',') {
      rows.back().emplace_back();
    } else if (text[i] == '\r') {
      EXPECT_EQ(text[++i], '\n');
      rows.push_back({""});
    } else {
      EXPECT_NE(text[i], '\n');
      field += text[i];
    }
  }
  EXPECT_EQ(rows.back(), std::vector<std::string>{""}) << "the last line has no end";
  rows.pop_back();
  for (const auto& row : rows) EXPECT_EQ(row.size(), rows[0].size());
  return rows;
}

std::size_t column(const Rows& rows, const std::string& name) {
  const auto found = std::ranges::find(rows[0], name);
  EXPECT_NE(found, rows[0].end()) << name;
  return std::size_t(found - rows[0].begin());
}

TEST(Csv, TextOfAFieldIsRead) {
  EXPECT_EQ(csv_text("P1"), "\"P1\"");
  EXPECT_EQ(csv_text("say \"x\", y"), "\"say \"\"x\"\", y\"");
  EXPECT_EQ(csv_text(""), "\"\"");
  EXPECT_EQ(csv_text("a=b"), "\"a=b\"");
}

TEST(Csv, NoFieldIsRunAsAFormula) {
  for (const char* text : {"=1+1", "+1", "-1", "@A1", "\t=1", "\r=1", "\n=1", "  =1", "\uFF1D1",
                           "\uFF0B1", "\uFF0D1", "\uFF201"})
    EXPECT_TRUE(csv_text(text).starts_with("\"'")) << csv_text(text);
}

TEST(Csv, NumbersHaveNoNeedlessDigitsAndNoInfinity) {
  EXPECT_EQ(csv_number(15, 4), "15");
  EXPECT_EQ(csv_number(14.25, 4), "14.25");
  EXPECT_EQ(csv_number(-0.00001, 4), "0");
  EXPECT_EQ(csv_number(100, 0), "100");
  EXPECT_EQ(csv_number(test::kNaN, 4), "");
  EXPECT_EQ(csv_number(test::kInfinity, 4), "");
}

TEST(Csv, TrialsHaveTheFourAnswersInCm) {
  const Rows rows = rows_of(trials_csv(test::example_study()));
  ASSERT_EQ(rows.size(), 6u);  // the head and five trials
  const auto& third = rows[4];
  EXPECT_EQ(third[0], "P3");
  EXPECT_EQ(third[column(rows, "necessary_before_cm")], "15");
  EXPECT_EQ(third[column(rows, "necessary_before_to_cm")], "16");
  EXPECT_EQ(third[column(rows, "allocated_before_cm")], "20");
  EXPECT_EQ(third[column(rows, "found_cm")], "22.3");
  EXPECT_EQ(third[column(rows, "allocated_after_cm")], "25");
  EXPECT_EQ(rows[3][column(rows, "allocated_after_remark")], "adjust tool");
  EXPECT_EQ(rows[2][column(rows, "kept")], "no");
  EXPECT_EQ(rows[2][column(rows, "found_cm")], "");
  EXPECT_EQ(rows[2][column(rows, "collision_s payload A")], "");
  EXPECT_GT(std::stod(rows[1][column(rows, "collision_s payload A")]), 0);
}

TEST(Csv, EachEventAndEachClearanceHasARow) {
  const Study study = test::example_study();
  std::size_t events = 0, times = 0, layouts = 0;
  for (const Participant& participant : study.participants)
    for (const Trial& trial : participant.trials) {
      for (const PartResult& result : trial.parts) {
        events += result.events.size();
        times += result.clearance->times_s.size();
      }
      for (const WhatIfCurve& curve : trial.what_if) layouts += curve.result.layouts.size();
    }
  EXPECT_GT(events, 0u);
  const Rows of_events = rows_of(events_csv(study)), of_clearance = rows_of(clearance_csv(study)),
             of_layouts = rows_of(what_if_csv(study));
  EXPECT_EQ(of_events.size(), 1 + events);
  EXPECT_EQ(of_clearance.size(), 1 + times);
  EXPECT_EQ(of_layouts.size(), 1 + layouts);
  EXPECT_EQ(of_events[1][5], "0.4");
  EXPECT_EQ(of_clearance[1][7], "0.24");  // error: 1.3 + 0.6 + 0.5 mm
}

TEST(Csv, ClearanceBeyondTheCapHasNoUpperBound) {
  Study study = test::study_of(1, ParticipantKind::human);
  study.participants[0].trials[0].parts = {
      {"A", 0, {}, Clearance{{0, 0.1}, {{0.1, test::kInfinity}, {0.02, 0.021}}, 0.1, {}}}};
  const Rows rows = rows_of(clearance_csv(study));
  EXPECT_EQ(rows[1], (std::vector<std::string>{"P1", "1", "A", "0", "10", "", "10", "0"}));
  EXPECT_EQ(rows[2][5], "2.1");
}

TEST(Csv, WhatIfStatesWhichLayoutsAreInACertifiedInterval) {
  const Rows rows = rows_of(what_if_csv(test::example_study()));
  std::size_t free = 0, undecided = 0;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    const double spacing_cm = std::stod(rows[i][column(rows, "spacing_cm")]);
    if (rows[i][0] != "P1") continue;
    const bool is_free =
        (spacing_cm >= 11.2 && spacing_cm <= 12.1) || (spacing_cm >= 14.6 && spacing_cm <= 35);
    EXPECT_EQ(rows[i][column(rows, "certified_free")], is_free ? "yes" : "no") << spacing_cm;
    free += is_free;
    undecided += rows[i][column(rows, "undecided_frames")] == "2";
  }
  EXPECT_GT(free, 10u);
  EXPECT_EQ(undecided, 1u) << "at 14.5 cm";
}

TEST(Csv, HostileTextsStayInTheirField) {
  Study study = test::study_of(test::hostile_texts().size(), ParticipantKind::human);
  for (std::size_t i = 0; i < test::hostile_texts().size(); ++i) {
    const std::string& text = test::hostile_texts()[i];
    study.participants[i].pseudonym = text;
    study.participants[i].trials[0].tool = text;
    study.participants[i].trials[0].answers.found->remark = text;
    study.participants[i].trials[0].parts = {{text, 1, {{0, 1}}}};
  }
  EXPECT_EQ(rows_of(events_csv(study)).size(), 1 + study.participants.size());
  const Rows rows = rows_of(trials_csv(study));
  ASSERT_EQ(rows.size(), 1 + study.participants.size());
  for (std::size_t i = 1; i < rows.size(); ++i) {
    EXPECT_EQ(rows[i][column(rows, "found_cm")], csv_number(20 + 0.1 * double(i - 1), 4));
    for (const std::size_t field : {std::size_t(0), std::size_t(5)})
      EXPECT_TRUE(rows[i][field].empty() ||
                  std::string("=+-@\t\r\n").find(rows[i][field][0]) == std::string::npos)
          << rows[i][field];
  }
  EXPECT_EQ(rows[9][0], "two\nlines, \"quoted\"");
}

TEST(Csv, AStudyWithoutTrialsHasOnlyHeads) {
  const Study study = test::study_of(0, ParticipantKind::human);
  for (const std::string& text :
       {trials_csv(study), events_csv(study), clearance_csv(study), what_if_csv(study)})
    EXPECT_EQ(rows_of(text).size(), 1u);
}

}  // namespace
}  // namespace fivepipe::study::report
