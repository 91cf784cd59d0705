// The report as CSV files (RFC 4180, UTF-8, lines end with CR LF). Lengths are in cm, times in s.
// An unknown or infinite number is an empty field. Text fields are made harmless by csv_text().
#pragma once
#include <string>

#include "common/study/report/study.h"

namespace fivepipe::study::report {

// One row per trial: participant, kind, trial, kept, duration, tool, for each of the four answers
// its value, the upper end of its range and its remark, and the collision seconds of each part.
std::string trials_csv(const Study& study);

// One row per event: participant, trial, part, start, end, bounds of the penetration.
std::string events_csv(const Study& study);

// One row per trial, part and time: bounds of the clearance, the cap and the error.
std::string clearance_csv(const Study& study);

// One row per trial, part and layout of what-if: spacing, whether it is in a certified free
// interval, collision seconds, bounds of the penetration and of the clearance.
std::string what_if_csv(const Study& study);

}  // namespace fivepipe::study::report
