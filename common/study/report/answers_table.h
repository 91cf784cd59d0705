// The paper's Table 1 for a study, and exact tests of its answers.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "common/study/report/exact_test.h"
#include "common/study/report/study.h"

namespace fivepipe::study::report {

// A column of the table. Only kept trials count: the answers before are those of the first kept
// trial that has them, the other two those of the last one.
struct AnswersColumn {
  std::string pseudonym;
  ParticipantKind kind;
  Answers answers;
};

// A row of the table.
struct AnswersRow {
  std::optional<Answer> Answers::*answer;
  std::string question;
};

std::vector<AnswersColumn> answers_columns(const Study& study);  // participants with a kept trial
const std::vector<AnswersRow>& answers_rows();

// Found in the environment against one of the answers before it, over the columns with both.
struct Comparison {
  std::string with;                   // "necessary, before"
  std::vector<double> differences_m;  // found less the answer before; ranges by their middle
  double mean_m = 0;                  // of the differences; 0 if there is none
  // nullopt unless all columns are of humans and there is a difference.
  std::optional<ExactTest> wilcoxon = std::nullopt, sign = std::nullopt;
};
std::vector<Comparison> comparisons(const std::vector<AnswersColumn>& columns);

// Why no p-value may be printed for these columns, as a sentence; empty if one may.
std::string reason_for_no_p(const std::vector<AnswersColumn>& columns);

// "15.0", or "15.0–16.0" for a range, in cm.
std::string cm_text(const Answer& answer);

}  // namespace fivepipe::study::report
