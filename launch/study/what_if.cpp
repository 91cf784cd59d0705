#include "launch/study/what_if.h"

#include <algorithm>

#include "common/base/text_table.h"
#include "common/base/usage_error.h"
#include "common/collision/spacing/view_interval.h"
#include "common/recording/replay/recorded_deployment.h"
#include "common/recording/replay/recorded_frames.h"
#include "launch/study/recorded/recorded_hull.h"
#include "launch/study/recorded/recorded_spacings.h"

namespace fivepipe::study {
namespace {

const config::SceneObject& part_of(const config::Scene& scene, const std::string& name) {
  std::vector<std::string> names;
  for (const config::SceneObject& object : scene.objects) {
    if (object.name == name) {
      if (object.motion != config::Motion::fixed)
        throw base::UsageError(name + " moves by itself; a part of a layout has motion: fixed");
      return object;
    }
    if (object.motion == config::Motion::fixed) names.push_back(object.name);
  }
  throw base::UsageError("the scene " + scene.name + " has no part '" + name +
                         "'; it has: " + base::joined(names, ", "));
}

// The scene's spacing is along its axis: with another axis, `at` and range are not those of the
// scene.
WhatIfOptions with_values_of_scene(WhatIfOptions options, const config::SceneObject& object) {
  const bool has_spacing = options.axis_of_scene && object.spacing;
  if (options.range_of_scene && !has_spacing)
    throw base::UsageError(
        object.spacing
            ? "--range is required with --axis: the range of the scene is along its axis"
            : "--range is required: the part " + object.name + " has no `spacing` in the scene");
  if (!has_spacing) return options;
  const config::Spacing& spacing = *object.spacing;
  options.axis_world = spacing.axis_world;
  if (options.at_of_scene) options.at_m = spacing.at_m;
  if (options.range_of_scene) options.range = {spacing.low_m, spacing.high_m};
  return options;
}

}  // namespace

WhatIf what_if(const WhatIfOptions& given, const Progress& progress) {
  const recording::Recording recording(given.recording);
  const replay::RecordedDeployment recorded(recording, given.settings);
  const config::Deployment& deployment = recorded.deployment();
  const config::SceneObject& object = part_of(deployment.scene, given.part);
  const WhatIfOptions options = with_values_of_scene(given, object);

  // At spacing 0 the part is moved back by what the spacing is in the scene.
  Eigen::Isometry3d world_from_part = object.world_from_object;
  world_from_part.translation() -= options.at_m * options.axis_world.normalized();
  const collision::MovablePart part(config::mesh_of(object), world_from_part, options.axis_world);
  WhatIf found;
  found.options = options;
  found.scene = deployment.scene.name;
  found.eps_m = detection_eps_m(deployment);
  found.recorded = recorded_spacings(recording, options.part);
  found.damage = recording.mcap().damage().summary;
  found.in_view = collision::interval_in_view(part, options.range, limiting_cameras(deployment),
                                              deployment.hull_rule.within_world_m);
  std::vector<Line> lines;
  lines.push_back({part, options.range, equally_spaced_m(options.range, options.layouts),
                   options.with_distances});
  base::WorkerPool pool(options.threads);
  SpacingStudy study(std::move(lines), {.rule = deployment.hull_rule, .eps_m = found.eps_m}, pool);
  replay::RecordedFrames frames(recording, deployment);
  std::size_t computed = 0;
  while (auto frame = frames.next())
    if (const std::size_t now = study.add({std::move(frame->set.silhouettes), frame->duration_s});
        now > computed) {
      computed = now;
      progress(frame->done);
    }
  if (study.frames() == 0) {
    std::string why =
        options.recording.string() +
        " contains no complete frame: one map of each camera of the recorded rig that "
        "gives shape";
    for (const auto& [reason, count] : frames.drops())
      why += "; dropped: " + std::to_string(count) + " " + reason;
    if (!frames.first_fault().empty()) why += ", first: " + base::printable(frames.first_fault());
    throw recording::RecordingError(why);
  }
  found.result = study.results().front();
  progress(1);
  found.frames = study.frames();
  found.empty_frames = study.empty_frames();
  found.duration_s = study.duration_s();
  found.drops = frames.drops();
  return found;
}

}  // namespace fivepipe::study
