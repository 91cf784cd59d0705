// An invented study: the answers are those of the paper's Table 1, everything else is made up.
#pragma once
#include <cstddef>
#include <string>

#include "common/study/report/layouts_page.h"

namespace fivepipe::test {

// A PNG file of a small picture.
std::string example_png(int width_px, int height_px, int seed);

// Four human participants with one trial each; the second one has a discarded trial, too.
study::report::Study example_study();

// `count` participants with one trial without measurements.
study::report::Study study_of(std::size_t count, study::report::ParticipantKind kind);

// Layouts of two parts: payload A at 13 spacings, and payload B at 9. A row with B at 10 cm is
// undecided where A is at least 24 cm.
study::report::LayoutsPage example_layouts();

}  // namespace fivepipe::test
