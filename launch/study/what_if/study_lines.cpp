#include "launch/study/what_if/study_lines.h"

#include <algorithm>
#include <array>
#include <set>

namespace fivepipe::study {
namespace {

using collision::SpacingInterval;
using Eigen::Vector3d;

// Where a part is in each row: its spacing on a line, and the line's offset.
struct Placement {
  std::array<double, 3> offset_m{};  // world
  double spacing_m = 0;
  bool operator<(const Placement& other) const {
    return std::pair(offset_m, spacing_m) < std::pair(other.offset_m, other.spacing_m);
  }
};

// The axis with the most different values, of those that the table has.
int sweep_axis(const LayoutTable& table, const std::array<int, 3>& column_of_axis) {
  int best = 0;
  std::size_t most = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (column_of_axis[std::size_t(axis)] < 0) continue;
    std::set<double> values;
    for (const LayoutTable::Row& row : table.rows)
      values.insert(row.cell_m[std::size_t(column_of_axis[std::size_t(axis)])]);
    if (values.size() > most) best = axis, most = values.size();
  }
  return best;
}

// Adds the lines of one part, and its place to each joint layout.
class PartOfTable {
 public:
  PartOfTable(const LayoutTable& table, const PartOnLine& part) : part_(part) {
    std::array<int, 3> column_of_axis{-1, -1, -1};
    int spacing_column = -1;
    for (std::size_t i = 0; i < table.columns.size(); ++i) {
      const LayoutTable::Column& column = table.columns[i];
      if (column.part != part.part.name) continue;
      (column.axis < 0 ? spacing_column : column_of_axis[std::size_t(column.axis)]) = int(i);
    }
    has_axes_ = std::ranges::any_of(column_of_axis, [](int column) { return column >= 0; });
    axis_ = sweep_axis(table, column_of_axis);
    for (const LayoutTable::Row& row : table.rows) {
      Placement at;
      if (spacing_column >= 0) at.spacing_m = row.cell_m[std::size_t(spacing_column)];
      if (spacing_column < 0 && !has_axes_) at.spacing_m = part.part.at_m;
      for (std::size_t axis = 0; axis < 3; ++axis)
        if (column_of_axis[axis] >= 0)
          (int(axis) == axis_ ? at.spacing_m : at.offset_m[axis]) =
              row.cell_m[std::size_t(column_of_axis[axis])];
      placements_.push_back(at);
    }
  }

  void add_to(StudyLines& lines, bool with_distances, double margin_m) const {
    std::map<std::array<double, 3>, std::set<double>> spacings_m;
    for (const Placement& at : placements_) spacings_m[at.offset_m].insert(at.spacing_m);
    std::map<std::array<double, 3>, std::size_t> line_of;
    for (const auto& [offset_m, of_line_m] : spacings_m) {
      line_of[offset_m] = lines.lines.size();
      std::vector<double> sorted_m(of_line_m.begin(), of_line_m.end());
      lines.lines.push_back({movable(offset_m), range_of(sorted_m, with_distances, margin_m),
                             sorted_m, with_distances});
    }
    for (std::size_t row = 0; row < placements_.size(); ++row) {
      const Placement& at = placements_[row];
      const std::size_t line = line_of.at(at.offset_m);
      const std::vector<double>& of_line_m = lines.lines[line].spacings_m;
      const auto found = std::ranges::lower_bound(of_line_m, at.spacing_m);
      lines.joint_layouts[row].push_back({line, std::size_t(found - of_line_m.begin())});
      lines.parts[row].push_back(part_.part.name);
    }
  }

 private:
  collision::MovablePart movable(const std::array<double, 3>& offset_m) const {
    if (!has_axes_) return part_.movable;
    // From its place in the scene.
    return part_.movable.beside(part_.part.at_m * part_.part.axis_world.normalized() +
                                    Vector3d(offset_m[0], offset_m[1], offset_m[2]),
                                Vector3d::Unit(axis_));
  }
  SpacingInterval range_of(const std::vector<double>& sorted_m, bool with_distances,
                           double margin_m) const {
    SpacingInterval range{sorted_m.front(), sorted_m.back()};
    if (!with_distances) return range;
    range = {range.low_m - margin_m, range.high_m + margin_m};
    // Where the part may be, there is no need to search farther.
    const SpacingInterval& own = part_.part.range;
    if (!has_axes_ && own.low_m < own.high_m)
      range = {std::min(own.low_m, sorted_m.front()), std::max(own.high_m, sorted_m.back())};
    return range;
  }

  const PartOnLine& part_;
  bool has_axes_ = false;
  int axis_ = 0;  // along which the spacings of a line are, if it has_axes_
  std::vector<Placement> placements_;
};

}  // namespace

StudyLines lines_of_ranges(const std::vector<PartOnLine>& parts, int layouts, bool with_distances,
                           double margin_m) {
  StudyLines found;
  for (const auto& [part, movable] : parts) {
    const bool is_one_place = part.range.low_m == part.range.high_m;
    SpacingInterval range = part.range;
    if (is_one_place && with_distances) range = {range.low_m - margin_m, range.high_m + margin_m};
    found.lines.push_back(
        {movable, range, equally_spaced_m(part.range, is_one_place ? 1 : layouts), with_distances});
  }
  return found;
}

void add_combinations(StudyLines& lines, const std::vector<PartOnLine>& parts,
                      std::size_t max_combinations) {
  // A part with one spacing is in all of them.
  const auto combinations_with = [&](std::size_t per_line) {
    double product = 1;
    for (const Line& line : lines.lines)
      product *= double(std::min(per_line, line.spacings_m.size()));
    return product;
  };
  std::size_t most = 0, per_line = 1;
  for (const Line& line : lines.lines) most = std::max(most, line.spacings_m.size());
  while (per_line < most && combinations_with(per_line + 1) <= double(max_combinations)) ++per_line;
  if (per_line < 2 && most > 1) return;
  std::vector<JointLayout> found{{}};
  std::vector<std::string> names;
  for (std::size_t line = 0; line < lines.lines.size(); ++line) {
    names.push_back(parts[line].part.name);
    const std::size_t spacings = lines.lines[line].spacings_m.size(),
                      taken = std::min(per_line, spacings);
    std::vector<JointLayout> longer;
    for (const JointLayout& layout : found)
      for (std::size_t i = 0; i < taken; ++i) {
        longer.push_back(layout);
        longer.back().push_back({line, taken > 1 ? i * (spacings - 1) / (taken - 1) : 0});
      }
    found = std::move(longer);
  }
  lines.joint_layouts = std::move(found);
  lines.parts.assign(lines.joint_layouts.size(), names);
}

StudyLines lines_of_table(const LayoutTable& table, const std::map<std::string, PartOnLine>& parts,
                          bool with_distances, double margin_m) {
  StudyLines found;
  found.joint_layouts.resize(table.rows.size());
  found.parts.resize(table.rows.size());
  for (const auto& [name, part] : parts)
    PartOfTable(table, part).add_to(found, with_distances, margin_m);
  return found;
}

}  // namespace fivepipe::study
