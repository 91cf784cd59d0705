#include <fmt/format.h>

#include <cmath>

#include "common/base/text_table.h"
#include "launch/study/what_if/what_if.h"
#include "launch/units/length.h"

namespace fivepipe::study {
namespace {

// Part of the last decimal: of a bound that is exact in decimals.
constexpr double kRounding = 1e-6;

using Columns = std::vector<base::TextTable::Column>;

// Lengths in cm with two decimals, rounded so that the statement stays true.
std::string at_least(double length_m) {
  return fmt::format("{:.2f}", std::floor(1e4 * length_m + kRounding) / 100);
}
std::string at_most(double length_m) {
  return fmt::format("{:.2f}", std::ceil(1e4 * length_m - kRounding) / 100);
}
std::string exact_cm(double length_m) { return fmt::format("{:.2f} cm", 100 * length_m); }

// A length of which bounds are known.
std::string text_of_bracket(const Bracket& bracket) {
  if (std::isinf(bracket.min_m)) return "whole range";
  if (std::isinf(bracket.max_m))
    return bracket.min_m > 0 ? "at least " + at_least(bracket.min_m) + " cm" : "unknown";
  return bracket.max_m > 0 ? at_least(bracket.min_m) + " to " + at_most(bracket.max_m) + " cm"
                           : "0";
}

void add_result_columns(Columns& columns, bool with_distances) {
  columns.push_back({"collides", true});
  if (!with_distances) return;
  columns.push_back({"penetration", true});
  columns.push_back({"clearance", true});
}

void add_result(std::vector<std::string>& cells, const LayoutResult& layout, bool with_distances) {
  cells.push_back(layout.colliding_frames > 0   ? fmt::format("{:.2f} s", layout.collision_s)
                  : layout.undecided_frames > 0 ? "undecided"
                                                : "-");
  if (!with_distances) return;
  cells.push_back(layout.colliding_frames > 0 ? text_of_bracket(layout.penetration) : "-");
  cells.push_back(text_of_bracket(layout.clearance));
}

// "30 of 1000 layouts are shown; layouts.csv has all.\n"; empty if all are shown.
std::string rest_text(std::size_t layouts, const std::string& which,
                      const std::filesystem::path& csv) {
  if (layouts <= kShownLayouts) return "";
  return fmt::format("{}{} of {} layouts are shown; {}.\n", which, kShownLayouts, layouts,
                     csv.empty() ? "--csv FILE writes all" : csv.string() + " has all");
}

std::string view_text(const PartResult& of) {
  const collision::SpacingInterval& range = of.part.range;
  if (!of.in_view)
    return "Nowhere in the range is the whole part in view of the cameras and in the volume: what "
           "is outside\nis free because no hull can be there.\n";
  if (of.in_view->low_m > range.low_m || of.in_view->high_m < range.high_m)
    return fmt::format(
        "The whole part is in view of the cameras and in the volume from {} to {} cm. Elsewhere, "
        "what is\noutside is free because no hull can be there.\n",
        at_most(of.in_view->low_m), at_least(of.in_view->high_m));
  return "";
}

std::string free_text(const PartResult& of) {
  const LineResult& result = of.result;
  if (of.part.range.low_m == of.part.range.high_m)
    return result.free.empty() ? "" : "Free in all frames, certified.\n";
  if (result.free.empty()) return "No spacing of the range is free in all frames.\n";
  std::string text = "Free in all frames, certified at every spacing between the ends:\n";
  for (const collision::SpacingInterval& i : result.free)
    text += fmt::format("  {} to {} cm\n", at_most(i.low_m), at_least(i.high_m));
  const double min_m = min_free_spacing_m(result, of.part.range);
  return text + (std::isfinite(min_m)
                     ? "Minimum spacing above which all are free: " + at_most(min_m) + " cm\n"
                     : "The largest spacings of the range are not free: try a longer range.\n");
}

// "Part block, spacing -40.0 cm to 40.0 cm\n"
std::string head_of(const PartResult& of) {
  std::string text = "Part " + of.part.name;
  if (of.part.added)
    text += fmt::format(", which was not in the recording, {:.1f} x {:.1f} x {:.1f} cm",
                        100 * of.size_m.x(), 100 * of.size_m.y(), 100 * of.size_m.z());
  const collision::SpacingInterval& range = of.part.range;
  if (range.low_m < range.high_m)
    text += fmt::format(", spacing {} to {}", text_of_length(range.low_m),
                        text_of_length(range.high_m));
  return text + '\n';
}

// The table of a part, its free intervals, and what limits them.
std::string part_text(const PartResult& of, bool with_distances, const std::filesystem::path& csv) {
  Columns columns{{"spacing", true}};
  add_result_columns(columns, with_distances);
  base::TextTable table(columns);
  const std::vector<LayoutResult>& layouts = of.result.layouts;
  // At equal distances, with both ends.
  const std::size_t shown = std::min(layouts.size(), kShownLayouts);
  for (std::size_t i = 0; i < shown; ++i) {
    const LayoutResult& layout =
        layouts[shown > 1 ? i * (layouts.size() - 1) / (shown - 1) : std::size_t(0)];
    std::vector<std::string> cells{exact_cm(layout.spacing_m)};
    add_result(cells, layout, with_distances);
    table.add(std::move(cells));
  }
  return head_of(of) + '\n' + table.text() + rest_text(layouts.size(), "", csv) + '\n' +
         free_text(of) + recorded_text(of) + view_text(of);
}

// The layouts of the file.
std::string rows_text(const WhatIf& found, const std::filesystem::path& csv) {
  const LayoutTable& table = *found.options.table;
  Columns columns{{"line", true}};
  for (const LayoutTable::Column& column : table.columns) columns.push_back({column.name(), true});
  add_result_columns(columns, found.options.with_distances);
  columns.push_back({"colliding parts"});
  base::TextTable text(columns);
  std::size_t free = 0;
  for (std::size_t row = 0; row < found.rows.size(); ++row) {
    const LayoutResult& layout = found.rows[row].layout;
    free += layout.colliding_frames == 0 && layout.undecided_frames == 0;
    if (row >= kShownLayouts) continue;
    std::vector<std::string> cells{std::to_string(table.rows[row].line)};
    for (const double cell_m : table.rows[row].cell_m) cells.push_back(exact_cm(cell_m));
    add_result(cells, layout, found.options.with_distances);
    cells.push_back(base::joined(found.rows[row].colliding_parts, ", "));
    text.add(std::move(cells));
  }
  return text.text() + rest_text(found.rows.size(), "The first ", csv) +
         fmt::format("\nFree in all frames: {} of {} layouts.\n", free, found.rows.size());
}

}  // namespace

std::string recorded_text(const PartResult& of) {
  if (of.recorded.size() < 2) return "";
  std::string text = "Recorded with " + of.part.name + " at ";
  for (std::size_t i = 0; i < of.recorded.size(); ++i)
    text += fmt::format("{}{}{}", i > 0 ? ", " : "", text_of_length(of.recorded[i].spacing_m),
                        i > 0 ? fmt::format(" from {:.1f} s on", of.recorded[i].time_s) : "");
  return text + ". The results do not depend on it.\n";
}

std::string limits_of(const WhatIf& found) {
  std::string notes;
  if (found.parts.size() > 1)
    notes +=
        "The results of a part do not depend on where the others are: a layout is certified free "
        "if each\npart is in one of its free intervals.\n";
  if (found.empty_frames > 0)
    notes += fmt::format("Frames without a hull: {} of {}.\n", found.empty_frames, found.frames);
  if (found.incomplete_frames > 0)
    notes += fmt::format(
        "In {} frames the search reached its limit and left more undecided: the part is very near "
        "to the\nhull along the range.\n",
        found.incomplete_frames);
  for (const auto& [reason, count] : found.drops)
    notes += fmt::format("Dropped of the recording: {} ({}).\n", reason, count);
  if (!found.damage.empty())
    notes += fmt::format(
        "{}: only what could be read was studied; `fivepipe info {}` states what is missing.\n",
        base::printable(found.damage), base::printable(found.options.recording.string()));
  for (const std::string& warning : found.warnings)
    notes += "warning: " + base::printable(warning) + '\n';
  return notes +
         "The visual hull is larger than the objects, so a collision may be less deep or not "
         "exist. In\nanother layout, a person would have moved differently.\n";
}

std::string text_of(const WhatIf& found, const std::filesystem::path& csv) {
  std::string text =
      fmt::format("{}: {} frames, {:.1f} s; scene {}\n\n", found.options.recording.string(),
                  found.frames, found.duration_s, found.scene);
  for (const PartResult& part : found.parts)
    text +=
        part_text(part, found.options.with_distances, csv) + (found.parts.size() > 1 ? "\n" : "");
  if (found.options.table) text += rows_text(found, csv);
  return text + limits_of(found);
}

}  // namespace fivepipe::study
