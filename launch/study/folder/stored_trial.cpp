#include "launch/study/folder/stored_trial.h"

#include <fmt/format.h>

#include "common/base/regex.h"
#include "common/base/usage_error.h"
#include "launch/units/length.h"

namespace fivepipe::study {
namespace {

using Json = nlohmann::ordered_json;
using report::Answer;

constexpr double kMaxAnswer_m = 100;

// The answers by their name in the file.
template <class Answers, class Each>
void each_answer(Answers& answers, const Each& each) {
  each("necessary_before", answers.necessary_before);
  each("allocated_before", answers.allocated_before);
  each("found", answers.found);
  each("allocated_after", answers.allocated_after);
}

const char* name_of(TrialState state) {
  switch (state) {
    case TrialState::running: return "running";
    case TrialState::kept: return "kept";
    case TrialState::discarded: break;
  }
  return "discarded";
}

TrialState state_from(const std::string& name) {
  for (const TrialState state : {TrialState::running, TrialState::kept, TrialState::discarded})
    if (name == name_of(state)) return state;
  throw std::runtime_error("state '" + name + "' is none of running, kept, discarded");
}

report::ParticipantKind kind_from(const std::string& name) {
  if (name == "human") return report::ParticipantKind::human;
  if (name == "scripted") return report::ParticipantKind::scripted;
  throw std::runtime_error("kind '" + name + "' is neither human nor scripted");
}

// A name in the trial's folder.
std::string recording_from(const std::string& name) {
  if (name.empty() || name.find('/') != std::string::npos || name.starts_with('.'))
    throw std::runtime_error("recording '" + name + "' is no file of the trial's folder");
  return name;
}

Answer checked(const Answer& answer) {
  const double high_m = answer.high_m.value_or(answer.low_m);
  if (!(answer.low_m >= 0 && answer.low_m <= high_m && high_m <= kMaxAnswer_m))
    throw std::runtime_error(fmt::format(
        "an answer of {:g} to {:g} m is not ascending within 0 and 100 m", answer.low_m, high_m));
  return answer;
}

Answer checked_answer(double low_m, std::optional<double> high_m, const std::string& text,
                      const std::string& remark) {
  try {
    return checked({low_m, high_m, remark});
  } catch (const std::exception& error) {
    throw base::UsageError("'" + text + "': " + error.what());
  }
}

}  // namespace

Json json_of(const StoredTrial& trial) {
  Json json{{"trial", trial.number},
            {"participant", trial.participant},
            {"kind", trial.kind == report::ParticipantKind::human ? "human" : "scripted"},
            {"state", name_of(trial.state)},
            {"discarded_because", trial.discarded_because},
            {"tool", trial.tool},
            {"answers", Json::object()},
            {"notes", Json::array()},
            {"recordings", trial.recordings}};
  each_answer(trial.answers, [&](const char* name, const std::optional<Answer>& answer) {
    if (!answer) return;
    Json& stored = json["answers"][name] = {{"low_m", answer->low_m}, {"remark", answer->remark}};
    if (answer->high_m) stored["high_m"] = *answer->high_m;
  });
  for (const StoredNote& note : trial.notes)
    json["notes"].push_back({{"stamp_ns", note.stamp_ns}, {"text", note.text}});
  return json;
}

StoredTrial trial_from(const Json& json, const std::string& file) {
  try {
    StoredTrial trial;
    trial.number = json.at("trial").get<int>();
    trial.participant = json.at("participant").get<std::string>();
    trial.kind = kind_from(json.at("kind").get<std::string>());
    trial.state = state_from(json.at("state").get<std::string>());
    trial.discarded_because = json.at("discarded_because").get<std::string>();
    trial.tool = json.at("tool").get<std::string>();
    each_answer(trial.answers, [&](const char* name, std::optional<Answer>& answer) {
      if (!json.at("answers").contains(name)) return;
      const Json& stored = json["answers"][name];
      answer = {stored.at("low_m").get<double>(), std::nullopt,
                stored.at("remark").get<std::string>()};
      if (stored.contains("high_m")) answer->high_m = stored["high_m"].get<double>();
      checked(*answer);
    });
    for (const Json& note : json.at("notes"))
      trial.notes.push_back(
          {note.at("stamp_ns").get<std::int64_t>(), note.at("text").get<std::string>()});
    for (const Json& recording : json.at("recordings"))
      trial.recordings.push_back(recording_from(recording.get<std::string>()));
    return trial;
  } catch (const std::exception& error) {
    throw base::UsageError(file + ": " + error.what());
  }
}

bool is_utf8(const std::string& text) {
  try {
    Json(text).dump();
    return true;
  } catch (const nlohmann::json::exception&) {
    return false;
  }
}

Answer answer_from(const std::string& text) {
  static const base::Regex pattern(
      "^\\s*([0-9.]+)\\s*(mm|cm|m|in)?(?:\\s*(?:-|to)\\s*([0-9.]+)\\s*(mm|cm|m|in))?(?:\\s+(.*\\S))"
      "?\\s*$");
  static const base::Regex negative("^\\s*(?:-|\xe2\x88\x92)\\s*[0-9.]");
  if (negative.found_in(text))
    throw base::UsageError("'" + text +
                           "' is negative; an answer is how much space there is, at least 0 cm");
  const auto match = pattern.search(text);
  // "15cm - 16" is a range without the second unit, and no remark.
  static const base::Regex half_range("^(-|to\\b)\\s*[0-9]");
  if (match && is_utf8(text) && !half_range.found_in(match->groups[5])) {
    const std::vector<std::string>& groups = match->groups;
    const bool is_range = !groups[3].empty();
    const auto low_m =
        length_m(groups[1] + (groups[2].empty() && is_range ? groups[4] : groups[2]));
    const auto high_m = is_range ? length_m(groups[3] + groups[4]) : low_m;
    if (low_m && high_m)
      return checked_answer(*low_m, is_range ? high_m : std::nullopt, text, groups[5]);
  }
  throw base::UsageError("'" + text +
                         "' is no answer; write a length such as 15cm or 15-16cm, and any remark");
}

}  // namespace fivepipe::study
