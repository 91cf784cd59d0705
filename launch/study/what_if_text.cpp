#include <fmt/format.h>

#include <cmath>

#include "common/base/text_table.h"
#include "launch/study/length.h"
#include "launch/study/what_if.h"

namespace fivepipe::study {
namespace {

// A length of which bounds are known.
std::string text_of_bracket(const Bracket& bracket) {
  if (!std::isfinite(bracket.max_m))
    return bracket.min_m > 0 ? "> " + text_of_length(bracket.min_m) : "unknown";
  return bracket.max_m > 0
             ? fmt::format("{:.1f} to {:.1f} cm", 100 * bracket.min_m, 100 * bracket.max_m)
             : "0";
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
    columns.push_back({"in the way by", true});
    columns.push_back({"clearance", true});
  }
  base::TextTable table(columns);
  for (const LayoutResult& layout : found.result.layouts) {
    std::vector<std::string> cells{
        text_of_length(layout.spacing_m),
        layout.colliding_frames > 0 ? fmt::format("{:.2f} s", layout.collision_s) : "-"};
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
      text += fmt::format("  {:.2f} to {:.2f} cm\n", 100 * i.low_m, 100 * i.high_m);
    const double least_m = least_free_above_m(found.result, options.range);
    text += std::isfinite(least_m)
                ? fmt::format("Least spacing above which all are free: {:.2f} cm\n", 100 * least_m)
                : "The largest spacings of the range are not free: try a longer range.\n";
  }
  for (const auto& [reason, count] : found.drops)
    text += fmt::format("Left out: {} ({})\n", reason, count);
  text +=
      "The visual hull is larger than the objects, so a free spacing is safe and a collision may "
      "be\nless deep. In another layout, a person would have moved differently.\n";
  return text;
}

nlohmann::ordered_json json_of(const WhatIf& found) {
  const WhatIfOptions& options = found.options;
  nlohmann::ordered_json json{
      {"recording", options.recording.string()},
      {"scene", found.scene},
      {"part", options.part},
      {"axis", {options.axis_world.x(), options.axis_world.y(), options.axis_world.z()}},
      {"frames", found.frames},
      {"duration_s", found.duration_s},
      {"range_m", {options.range.low_m, options.range.high_m}},
      {"least_free_above_m", json_of_length(least_free_above_m(found.result, options.range))},
      {"free_m", nlohmann::ordered_json::array()},
      {"drops", found.drops},
      {"layouts", nlohmann::ordered_json::array()}};
  for (const collision::SpacingInterval& i : found.result.free)
    json["free_m"].push_back({i.low_m, i.high_m});
  for (const LayoutResult& layout : found.result.layouts) {
    json["layouts"].push_back({{"spacing_m", layout.spacing_m},
                               {"colliding_frames", layout.colliding_frames},
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
  std::string text = "spacing_m,colliding_frames,collision_s";
  if (with_distances)
    text += ",penetration_min_m,penetration_max_m,clearance_min_m,clearance_max_m";
  text += '\n';
  for (const LayoutResult& layout : found.result.layouts) {
    text += fmt::format("{},{},{}", csv_number(layout.spacing_m), layout.colliding_frames,
                        csv_number(layout.collision_s));
    if (with_distances)
      for (const double value : {layout.penetration.min_m, layout.penetration.max_m,
                                 layout.clearance.min_m, layout.clearance.max_m})
        text += ',' + csv_number(value);
    text += '\n';
  }
  return text;
}

}  // namespace fivepipe::study
