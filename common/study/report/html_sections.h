// The sections of the page. All texts of the study are escaped.
#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "common/study/report/study.h"

namespace fivepipe::study::report {

// What was found, the answers as a chart, and a row per trial.
std::string summary_section(const Study& study);
// Table 1 and the exact tests.
std::string answers_section(const Study& study);
// What the numbers mean, and their limits.
std::string limits_section(const Study& study);
// A trial, the `index`-th of the page from 0: its answers, collisions, charts and 3D view.
std::string trial_section(const Participant& participant, const Trial& trial, std::size_t index);

// Curves of parts over their ranges, and their free intervals. They are the what-if of the
// `index`-th trial of the page's data.
std::string what_if_charts(const std::vector<WhatIfCurve>& curves, std::size_t index);

// Lengths in cm with two decimals, rounded so that the statement stays true; "–" for infinity.
std::string cm_at_least(double length_m);
std::string cm_at_most(double length_m);
// "1.20–1.34 cm", "at least 10.00 cm" if the upper bound is infinite, "unknown" if nothing is
// known, "0" for {0, 0}.
std::string bracket_text(const Bracket& bracket);

// A row of a table: `cells` are HTML. The first one is the row's head.
std::string table_row(const std::vector<std::string>& cells);
// `heads` are HTML.
std::string table_head(const std::vector<std::string>& heads);

}  // namespace fivepipe::study::report
