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

// Part of the last decimal: of a bound that is exact in decimals.
constexpr double kDecimalRounding = 1e-6;

std::string answers_list(const Trial& trial) {
  std::string text = "<dl class=\"pairs\">\n";
  for (const AnswersRow& row : answers_rows()) {
    const std::optional<Answer>& answer = trial.answers.*row.answer;
    text += fmt::format(
        "<dt>{}</dt><dd>{}</dd>\n", html_text(row.question),
        !answer ? "–"
                : cm_text(*answer) + " cm" +
                      (answer->remark.empty() ? "" : " (" + html_name(answer->remark) + ")"));
  }
  return text + "</dl>\n";
}

// Layout changes and notes by time.
std::string timeline(const Trial& trial) {
  struct Entry {
    double time_s;
    std::string what;
  };
  std::vector<Entry> entries;
  for (const LayoutChange& change : trial.layout_changes)
    entries.push_back({change.time_s, fmt::format("{} at {:.1f} cm", html_name(change.part),
                                                  100 * change.spacing_m)});
  for (const Note& note : trial.notes)
    entries.push_back({note.time_s, "<q>" + html_name(note.text) + "</q>"});
  if (entries.empty()) return "";
  std::ranges::stable_sort(entries, {}, &Entry::time_s);
  std::string text = "<h4>Layout changes and notes</h4>\n<ol class=\"timeline\">\n";
  for (const Entry& entry : entries)
    text +=
        fmt::format("<li><time>{:.1f} s</time> <span>{}</span></li>\n", entry.time_s, entry.what);
  return text + "</ol>\n";
}

std::string deepest_text(const PartResult& result) {
  std::optional<Bracket> deepest;
  for (const Event& event : result.events) {
    if (!event.penetration) continue;
    if (!deepest) deepest = event.penetration;
    deepest = {std::max(deepest->min_m, event.penetration->min_m),
               std::max(deepest->max_m, event.penetration->max_m)};
  }
  return deepest ? bracket_text(*deepest) : "–";
}

std::string min_clearance_text(const PartResult& result) {
  if (!result.clearance || result.clearance->distances.empty()) return "–";
  Bracket least = result.clearance->distances[0];
  for (const Bracket& distance : result.clearance->distances) {
    least.min_m = std::min(least.min_m, distance.min_m);
    least.max_m = std::min(least.max_m, distance.max_m);
  }
  return bracket_text(least);
}

// "1.20", or "1.20 and 0.07 undecided".
std::string collision_text(const PartResult& result) {
  std::string text = fmt::format("{:.2f}", result.collision_s);
  if (result.undecided_s > 0) text += fmt::format(" and {:.2f} undecided", result.undecided_s);
  return text;
}

std::string parts_table(const Trial& trial) {
  if (trial.parts.empty()) return "<p>No collisions were computed for this trial.</p>\n";
  std::string text =
      "<div class=\"scroll\"><table>\n<caption>Collisions and clearance by "
      "part</caption>\n" +
      table_head({"part", "collision, s", "events", "deepest penetration", "minimum clearance"}) +
      "<tbody>\n";
  for (const PartResult& result : trial.parts)
    text += table_row({html_name(result.part), collision_text(result),
                       std::to_string(result.events.size()), deepest_text(result),
                       min_clearance_text(result)});
  return text + "</tbody></table></div>\n";
}

std::string event_figure(const PartResult& result, const Event& event) {
  const std::string when = fmt::format("{:.2f} to {:.2f} s", event.start_s, event.end_s);
  std::string text = "<figure class=\"event\">";
  if (event.picture_png.empty()) {
    text += "<p class=\"no-picture\">no picture</p>";
  } else {
    text += fmt::format("<img alt=\"Collision of {}, {}. {}\" src=\"data:image/png;base64,{}\">",
                        html_text(result.part), when, html_text(event.picture_shows),
                        base64(event.picture_png));
  }
  text += fmt::format("<figcaption>{}<br>{}", html_name(result.part), when);
  if (event.penetration) text += ", depth " + bracket_text(*event.penetration);
  return text + "</figcaption></figure>\n";
}

std::string events(const Trial& trial) {
  std::string figures;
  for (const PartResult& result : trial.parts)
    for (const Event& event : result.events) figures += event_figure(result, event);
  return figures.empty()
             ? ""
             : "<h4>Collision events</h4>\n<div class=\"events\">\n" + figures + "</div>\n";
}

std::string error_text(const Clearance& clearance) {
  if (clearance.errors.empty()) return "no error bound is known";
  std::vector<std::string> sources, unknown;
  for (const ErrorSource& error : clearance.errors)
    if (error.bound_mm)
      sources.push_back(fmt::format("{} {:.2f} mm", html_name(error.name), *error.bound_mm));
    else
      unknown.push_back(html_name(error.name));
  return fmt::format("error at most ±{:.2f} mm{}: {}", 1e3 * clearance.error_m(),
                     unknown.empty() ? "" : " without that of " + base::joined(unknown, ", "),
                     base::joined(sources, ", "));
}

