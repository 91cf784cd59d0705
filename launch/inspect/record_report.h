// Text about a finished recording session, for stdout and stderr.
#pragma once
#include <string>

#include "common/recording/replay/record_session.h"

namespace fivepipe::launch {

// Counts by topic and a summary line.
std::string summary_text(const replay::RecordRequest& request, const replay::RecordResult& result);
// What is missing, why, and what to do next; a line each. Empty if everything is in the file.
std::string problems_text(const replay::RecordRequest& request, const replay::RecordResult& result);

}  // namespace fivepipe::launch
