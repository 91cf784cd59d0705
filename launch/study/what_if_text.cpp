#include <fmt/format.h>

#include <cmath>

#include "common/base/text_table.h"
#include "common/base/version.h"
#include "launch/study/what_if.h"
#include "launch/units/length.h"

namespace fivepipe::study {
namespace {

// Part of the last decimal: of a bound that is exact in decimals.
constexpr double kRounding = 1e-6;

// Lengths in cm with two decimals, rounded so that the statement stays true.
std::string at_least(double length_m) {
  return fmt::format("{:.2f}", std::floor(1e4 * length_m + kRounding) / 100);
}
std::string at_most(double length_m) {
  return fmt::format("{:.2f}", std::ceil(1e4 * length_m - kRounding) / 100);
}

// A length of which bounds are known.
std::string text_of_bracket(const Bracket& bracket) {
  if (std::isinf(bracket.min_m)) return "whole range";
  if (std::isinf(bracket.max_m))
    return bracket.min_m > 0 ? "at least " + at_least(bracket.min_m) + " cm" : "unknown";
  return bracket.max_m > 0 ? at_least(bracket.min_m) + " to " + at_most(bracket.max_m) + " cm"
                           : "0";
}

// The spacings of the part while the session was recorded; empty if nobody moved it.
std::string recorded_text(const WhatIf& found) {
  if (found.recorded.size() < 2) return "";
  std::string text = "Recorded with " + found.options.part + " at ";
  for (std::size_t i = 0; i < found.recorded.size(); ++i)
    text += fmt::format("{}{}{}", i > 0 ? ", " : "", text_of_length(found.recorded[i].spacing_m),
                        i > 0 ? fmt::format(" from {:.1f} s on", found.recorded[i].time_s) : "");
  return text + ". The table does not depend on it.\n";
}

// What limits the results.
std::string notes_of(const WhatIf& found) {
  const collision::SpacingInterval& range = found.options.range;
  std::string notes = recorded_text(found);
  if (!found.in_view)
    notes +=
        "Nowhere in the range is the whole part in view of the cameras and in the volume: what is "
        "outside\nis free because no hull can be there.\n";
  else if (found.in_view->low_m > range.low_m || found.in_view->high_m < range.high_m)
    notes += fmt::format(
        "The whole part is in view of the cameras and in the volume from {} to {} cm. Elsewhere, "
        "what is\noutside is free because no hull can be there.\n",
        at_most(found.in_view->low_m), at_least(found.in_view->high_m));
  if (found.empty_frames > 0)
    notes += fmt::format("Frames without a hull: {} of {}.\n", found.empty_frames, found.frames);
  if (found.result.incomplete_frames > 0)
    notes += fmt::format(
        "In {} frames the search reached its limit and left more undecided: the part is very near "
        "to "
        "the\nhull along the range.\n",
        found.result.incomplete_frames);
  for (const auto& [reason, count] : found.drops)
    notes += fmt::format("Dropped of the recording: {} ({}).\n", reason, count);
  if (!found.damage.empty())
    notes += base::printable(found.damage) + ": only what could be read was studied.\n";
  return notes;
}

// null instead of infinity, which JSON does not have.
nlohmann::ordered_json json_of_length(double length_m) {
  return std::isfinite(length_m) ? nlohmann::ordered_json(length_m) : nullptr;
}

nlohmann::ordered_json json_of_bracket(const Bracket& bracket) {
  return {{"min", json_of_length(bracket.min_m)}, {"max", json_of_length(bracket.max_m)}};
}

std::string csv_number(double value) {
  return std::isfinite(value) ? fmt::format("{:.6g}", value) : "";
}

}  // namespace

std::string text_of(const WhatIf& found) {
  const WhatIfOptions& options = found.options;
  std::string text = fmt::format(
      "{}: {} frames, {:.1f} s; part {} of scene {}, spacing {} to {}\n\n",
      options.recording.string(), found.frames, found.duration_s, options.part, found.scene,
      text_of_length(options.range.low_m), text_of_length(options.range.high_m));
  std::vector<base::TextTable::Column> columns{{"spacing", true}, {"collides", true}};
  if (options.with_distances) {
    columns.push_back({"penetration", true});
    columns.push_back({"clearance", true});
  }
  base::TextTable table(columns);
  for (const LayoutResult& layout : found.result.layouts) {
    std::vector<std::string> cells{fmt::format("{:.2f} cm", 100 * layout.spacing_m),
                                   layout.colliding_frames > 0
                                       ? fmt::format("{:.2f} s", layout.collision_s)
                                   : layout.undecided_frames > 0 ? "undecided"
                                                                 : "-"};
    if (options.with_distances) {
      cells.push_back(layout.colliding_frames > 0 ? text_of_bracket(layout.penetration) : "-");
      cells.push_back(text_of_bracket(layout.clearance));
    }
    table.add(cells);
  }
  text += table.text() + '\n';
  if (found.result.free.empty()) {
    text += "No spacing of the range is free in all frames.\n";
  } else {
    text += "Free in all frames, certified at every spacing between the ends:\n";
    for (const collision::SpacingInterval& i : found.result.free)
      text += fmt::format("  {} to {} cm\n", at_most(i.low_m), at_least(i.high_m));
    const double min_m = min_free_spacing_m(found.result, options.range);
    text += std::isfinite(min_m)
                ? "Minimum spacing above which all are free: " + at_most(min_m) + " cm\n"
                : "The largest spacings of the range are not free: try a longer range.\n";
  }
  return text + notes_of(found) +
         "The visual hull is larger than the objects, so a collision may be less deep or not "
         "exist. In\nanother layout, a person would have moved differently.\n";
}

nlohmann::ordered_json json_of(const WhatIf& found) {
  const WhatIfOptions& options = found.options;
  nlohmann::ordered_json json{
      {"recording", options.recording.string()},
      {"scene", found.scene},
      {"part", options.part},
      {"at_m", options.at_m},
      {"axis", {options.axis_world.x(), options.axis_world.y(), options.axis_world.z()}},
      {"settings", options.settings},
      {"eps_m", found.eps_m},
      {"version", base::version()},
      {"frames", found.frames},
      {"frames_without_hull", found.empty_frames},
      {"incomplete_frames", found.result.incomplete_frames},
      {"duration_s", found.duration_s},
      {"range_m", {options.range.low_m, options.range.high_m}},
      {"in_view_m", nullptr},
      {"min_free_spacing_m", json_of_length(min_free_spacing_m(found.result, options.range))},
      {"free_m", nlohmann::ordered_json::array()},
      {"drops", found.drops},
      {"damage", found.damage},
      {"recorded", nlohmann::ordered_json::array()},
      {"layouts", nlohmann::ordered_json::array()}};
  for (const RecordedSpacing& spacing : found.recorded)
    json["recorded"].push_back({{"time_s", spacing.time_s}, {"spacing_m", spacing.spacing_m}});
  if (found.in_view) json["in_view_m"] = {found.in_view->low_m, found.in_view->high_m};
  for (const collision::SpacingInterval& i : found.result.free)
    json["free_m"].push_back({i.low_m, i.high_m});
  for (const LayoutResult& layout : found.result.layouts) {
    json["layouts"].push_back({{"spacing_m", layout.spacing_m},
                               {"colliding_frames", layout.colliding_frames},
                               {"undecided_frames", layout.undecided_frames},
                               {"collision_s", layout.collision_s}});
    if (options.with_distances) {
      json["layouts"].back()["penetration_m"] = json_of_bracket(layout.penetration);
      json["layouts"].back()["clearance_m"] = json_of_bracket(layout.clearance);
    }
  }
  return json;
}

std::string csv_of(const WhatIf& found) {
  const bool with_distances = found.options.with_distances;
  std::string text = "spacing_m,colliding_frames,undecided_frames,collision_s";
  if (with_distances)
    text += ",penetration_min_m,penetration_max_m,clearance_min_m,clearance_max_m";
  text += '\n';
  for (const LayoutResult& layout : found.result.layouts) {
    text += fmt::format("{},{},{},{}", csv_number(layout.spacing_m), layout.colliding_frames,
                        layout.undecided_frames, csv_number(layout.collision_s));
    if (with_distances)
      for (const double value : {layout.penetration.min_m, layout.penetration.max_m,
                                 layout.clearance.min_m, layout.clearance.max_m})
        text += ',' + csv_number(value);
    text += '\n';
  }
  return text;
}

}  // namespace fivepipe::study
