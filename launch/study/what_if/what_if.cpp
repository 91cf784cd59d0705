#include "launch/study/what_if/what_if.h"

#include <algorithm>

#include "common/base/text_table.h"
#include "common/base/usage_error.h"
#include "common/collision/spacing/view_interval.h"
#include "common/config/mesh/mesh_file.h"
#include "common/recording/replay/recorded_deployment.h"
#include "common/recording/replay/recorded_frames.h"
#include "launch/study/recorded/recorded_hull.h"
#include "launch/study/recorded/recorded_spacings.h"
#include "launch/study/what_if/study_lines.h"

namespace fivepipe::study {
namespace {

const config::SceneObject& object_of(const config::Scene& scene, const std::string& name) {
  std::vector<std::string> names;
  for (const config::SceneObject& object : scene.objects) {
    if (object.name == name) {
      if (object.motion != config::Motion::fixed)
        throw base::UsageError(name + " moves by itself; a part of a layout has motion: fixed");
      return object;
    }
    if (object.motion == config::Motion::fixed) names.push_back(object.name);
  }
  throw base::UsageError("the scene " + scene.name + " has no part '" + name + "'; it has: " +
                         base::joined(names, ", ") + ". A new part needs --mesh FILE,UNIT");
}

config::SceneObject object_of(const WhatIfPart& part, const config::Scene& scene) {
  if (!part.added) return object_of(scene, part.name);
  for (const config::SceneObject& object : scene.objects)
    if (object.name == part.name)
      throw base::UsageError("--mesh: the scene " + scene.name + " already has an object '" +
                             part.name + "'; give the new part another name");
  config::MeshOrReason read = config::read_mesh(part.added->file, part.added->unit_m);
  if (!read.reason.empty())
    throw base::UsageError("mesh " + part.added->file.string() + ": " + read.reason);
  config::SceneObject object;
  object.name = part.name;
  object.shape = config::MeshShape{part.added->file, part.added->unit_m, std::move(read.mesh)};
  object.world_from_object = part.added->world_from_mesh;
  return object;
}

// The scene's spacing is along its axis: with another axis, `at` and range are not those of the
// scene.
WhatIfPart with_values_of_scene(WhatIfPart part, const config::SceneObject& object,
                                bool needs_range) {
  const bool has_spacing = part.axis_of_scene && object.spacing;
  if (has_spacing) {
    const config::Spacing& spacing = *object.spacing;
    part.axis_world = spacing.axis_world;
    if (part.at_of_scene) part.at_m = spacing.at_m;
    if (part.range_of_scene) part.range = {spacing.low_m, spacing.high_m};
  } else if (part.range_of_scene) {
    if (needs_range && !part.added)
      throw base::UsageError(
          object.spacing
              ? "--range is required with --axis: the range of the scene is along its axis"
              : "--range is required: the part " + object.name + " has no `spacing` in the scene");
    part.range = {part.at_m, part.at_m};
  }
  return part;
}

PartOnLine on_line(const WhatIfPart& given, const config::SceneObject& object, bool needs_range) {
  const WhatIfPart part = with_values_of_scene(given, object, needs_range);
  // At spacing 0 the part is moved back by what the spacing is in the scene.
  Eigen::Isometry3d world_from_part = object.world_from_object;
  world_from_part.translation() -= part.at_m * part.axis_world.normalized();
  return {part, {config::mesh_of(object), world_from_part, part.axis_world}};
}

// What the study computes: the given parts, and those of the table.
class WhatIfParts {
 public:
  WhatIfParts(const WhatIfOptions& options, const config::Scene& scene,
              const Eigen::AlignedBox3d& volume_m) {
    std::vector<WhatIfPart> given = options.parts;
    if (options.table)
      for (const LayoutTable::Column& column : options.table->columns)
        if (std::ranges::find(given, column.part, &WhatIfPart::name) == given.end())
          given.push_back({.name = column.part,
                           .axis_of_scene = true,
                           .at_of_scene = true,
                           .range_of_scene = true});
    config::Scene added;
    for (const WhatIfPart& part : given) {
      const config::SceneObject object = object_of(part, scene);
      if (options.table && !part.added) require_axis(*options.table, part, object);
      all_.push_back(on_line(part, object, !options.table));
      sizes_m_.push_back(geometry::bounds_m(config::mesh_of(object)).sizes());
      if (part.added) added.objects.push_back(object);
    }
    warnings_ = config::mesh_warnings(added, volume_m);
  }

  const std::vector<PartOnLine>& all() const { return all_; }
  const std::vector<std::string>& warnings() const { return warnings_; }
  const Eigen::Vector3d& size_m(std::size_t part) const { return sizes_m_[part]; }

