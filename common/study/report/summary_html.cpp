#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/base/text_table.h"
#include "common/study/report/answers_table.h"
#include "common/study/report/escape.h"
#include "common/study/report/html_sections.h"

namespace fivepipe::study::report {
namespace {

struct Span {
  double low = 0, high = 0, mean = 0;
};

std::optional<Span> span_of(const std::vector<double>& values) {
  if (values.empty()) return std::nullopt;
  const auto [low, high] = std::ranges::minmax(values);
  double sum = 0;
  for (const double value : values) sum += value;
  return Span{low, high, sum / double(values.size())};
}

// "+1.0" or "−6.0", in cm, with a minus sign.
std::string signed_cm(double length_m) {
  const std::string text = fmt::format("{:+.1f}", 100 * length_m);
  return text[0] == '-' ? "−" + text.substr(1) : text;
}

std::string tile(const std::string& value, const std::string& unit, const std::string& label) {
  return fmt::format("<div class=\"tile\"><dt>{}</dt><dd>{}<small>{}</small></dd></div>\n", label,
                     value, unit.empty() ? "" : " " + unit);
}

std::string span_tile(const std::optional<Span>& span, const std::string& label) {
  if (!span) return tile("–", "", label);
  const std::string low = fmt::format("{:.1f}", 100 * span->low),
                    high = fmt::format("{:.1f}", 100 * span->high);
  return tile(low == high ? low : low + "–" + high, "cm", label);
}

std::string tiles(const Study& study) {
  const std::vector<AnswersColumn> columns = answers_columns(study);
  std::vector<double> found_m, free_m;
  for (const AnswersColumn& column : columns)
    if (column.answers.found) found_m.push_back(column.answers.found->middle_m());
  std::size_t kept = 0, trials = 0;
  for (const Participant& participant : study.participants)
    for (const Trial& trial : participant.trials) {
      ++trials;
      kept += trial.is_kept;
      for (const WhatIfCurve& curve : trial.what_if)
        if (const auto least_m = curve.min_free_m(); least_m && trial.is_kept)
          free_m.push_back(*least_m);
    }
  const auto scripted =
      std::ranges::count(study.participants, ParticipantKind::scripted, &Participant::kind);
  std::string text = "<dl class=\"tiles\">\n";
  text += tile(std::to_string(study.participants.size()),
               scripted > 0 ? fmt::format("({} scripted)", scripted) : "", "participants");
  text += tile(std::to_string(kept), fmt::format("of {}", trials), "trials kept");
  text += span_tile(span_of(found_m), "space found necessary in the environment");
  const std::optional<Span> allocated = span_of(comparisons(columns)[1].differences_m);
  text += tile(allocated ? signed_cm(allocated->mean) : "–", allocated ? "cm" : "",
               "found less allocated before, mean");
  // Certified, so rounded up.
  const std::optional<Span> free = span_of(free_m);
  std::string least = free ? cm_at_most(free->low) : "–";
  if (free && cm_at_most(free->high) != least) least += "–" + cm_at_most(free->high);
  text += tile(least, free ? "cm" : "", "minimum spacing above which all are free (what-if)");
  return text + "</dl>\n";
}

std::string trial_row(const Participant& participant, const Trial& trial, std::size_t index) {
  double collision_s = 0;
  std::size_t events = 0;
  for (const PartResult& result : trial.parts) {
    collision_s = std::max(collision_s, result.collision_s);
    events += result.events.size();
  }
  std::string free;
  for (const WhatIfCurve& curve : trial.what_if) {
    const auto least_m = curve.min_free_m();
    free += fmt::format("{}{}: {}", free.empty() ? "" : "<br>", html_name(curve.part),
                        least_m ? cm_at_most(*least_m) : "none");
  }
  return table_row({fmt::format("<a href=\"#trial-{}\">{}, trial {}</a>", index,
                                html_name(participant.pseudonym), trial.number),
                    trial.is_kept ? "kept" : "discarded",
                    trial.tool.empty() ? "none" : html_name(trial.tool),
                    fmt::format("{:.1f}", trial.duration_s),
                    trial.answers.found ? cm_text(*trial.answers.found) : "–",
                    trial.parts.empty() ? "–" : fmt::format("{:.2f}", collision_s),
                    std::to_string(events), free.empty() ? "–" : free});
}

std::string trials_table(const Study& study) {
  if (study.participants.empty()) return "<p>The study has no trials.</p>\n";
  std::string text =
      "<div class=\"scroll\"><table>\n<caption>Trials</caption>\n" +
      table_head({"trial", "status", "tool", "duration, s", "space found, cm",
                  "collisions of the worst part, s", "events", "minimum free spacing, cm"}) +
      "<tbody>\n";
  std::size_t index = 0;
  for (const Participant& participant : study.participants)
    for (const Trial& trial : participant.trials) text += trial_row(participant, trial, index++);
  return text + "</tbody></table></div>\n";
}

std::string p_text(const std::optional<ExactTest>& test) {
  return test ? fmt::format("{:.3g}", test->p) : "–";
}

std::string tests_table(const std::vector<Comparison>& found) {
  std::string text =
      "<div class=\"scroll\"><table>\n<caption>Space found in the environment less the answer "
      "before</caption>\n" +
      table_head({"against", "participants", "needed more / less / same", "mean, cm", "range, cm",
                  "Wilcoxon signed-rank, p", "sign test, p"}) +
      "<tbody>\n";
  for (const Comparison& comparison : found) {
    const std::optional<Span> span = span_of(comparison.differences_m);
    std::size_t more = 0, less = 0;
    for (const double difference_m : comparison.differences_m) {
      more += difference_m > kTie_m;
      less += difference_m < -kTie_m;
    }
    const std::size_t n = comparison.differences_m.size();
    text += table_row({comparison.with + " before", std::to_string(n),
                       fmt::format("{} / {} / {}", more, less, n - more - less),
                       span ? signed_cm(span->mean) : "–",
                       span ? signed_cm(span->low) + " to " + signed_cm(span->high) : "–",
                       p_text(comparison.wilcoxon), p_text(comparison.sign)});
  }
  return text + "</tbody></table></div>\n";
}

// The limit of any exact test on so few participants.
std::string p_limit(const std::vector<Comparison>& found) {
  std::size_t n = 0;
  for (const Comparison& comparison : found)
    n = std::max(n, std::size_t(std::ranges::count_if(comparison.differences_m, [](double d) {
                   return std::abs(d) > kTie_m;  // the tests drop the others
                 })));
  std::string text =
      "<p>An exact test on four participants, as in the paper, cannot reach p &lt; 0.125 "
      "(two-sided): even if all four differ in the same direction, that has a probability of "
      "2/2<sup>4</sup> = 0.125 by chance.";
  if (n > 0 && n != 4)
    text += fmt::format(" With the {} here, the limit is p = {:.3g}.",
                        base::counted(n, "participant"), min_p(n));
  return text +
         " The tests are exact and two-sided; ranges count by their middle, equal answers are "
         "dropped. The signed-rank test assumes that the differences are symmetric about their "
         "median, the sign test does not. The values are not corrected for several tests.</p>\n";
}

}  // namespace

std::string table_row(const std::vector<std::string>& cells) {
  std::string text = "<tr>";
  for (std::size_t i = 0; i < cells.size(); ++i)
    text += i == 0 ? "<th scope=\"row\">" + cells[i] + "</th>" : "<td>" + cells[i] + "</td>";
  return text + "</tr>\n";
}

std::string table_head(const std::vector<std::string>& heads) {
  std::string text = "<thead><tr>";
  for (const std::string& head : heads) text += "<th scope=\"col\">" + head + "</th>";
  return text + "</tr></thead>\n";
}

std::string summary_section(const Study& study) {
  return "<section id=\"summary\">\n<h2>Summary</h2>\n" + tiles(study) +
         "<figure class=\"chart wide\" data-chart=\"answers\"><figcaption>The four answers of each "
         "participant</figcaption></figure>\n" +
         trials_table(study) + "</section>\n";
}

std::string answers_section(const Study& study) {
  const std::vector<AnswersColumn> columns = answers_columns(study);
  std::string text = "<section id=\"table-1\">\n<h2>Answers and space found</h2>\n";
  if (columns.empty())
    return text + "<p>No trial is kept, so there are no answers.</p>\n</section>\n";
  std::vector<std::string> heads{
      study.spacing_of.empty() ? "Space" : "Between " + html_name(study.spacing_of)};
  for (std::size_t i = 0; i < columns.size(); ++i)
    heads.push_back(fmt::format("#{}<br><small>{}{}</small>", i + 1,
                                html_name(columns[i].pseudonym),
                                columns[i].kind == ParticipantKind::scripted ? " (scripted)" : ""));
  text +=
      "<div class=\"scroll\"><table class=\"answers\">\n<caption>Participant responses and task "
      "results, cm (in the form of the paper’s Table 1)</caption>\n" +
      table_head(heads) + "<tbody>\n";
  for (const AnswersRow& row : answers_rows()) {
    std::vector<std::string> cells{html_text(row.question)};
    for (const AnswersColumn& column : columns) {
      const std::optional<Answer>& answer = column.answers.*row.answer;
      cells.push_back(!answer                  ? "–"
                      : answer->remark.empty() ? cm_text(*answer)
                                               : cm_text(*answer) + "<br><small>" +
                                                     html_name(answer->remark) + "</small>");
    }
    text += table_row(cells);
  }
  text +=
      "</tbody></table></div>\n<p class=\"note\">Kept trials only. The answers before are those "
      "of a participant’s first kept trial that has them, the other two those of the last "
      "one.</p>\n";
  const std::vector<Comparison> found = comparisons(columns);
  text += tests_table(found);
  const std::string reason = reason_for_no_p(columns);
  if (!reason.empty()) text += "<p><strong>" + html_text(reason) + "</strong></p>\n";
  return text + p_limit(found) + "</section>\n";
}

std::string limits_section(const Study& study) {
  std::string text =
      "<section id=\"limits\">\n<h2>How to read the numbers</h2>\n<ul>\n"
      "<li>Real objects are known by their visual hull, which is larger than they are: a collision "
      "may be less deep than stated or not exist, and a clearance may be larger.</li>\n"
      "<li>A certified free interval holds for the recorded hull at every spacing between its "
      "ends, "
      "not only at samples. Lengths are rounded so that the statement stays true.</li>\n"
      "<li>The depth of a collision, or penetration, is how far the part must be moved until it is "
      "free in the worst frame, between certified bounds: a part with a spacing along its axis, in "
      "its range; another one along x, y or z, whichever is shortest.</li>\n"
      "<li>At another spacing, a person would have moved differently.</li>\n"
      "<li>The error band of a clearance adds the bounds of all its sources. It does not hold the "
      "excess of the hull.</li>\n";
  for (const std::string& remark : study.remarks) text += "<li>" + html_text(remark) + "</li>\n";
  return text + "</ul>\n</section>\n";
}

}  // namespace fivepipe::study::report
