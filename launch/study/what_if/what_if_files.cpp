// The results of what-if as JSON and CSV.
#include <fmt/format.h>

#include <cmath>

#include "common/base/text_table.h"
#include "common/base/version.h"
#include "launch/study/what_if/what_if.h"

namespace fivepipe::study {
namespace {

using Json = nlohmann::ordered_json;

// null instead of infinity, which JSON does not have.
Json json_of_length(double length_m) {
  return std::isfinite(length_m) ? Json(length_m) : Json(nullptr);
}

Json json_of_bracket(const Bracket& bracket) {
  return {{"min", json_of_length(bracket.min_m)}, {"max", json_of_length(bracket.max_m)}};
}

Json json_of_vector(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

void add_to(Json& json, const LayoutResult& layout, bool with_distances) {
  json["colliding_frames"] = layout.colliding_frames;
  json["undecided_frames"] = layout.undecided_frames;
  json["collision_s"] = layout.collision_s;
  if (!with_distances) return;
  json["penetration_m"] = json_of_bracket(layout.penetration);
  json["clearance_m"] = json_of_bracket(layout.clearance);
}

Json json_of_part(const PartResult& of, bool with_distances) {
  const collision::SpacingInterval& range = of.part.range;
  Json json{{"part", of.part.name},
            {"was_in_recording", !of.part.added},
            {"size_m", json_of_vector(of.size_m)},
            {"at_m", of.part.at_m},
            {"axis", json_of_vector(of.part.axis_world)},
            {"range_m", {range.low_m, range.high_m}},
            {"in_view_m", nullptr},
            {"min_free_spacing_m", json_of_length(min_free_spacing_m(of.result, range))},
            {"free_m", Json::array()},
            {"incomplete_frames", of.result.incomplete_frames},
            {"recorded", Json::array()},
            {"layouts", Json::array()}};
  if (of.part.added) json["mesh"] = of.part.added->file.string();
  if (of.in_view) json["in_view_m"] = {of.in_view->low_m, of.in_view->high_m};
  for (const collision::SpacingInterval& i : of.result.free)
    json["free_m"].push_back({i.low_m, i.high_m});
  for (const RecordedSpacing& spacing : of.recorded)
    json["recorded"].push_back({{"time_s", spacing.time_s}, {"spacing_m", spacing.spacing_m}});
  for (const LayoutResult& layout : of.result.layouts) {
    Json& added = json["layouts"].emplace_back();
    added["spacing_m"] = layout.spacing_m;
    add_to(added, layout, with_distances);
  }
  return json;
}

Json json_of_row(const LayoutTable& table, std::size_t row, const RowResult& result,
                 bool with_distances) {
  Json json{{"line", table.rows[row].line}, {"places_m", Json::object()}};
  for (std::size_t i = 0; i < table.columns.size(); ++i)
    json["places_m"][table.columns[i].name()] = table.rows[row].cell_m[i];
  add_to(json, result.layout, with_distances);
  json["colliding_parts"] = result.colliding_parts;
  return json;
}

std::string csv_number(double value) {
  return std::isfinite(value) ? fmt::format("{:.6g}", value) : "";
}

std::string csv_head(bool with_distances) {
  return std::string("colliding_frames,undecided_frames,collision_s") +
         (with_distances ? ",penetration_min_m,penetration_max_m,clearance_min_m,clearance_max_m"
                         : "");
}

std::string csv_cells(const LayoutResult& layout, bool with_distances) {
  std::string text = fmt::format("{},{},{}", layout.colliding_frames, layout.undecided_frames,
                                 csv_number(layout.collision_s));
  if (with_distances)
    for (const double value_m : {layout.penetration.min_m, layout.penetration.max_m,
                                 layout.clearance.min_m, layout.clearance.max_m})
      text += ',' + csv_number(value_m);
  return text;
}

std::string rows_csv(const WhatIf& found) {
  const LayoutTable& table = *found.options.table;
  std::string text = "line,";
  for (const LayoutTable::Column& column : table.columns) text += column.name() + "_m,";
  text += csv_head(found.options.with_distances) + ",colliding_parts\n";
  for (std::size_t row = 0; row < found.rows.size(); ++row) {
    text += std::to_string(table.rows[row].line) + ',';
    for (const double cell_m : table.rows[row].cell_m) text += csv_number(cell_m) + ',';
    text += csv_cells(found.rows[row].layout, found.options.with_distances) + ',' +
            base::joined(found.rows[row].colliding_parts, " ") + '\n';
  }
  return text;
}

}  // namespace

Json json_of(const WhatIf& found) {
  const WhatIfOptions& options = found.options;
  Json json{{"recording", options.recording.string()},
            {"scene", found.scene},
            {"settings", options.settings},
            {"eps_m", found.eps_m},
            {"version", base::version()},
            {"frames", found.frames},
            {"frames_without_hull", found.empty_frames},
            {"duration_s", found.duration_s},
            {"drops", found.drops},
            {"damage", found.damage},
            {"warnings", found.warnings}};
  if (!options.table) {
    for (const PartResult& part : found.parts)
      json["parts"].push_back(json_of_part(part, options.with_distances));
    return json;
  }
  json["layout_file"] = options.table->file.string();
  json["incomplete_frames"] = found.incomplete_frames;
  for (std::size_t row = 0; row < found.rows.size(); ++row)
    json["layouts"].push_back(
        json_of_row(*options.table, row, found.rows[row], options.with_distances));
  return json;
}

std::string csv_of(const WhatIf& found) {
  if (found.options.table) return rows_csv(found);
  const bool with_distances = found.options.with_distances;
  std::string text = "part,spacing_m," + csv_head(with_distances) + '\n';
  for (const PartResult& of : found.parts)
    for (const LayoutResult& layout : of.result.layouts)
      text += fmt::format("{},{},{}\n", of.part.name, csv_number(layout.spacing_m),
                          csv_cells(layout, with_distances));
  return text;
}

}  // namespace fivepipe::study