  StudyLines lines(const WhatIfOptions& options) const {
    const double margin_m = StudyOptions().clearance_cap_m;
    if (!options.table) {
      StudyLines lines = lines_of_ranges(all_, options.layouts, options.with_distances, margin_m);
      // The curves of a single part show its layouts, if it has several.
      if (options.with_combinations && (all_.size() > 1 || lines.lines[0].spacings_m.size() == 1))
        add_combinations(lines, all_, kMaxCombinations);
      return lines;
    }
    std::map<std::string, PartOnLine> by_name;
    for (const PartOnLine& part : all_) by_name.emplace(part.part.name, part);
    return lines_of_table(*options.table, by_name, options.with_distances, margin_m);
  }

 private:
  // A spacing needs an axis: one that was given, or that of the scene.
  static void require_axis(const LayoutTable& table, const WhatIfPart& part,
                           const config::SceneObject& object) {
    const bool has_spacing = std::ranges::any_of(table.columns, [&](const auto& column) {
      return column.part == part.name && column.axis < 0;
    });
    if (has_spacing && part.axis_of_scene && !object.spacing)
      throw base::UsageError(table.file.string() + ": column " + part.name +
                             ": the part has no "
                             "`spacing` in the scene; write " +
                             part.name +
                             ".x, .y or .z, or "
                             "give its axis: --part " +
                             part.name + " --axis z");
  }

  std::vector<PartOnLine> all_;
  std::vector<Eigen::Vector3d> sizes_m_;
  std::vector<std::string> warnings_;
};

// Adds all frames of the recording to the study.
void add_frames(replay::RecordedFrames& frames, SpacingStudy& study, const Progress& progress) {
  // The frames of a batch are computed when it is full: `done` of the one before is known.
  double done = 0, reached = 0;
  study.on_frame([&](std::size_t computed) {
    progress(reached + (done - reached) * double(computed) / double(kFramesPerBatch));
  });
  std::size_t computed = 0;
  while (auto frame = frames.next()) {
    done = frame->done;
    if (const std::size_t now = study.add({std::move(frame->set.silhouettes), frame->duration_s});
        now > computed) {
      computed = now;
      reached = done;
      progress(done);
    }
  }
  study.results();
  study.on_frame({});
}

// The line of a part with one spacing goes beyond its range.
void clip(std::vector<collision::SpacingInterval>& intervals,
          const collision::SpacingInterval& range) {
  for (collision::SpacingInterval& i : intervals)
    i = {std::max(i.low_m, range.low_m), std::min(i.high_m, range.high_m)};
  std::erase_if(intervals, [](const auto& i) { return i.low_m > i.high_m; });
}

// One per joint layout.
std::vector<RowResult> rows_of(const StudyLines& lines, const std::vector<LineResult>& results,
                               const std::vector<LayoutResult>& layouts) {
  std::vector<RowResult> rows;
  for (std::size_t row = 0; row < layouts.size(); ++row) {
    rows.push_back({layouts[row]});
    for (std::size_t i = 0; i < lines.joint_layouts[row].size(); ++i) {
      const auto& [line, spacing] = lines.joint_layouts[row][i];
      if (results[line].layouts[spacing].colliding_frames > 0)
        rows.back().colliding_parts.push_back(lines.parts[row][i]);
      rows.back().spacings_m.push_back(results[line].layouts[spacing].spacing_m);
    }
  }
  return rows;
}

}  // namespace

WhatIf what_if(const WhatIfOptions& options, const Progress& progress) {
  const recording::Recording recording(options.recording);
  const replay::RecordedDeployment recorded(recording, options.settings);
  const config::Deployment& deployment = recorded.deployment();
  const WhatIfParts parts(options, deployment.scene, deployment.rig.volume_m);
  const StudyLines lines = parts.lines(options);
  WhatIf found;
  found.options = options;
  found.scene = deployment.scene.name;
  found.eps_m = detection_eps_m(deployment);
  found.damage = recording.mcap().damage().summary;
  found.warnings = parts.warnings();
  base::WorkerPool pool(options.threads);
  SpacingStudy study(lines.lines, {.rule = deployment.hull_rule, .eps_m = found.eps_m}, pool,
                     lines.joint_layouts);
  replay::RecordedFrames frames(recording, deployment);
  add_frames(frames, study, progress);
  if (study.frames() == 0) throw recording::RecordingError(frames.why_none());
  const std::vector<LineResult> results = study.results();
  progress(1);
  for (const LineResult& result : results)
    found.incomplete_frames = std::max(found.incomplete_frames, result.incomplete_frames);
  (options.table ? found.rows : found.combinations) =
      rows_of(lines, results, study.joint_results());
  if (!options.table)
    for (std::size_t i = 0; i < results.size(); ++i) {
      const auto& [part, movable] = parts.all()[i];
      found.parts.push_back(
          {part, parts.size_m(i), recorded_spacings(recording, part.name),
           collision::interval_in_view(movable, part.range, limiting_cameras(deployment),
                                       deployment.hull_rule.within_world_m),
           results[i]});
      clip(found.parts.back().result.free, part.range);
    }
  found.frames = study.frames();
  found.empty_frames = study.empty_frames();
  found.duration_s = study.duration_s();
  found.drops = frames.drops();
  return found;
}

}  // namespace fivepipe::study
