#include "common/study/report/answers_table.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/text_table.h"

namespace fivepipe::study::report {

std::vector<AnswersColumn> answers_columns(const Study& study) {
  std::vector<AnswersColumn> columns;
  for (const Participant& participant : study.participants) {
    AnswersColumn column{participant.pseudonym, participant.kind, {}};
    Answers& answers = column.answers;
    bool has_kept = false;
    for (const Trial& trial : participant.trials) {
      if (!trial.is_kept) continue;
      has_kept = true;
      if (!answers.necessary_before) answers.necessary_before = trial.answers.necessary_before;
      if (!answers.allocated_before) answers.allocated_before = trial.answers.allocated_before;
      if (trial.answers.found) answers.found = trial.answers.found;
      if (trial.answers.allocated_after) answers.allocated_after = trial.answers.allocated_after;
    }
    if (has_kept) columns.push_back(std::move(column));
  }
  return columns;
}

const std::vector<AnswersRow>& answers_rows() {
  static const std::vector<AnswersRow> rows{
      {&Answers::necessary_before, "(Pre) How much space is necessary?"},
      {&Answers::allocated_before, "(Pre) How much space would you allocate?"},
      {&Answers::found, "Actual space required (determined in VE)"},
      {&Answers::allocated_after, "(Post) How much space would you allocate?"}};
  return rows;
}

std::string reason_for_no_p(const std::vector<AnswersColumn>& columns) {
  const auto scripted =
      std::ranges::count(columns, ParticipantKind::scripted, &AnswersColumn::kind);
  if (columns.empty()) return "No p-value: there is no kept trial.";
  if (scripted == 0) return "";
  return fmt::format(
      "No p-value: {} of {} scripted. The answers of a scripted actor are inputs of a program and "
      "no sample of people.",
      scripted, base::counted(columns.size(), "participant") + (scripted == 1 ? " is" : " are"));
}

std::vector<Comparison> comparisons(const std::vector<AnswersColumn>& columns) {
  std::vector<Comparison> found{{"necessary", {}}, {"allocated", {}}};
  for (const AnswersColumn& column : columns) {
    const Answers& a = column.answers;
    if (!a.found) continue;
    if (a.necessary_before)
      found[0].differences_m.push_back(a.found->middle_m() - a.necessary_before->middle_m());
    if (a.allocated_before)
      found[1].differences_m.push_back(a.found->middle_m() - a.allocated_before->middle_m());
  }
  const bool may_test = reason_for_no_p(columns).empty();
  for (Comparison& comparison : found) {
    const std::vector<double>& differences = comparison.differences_m;
    if (differences.empty()) continue;
    for (const double difference : differences)
      comparison.mean_m += difference / double(differences.size());
    if (!may_test || differences.size() > kMaxDifferences) continue;
    comparison.wilcoxon = wilcoxon_test(differences);
    comparison.sign = sign_test(differences);
  }
  return found;
}

std::string cm_text(const Answer& answer) {
  std::string text = fmt::format("{:.1f}", 100 * answer.low_m);
  if (answer.high_m) text += fmt::format("–{:.1f}", 100 * *answer.high_m);
  return text;
}

}  // namespace fivepipe::study::report
