#include "common/config/objects/spacing_reader.h"

#include <fmt/format.h>

namespace fivepipe::config {
namespace {

constexpr Range kSpacing_m{-kMaxSpacing_m, kMaxSpacing_m};

Spacing read_spacing_of(YamlMap map) {
  Spacing spacing;
  if (map.has("axis")) {
    if (const auto axis = map.direction("axis")) spacing.axis_world = axis->normalized();
  } else {
    map.vector3("axis", kAny);  // reports that it is missing
  }
  spacing.at_m = map.number("at_m", kSpacing_m);
  const auto range_m = map.interval("range_m", kSpacing_m);
  map.finish();
  if (!range_m || !map.has("at_m")) return spacing;
  spacing.low_m = (*range_m)[0];
  spacing.high_m = (*range_m)[1];
  if (!(spacing.low_m < spacing.high_m))
    map.problem_at("range_m",
                   fmt::format("range_m must be [FROM, TO] with FROM < TO, is [{:g}, {:g}]",
                               spacing.low_m, spacing.high_m));
  else if (!spacing.permits(spacing.at_m))
    map.problem_at("at_m", fmt::format("at_m must be in range_m [{:g}, {:g}], is {:g}",
                                       spacing.low_m, spacing.high_m, spacing.at_m));
  return spacing;
}

}  // namespace

std::optional<Spacing> read_spacing(YamlMap& object, bool is_fixed) {
  if (!object.has("spacing")) return std::nullopt;
  if (!is_fixed)
    object.problem_at("spacing",
                      "spacing needs motion fixed: the simulation moves the other objects itself");
  return read_spacing_of(object.map("spacing"));
}

}  // namespace fivepipe::config