std::string clearance_charts(const Trial& trial, std::size_t index) {
  std::string text;
  for (std::size_t part = 0; part < trial.parts.size(); ++part) {
    const PartResult& result = trial.parts[part];
    if (!result.clearance || result.clearance->times_s.empty()) continue;
    text += fmt::format(
        "<figure class=\"chart\" data-chart=\"clearance\" data-trial=\"{}\" data-part=\"{}\" "
        "data-summary=\"Minimum {}.\"><figcaption><strong>{}</strong> <small>measured up to "
        "{:.1f} cm; {}</small></figcaption></figure>\n",
        index, part, html_text(min_clearance_text(result)), html_name(result.part),
        100 * result.clearance->cap_m, error_text(*result.clearance));
  }
  return text.empty()
             ? ""
             : "<h4>Clearance over time</h4>\n<div class=\"charts\">\n" + text + "</div>\n";
}

std::string free_text(const WhatIfCurve& curve) {
  std::vector<std::string> intervals;
  for (const collision::SpacingInterval& free : curve.result.free)
    intervals.push_back(cm_at_most(free.low_m) + "–" + cm_at_least(free.high_m) + " cm");
  if (intervals.empty()) return "No spacing of the range is certified free.";
  const auto least_m = curve.min_free_m();
  return "Certified free: " + base::joined(intervals, ", ") + ". " +
         (least_m ? "All are free above " + cm_at_most(*least_m) + " cm."
                  : "The largest spacings of the range are not free.");
}

}  // namespace

std::string cm_at_least(double length_m) {
  if (!std::isfinite(length_m)) return "–";
  return fmt::format("{:.2f}", std::floor(1e4 * length_m + kDecimalRounding) / 100);
}

std::string cm_at_most(double length_m) {
  if (!std::isfinite(length_m)) return "–";
  return fmt::format("{:.2f}", std::ceil(1e4 * length_m - kDecimalRounding) / 100);
}

std::string bracket_text(const Bracket& bracket) {
  if (std::isinf(bracket.min_m)) return "the whole range";
  if (std::isinf(bracket.max_m))
    return bracket.min_m > 0 ? "at least " + cm_at_least(bracket.min_m) + " cm" : "unknown";
  return bracket.max_m > 0 ? cm_at_least(bracket.min_m) + "–" + cm_at_most(bracket.max_m) + " cm"
                           : "0";
}

std::string what_if_charts(const std::vector<WhatIfCurve>& curves, std::size_t index) {
  std::string text;
  for (std::size_t i = 0; i < curves.size(); ++i) {
    const WhatIfCurve& curve = curves[i];
    const std::string free = free_text(curve);
    text += fmt::format("<p><strong>{}</strong>: {}</p>\n<div class=\"charts\">\n",
                        html_name(curve.part), free);
    for (const char* quantity : {"collision", "distance"}) {
      if (curve.result.layouts.empty() ||
          (quantity == std::string("distance") && !curve.with_distances))
        continue;
      text += fmt::format(
          "<figure class=\"chart\" data-chart=\"what-if-{}\" data-trial=\"{}\" data-curve=\"{}\" "
          "data-summary=\"{}\"><figcaption>{} against the spacing of {}</figcaption></figure>\n",
          quantity, index, i, html_text(free),
          quantity == std::string("distance") ? "Clearance and penetration" : "Collision time",
          html_name(curve.part));
    }
    text += "</div>\n";
  }
  return text;
}

std::string trial_section(const Participant& participant, const Trial& trial, std::size_t index) {
  std::string status = trial.is_kept ? "" : " <span class=\"badge\">discarded</span>";
  std::string text = fmt::format(
      "<article class=\"trial\" id=\"trial-{}\">\n<h3>{}, trial {}{}</h3>\n"
      "<p class=\"facts\">{} participant · {:.1f} s · tool: {}{}</p>\n",
      index, html_name(participant.pseudonym), trial.number, status,
      participant.kind == ParticipantKind::human ? "human" : "scripted", trial.duration_s,
      trial.tool.empty() ? "none" : html_name(trial.tool),
      trial.discarded_because.empty() ? "" : " · discarded: " + html_name(trial.discarded_because));
  text += "<div class=\"columns\">\n<div>\n<h4>Answers</h4>\n" + answers_list(trial) +
          "</div>\n<div>\n" + timeline(trial) + "</div>\n</div>\n";
  text += parts_table(trial) + events(trial) + clearance_charts(trial, index);
  if (!trial.what_if.empty())
    text += "<h4>What if: the same movements at other spacings</h4>\n" +
            what_if_charts(trial.what_if, index);
  text += "<h4>Parts and swept volume</h4>\n";
  if (trial.scene)
    text += fmt::format(
        "<figure class=\"view3d\" data-trial=\"{}\">"
        "<noscript><p>The 3D view needs JavaScript.</p></noscript></figure>\n",
        index);
  else
    text += "<p>No recording of this trial can be used, so its parts are not known.</p>\n";
  return text + "</article>\n";
}

}  // namespace fivepipe::study::report
