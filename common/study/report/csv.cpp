#include "common/study/report/csv.h"

#include <algorithm>
#include <functional>
#include <vector>

#include "common/base/text_table.h"
#include "common/study/report/answers_table.h"
#include "common/study/report/escape.h"

namespace fivepipe::study::report {
namespace {

std::string csv_cm(double length_m) { return csv_number(100 * length_m, 4); }
std::string csv_seconds(double time_s) { return csv_number(time_s, 4); }

std::string line(const std::vector<std::string>& fields) {
  return base::joined(fields, ",") + "\r\n";
}

void for_each_trial(const Study& study,
                    const std::function<void(const Participant&, const Trial&)>& visit) {
  for (const Participant& participant : study.participants)
    for (const Trial& trial : participant.trials) visit(participant, trial);
}

void add_answer(const std::optional<Answer>& answer, std::vector<std::string>& fields) {
  fields.push_back(answer ? csv_cm(answer->low_m) : "");
  fields.push_back(answer && answer->high_m ? csv_cm(*answer->high_m) : "");
  fields.push_back(csv_text(answer ? answer->remark : ""));
}

void add_bracket(const Bracket& bracket, std::vector<std::string>& fields) {
  fields.push_back(csv_cm(bracket.min_m));
  fields.push_back(csv_cm(bracket.max_m));
}

// Names of the parts with results, in the order of their first result.
std::vector<std::string> part_names(const Study& study) {
  std::vector<std::string> names;
  for_each_trial(study, [&](const Participant&, const Trial& trial) {
    for (const PartResult& result : trial.parts)
      if (std::ranges::find(names, result.part) == names.end()) names.push_back(result.part);
  });
  return names;
}

bool is_in_free_interval(const WhatIfCurve& curve, double spacing_m) {
  return std::ranges::any_of(curve.result.free, [&](const collision::SpacingInterval& free) {
    return free.low_m <= spacing_m && spacing_m <= free.high_m;
  });
}

}  // namespace

std::string trials_csv(const Study& study) {
  std::vector<std::string> head{"participant", "kind", "trial", "kept", "duration_s", "tool"};
  for (const char* answer : {"necessary_before", "allocated_before", "found", "allocated_after"})
    for (const char* column : {"_cm", "_to_cm", "_remark"})
      head.push_back(std::string(answer) + column);
  const std::vector<std::string> parts = part_names(study);
  for (const std::string& part : parts) head.push_back(csv_text("collision_s " + part));
  std::string text = line(head);
  for_each_trial(study, [&](const Participant& participant, const Trial& trial) {
    std::vector<std::string> fields{
        csv_text(participant.pseudonym),
        participant.kind == ParticipantKind::human ? "human" : "scripted",
        std::to_string(trial.number),
        trial.is_kept ? "yes" : "no",
        csv_seconds(trial.duration_s),
        csv_text(trial.tool)};
    for (const AnswersRow& row : answers_rows()) add_answer(trial.answers.*row.answer, fields);
    for (const std::string& part : parts) {
      const auto result = std::ranges::find(trial.parts, part, &PartResult::part);
      fields.push_back(result == trial.parts.end() ? "" : csv_seconds(result->collision_s));
    }
    text += line(fields);
  });
  return text;
}

std::string events_csv(const Study& study) {
  std::string text = line({"participant", "trial", "part", "start_s", "end_s", "penetration_min_cm",
                           "penetration_max_cm"});
  for_each_trial(study, [&](const Participant& participant, const Trial& trial) {
    for (const PartResult& result : trial.parts)
      for (const Event& event : result.events) {
        std::vector<std::string> fields{csv_text(participant.pseudonym),
                                        std::to_string(trial.number), csv_text(result.part),
                                        csv_seconds(event.start_s), csv_seconds(event.end_s)};
        if (event.penetration)
          add_bracket(*event.penetration, fields);
        else
          fields.insert(fields.end(), 2, "");
        text += line(fields);
      }
  });
  return text;
}

std::string clearance_csv(const Study& study) {
  std::string text =
      line({"participant", "trial", "part", "time_s", "min_cm", "max_cm", "cap_cm", "error_cm"});
  for_each_trial(study, [&](const Participant& participant, const Trial& trial) {
    for (const PartResult& result : trial.parts) {
      if (!result.clearance) continue;
      const Clearance& clearance = *result.clearance;
      for (std::size_t i = 0; i < clearance.times_s.size(); ++i) {
        std::vector<std::string> fields{csv_text(participant.pseudonym),
                                        std::to_string(trial.number), csv_text(result.part),
                                        csv_seconds(clearance.times_s[i])};
        add_bracket(clearance.distances[i], fields);
        fields.push_back(csv_cm(clearance.cap_m));
        fields.push_back(csv_cm(clearance.error_m()));
        text += line(fields);
      }
    }
  });
  return text;
}

std::string what_if_csv(const Study& study) {
  std::string text = line({"participant", "trial", "part", "spacing_cm", "certified_free",
                           "collision_s", "undecided_frames", "penetration_min_cm",
                           "penetration_max_cm", "clearance_min_cm", "clearance_max_cm"});
  for_each_trial(study, [&](const Participant& participant, const Trial& trial) {
    for (const WhatIfCurve& curve : trial.what_if)
      for (const LayoutResult& layout : curve.result.layouts) {
        std::vector<std::string> fields{csv_text(participant.pseudonym),
                                        std::to_string(trial.number),
                                        csv_text(curve.part),
                                        csv_cm(layout.spacing_m),
                                        is_in_free_interval(curve, layout.spacing_m) ? "yes" : "no",
                                        csv_seconds(layout.collision_s),
                                        std::to_string(layout.undecided_frames)};
        if (curve.with_distances) {
          add_bracket(layout.penetration, fields);
          add_bracket(layout.clearance, fields);
        } else {
          fields.insert(fields.end(), 4, "");
        }
        text += line(fields);
      }
  });
  return text;
}

}  // namespace fivepipe::study::report
