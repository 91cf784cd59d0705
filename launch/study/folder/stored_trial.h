// One trial of a study as its file trial.json keeps it.
#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/study/report/study.h"

namespace fivepipe::study {

// running: begun and not yet ended, or interrupted; it can be resumed.
enum class TrialState { running, kept, discarded };

struct StoredNote {
  std::int64_t stamp_ns;  // CLOCK_REALTIME
  std::string text;
};

struct StoredTrial {
  int number = 1;           // unique in the study
  std::string participant;  // pseudonym: any text
  report::ParticipantKind kind = report::ParticipantKind::human;
  TrialState state = TrialState::running;
  std::string discarded_because = {};
  std::string tool = {};  // in use; empty: none
  report::Answers answers = {};
  std::vector<StoredNote> notes = {};
  // Files in the trial's folder, in the order in which they were recorded.
  std::vector<std::string> recordings = {};
};

nlohmann::ordered_json json_of(const StoredTrial& trial);
// Throws base::UsageError that names the file and the value that is wrong.
StoredTrial trial_from(const nlohmann::ordered_json& json, const std::string& file);

// Whether the text is UTF-8, so that JSON can hold it.
bool is_utf8(const std::string& text);

// Returns the answer that a person typed: a length with its unit, or two lengths, then any remark:
// "15cm", "15-16 cm", "15cm-16cm", "16 cm adjust tool". Throws base::UsageError otherwise.
report::Answer answer_from(const std::string& text);

}  // namespace fivepipe::study
