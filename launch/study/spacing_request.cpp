#include "launch/study/spacing_request.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <vector>

#include "common/base/usage_error.h"
#include "launch/units/length.h"

namespace fivepipe::study {
namespace {

struct Requested {
  double length_m = 0;
  bool is_step = false;
};

Requested parsed(const std::string& text) {
  const bool is_step = text.starts_with('+') || text.starts_with('-');
  const std::optional<double> length = length_m(text.substr(text.starts_with('=') ? 1 : 0));
  if (!length)
    throw base::UsageError("'" + text +
                           "' is no spacing; write a number and its unit, such as 18cm, or a step, "
                           "such as +5mm");
  return {*length, is_step};
}

}  // namespace

std::vector<const config::SceneObject*> movable_parts(const config::Scene& scene) {
  std::vector<const config::SceneObject*> parts;
  for (const config::SceneObject& object : scene.objects)
    if (object.spacing) parts.push_back(&object);
  if (parts.empty())
    throw base::UsageError("no object of scene " + scene.name +
                           " can be moved: add `spacing` to one in " + scene.file.string());
  return parts;
}

const config::SceneObject& movable_part(const config::Scene& scene, const std::string& name) {
  const std::vector<const config::SceneObject*> parts = movable_parts(scene);
  if (name.empty() && parts.size() == 1) return *parts.front();
  std::vector<std::string> names;
  for (const config::SceneObject* part : parts) {
    if (part->name == name) return *part;
    names.push_back(part->name);
  }
  if (name.empty())
    throw base::UsageError(fmt::format("several parts can be moved: select one by --part: {}",
                                       fmt::join(names, ", ")));
  throw base::UsageError(fmt::format("--part: '{}' is no object with `spacing`; there is {}", name,
                                     fmt::join(names, ", ")));
}

void check_spacing_text(const std::string& text) { parsed(text); }

double requested_spacing_m(const std::string& text, double before_m,
                           const config::SceneObject& part) {
  const Requested requested = parsed(text);
  const double wanted_m = requested.length_m + (requested.is_step ? before_m : 0);
  if (!part.spacing->permits(wanted_m))
    throw base::UsageError(fmt::format("{} is outside of the range of {}: {}",
                                       text_of_length(wanted_m), part.name,
                                       text_of_range(*part.spacing)));
  return wanted_m;
}

std::string text_of_range(const config::Spacing& spacing) {
  return text_of_length(spacing.low_m) + " to " + text_of_length(spacing.high_m);
}

}  // namespace fivepipe::study
