// The lines of a spacing study for the parts and layouts of what-if.
#pragma once
#include <map>

#include "launch/study/what_if/what_if.h"

namespace fivepipe::study {

// A part of what-if as a line of a study: at spacing 0 it is moved back by what its spacing is in
// the scene.
struct PartOnLine {
  WhatIfPart part;  // with the values of the scene
  collision::MovablePart movable;
};

struct StudyLines {
  std::vector<Line> lines;
  std::vector<JointLayout> joint_layouts;       // of the table's rows
  std::vector<std::vector<std::string>> parts;  // of each place of a joint layout: the part's name
};

// One line per part. margin_m: how far the line of a part with one spacing goes beyond it, to find
// the nearest spacing at which the part is free.
StudyLines lines_of_ranges(const std::vector<PartOnLine>& parts, int layouts, bool with_distances,
                           double margin_m);
// Adds the combinations of the spacings of all lines as joint layouts: of each line as many, at
// equal distances in their order and with both ends, as max_combinations permits. Adds none if a
// line has several spacings and only one is permitted.
void add_combinations(StudyLines& lines, const std::vector<PartOnLine>& parts,
                      std::size_t max_combinations);

// The rows of a table. Rows that differ in one column of a part share a line: its spacing, or the
// axis with the most different values. margin_m: how far a line goes beyond its rows, as above.
// Names of the table are in `parts`.
StudyLines lines_of_table(const LayoutTable& table, const std::map<std::string, PartOnLine>& parts,
                          bool with_distances, double margin_m);

}  // namespace fivepipe::study
