#include "launch/study/results/session_results.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/collision/spacing/view_interval.h"
#include "common/recording/replay/recorded_frames.h"
#include "launch/study/recorded/recorded_hull.h"
#include "launch/study/results/error_band.h"
#include "launch/study/results/scene_parts.h"
#include "launch/units/length.h"

namespace fivepipe::study {
namespace {

using config::SceneObject;

// Collisions that are apart by no more are one event: a hand that slides along a part.
constexpr double kSameEvent_s = 0.25;
// The chart of the clearance shows this many times at most.
constexpr std::size_t kMaxTimes = 2000;
// Pictures of each part. The page contains them.
constexpr std::size_t kMaxPictures = 50;

// The spacing that the recording states for a time.
double spacing_at(const std::vector<RecordedSpacing>& spacings, double time_s, double before_m) {
  for (const RecordedSpacing& changed : spacings)
    if (changed.time_s <= time_s) before_m = changed.spacing_m;
  return before_m;
}

// The curves of several recordings are one, because all of them belong to the trial.
void add_curve(const SceneObject& object, const LineResult& line, report::Trial& trial) {
  const collision::SpacingInterval range{object.spacing->low_m, object.spacing->high_m};
  const auto known = std::ranges::find(trial.what_if, object.name, &report::WhatIfCurve::part);
  if (known == trial.what_if.end())
    trial.what_if.push_back({object.name, range, line, true});
  else if (known->range == range)
    add(known->result, line);
  else
    throw recording::RecordingError(object.name +
                                    " has another range than in the recording before");
}

report::PartResult& part_of(report::Trial& trial, const std::string& name) {
  for (report::PartResult& part : trial.parts)
    if (part.part == name) return part;
  return trial.parts.emplace_back(report::PartResult{.part = name, .events = {}});
}

TimelinePart timeline_part(const SceneObject& object) {
  const geometry::Mesh mesh = config::mesh_of(object);
  if (!object.spacing) return {mesh, PartDepth(mesh, object.world_from_object)};
  const config::Spacing& spacing = *object.spacing;
  return {mesh, PartDepth(mesh, pose_at_zero(object), spacing.axis_world,
                          {spacing.low_m, spacing.high_m})};
}

}  // namespace

SessionResults::SessionResults(const std::filesystem::path& file, const TrialRequest& request,
                               base::WorkerPool& pool, surface::SweptVolume* swept)
    : recording_(file),
      recorded_(recording_, {}),
      scene_(recorded_.deployment().scene),
      pool_(pool),
      swept_(swept),
      options_{.rule = recorded_.deployment().hull_rule,
               .eps_m = detection_eps_m(recorded_.deployment())} {
  std::vector<TimelinePart> parts;
  std::vector<Line> lines;
  for (const SceneObject& object : scene_.objects) {
    if (!is_rigid(object) || object.reaction == config::Reaction::none) continue;
    reported_.push_back(&object);
    parts.push_back(timeline_part(object));
    spacings_.push_back(recorded_spacings(recording_, object.name));
    if (!object.spacing) continue;
    const config::Spacing& spacing = *object.spacing;
    movable_.push_back(&object);
    lines.push_back({movable_part(object),
                     {spacing.low_m, spacing.high_m},
                     equally_spaced_m({spacing.low_m, spacing.high_m}, request.layouts)});
  }
  timeline_ = std::make_unique<SessionTimeline>(std::move(parts), options_, pool);
  study_ = std::make_unique<SpacingStudy>(std::move(lines), options_, pool);
}

void SessionResults::compute(const std::function<void(double done)>& progress) {
  replay::RecordedFrames frames(recording_, recorded_.deployment());
  std::vector<std::vector<hull::Silhouette>> waiting;
  while (auto frame = frames.next()) {
    const double time_s = 1e-9 * double(frame->set.capture_stamp_ns - recording_.start_ns());
    frames_.push_back(frame->set.frame);
    times_s_.push_back(time_s);
    durations_s_.push_back(frame->duration_s);
    TimelineFrame of_parts{frame->set.silhouettes, time_s, frame->duration_s, {}, {}};
    for (std::size_t i = 0; i < reported_.size(); ++i) {
      Eigen::Isometry3d pose = reported_[i]->world_from_object;
      double spacing_m = 0;
      if (const auto& spacing = reported_[i]->spacing) {
        spacing_m = spacing_at(spacings_[i], time_s, spacing->at_m);
        pose.translation() += spacing->move_world_m(spacing_m);
      }
      of_parts.world_from_part.push_back(pose);
      of_parts.spacings_m.push_back(spacing_m);
    }
    timeline_->add(std::move(of_parts));
    if (swept_) waiting.push_back(frame->set.silhouettes);
    if (waiting.size() == kFramesPerBatch) sweep(waiting);
    study_->add({std::move(frame->set.silhouettes), frame->duration_s});
    progress(frame->done);
  }
  if (swept_) sweep(waiting);
  if (frames_.empty()) throw recording::RecordingError(frames.why_none());
  drops_ = frames.drops();
  study_->results();
}

void SessionResults::add_remarks(const std::string& of, std::vector<std::string>& remarks) const {
  for (const auto& [reason, count] : drops_)
    remarks.push_back(fmt::format("{}: dropped of the recording: {} ({}).", of, reason, count));
  if (const std::string damage = recording_.mcap().damage().summary; !damage.empty())
    remarks.push_back(fmt::format(
        "{}: the recording is incomplete: {}; `fivepipe info {}` states what is missing.", of,
        damage, recording_.file().string()));
  if (study_->empty_frames() > 0)
    remarks.push_back(fmt::format("{}: frames without a hull: {} of {}.", of,
                                  study_->empty_frames(), study_->frames()));
  const std::vector<LineResult> lines = study_->results();
  for (std::size_t i = 0; i < movable_.size(); ++i) {
    if (lines[i].incomplete_frames > 0)
      remarks.push_back(fmt::format("{}: {}: in {} frames the search reached its limit.", of,
                                    movable_[i]->name, lines[i].incomplete_frames));
    const auto view = in_view(*movable_[i]);
    if (!view)
      remarks.push_back(fmt::format(
          "{}: nowhere in its range is the whole of {} in view of the cameras; what is outside "
          "counts as free because no hull can be there.",
          of, movable_[i]->name));
    else if (view->low_m > movable_[i]->spacing->low_m ||
             view->high_m < movable_[i]->spacing->high_m)
      remarks.push_back(fmt::format(
          "{}: the whole of {} is in view of the cameras from {} to {}; elsewhere, what is "
          "outside counts as free because no hull can be there.",
          of, movable_[i]->name, text_of_length(view->low_m), text_of_length(view->high_m)));
  }
}

void SessionResults::add_to(report::Trial& trial, double offset_s, const EventPictures* pictures) {
  const auto& timelines = timeline_->results();
  for (std::size_t i = 0; i < reported_.size(); ++i) {
    report::PartResult& part = part_of(trial, reported_[i]->name);
    add_timeline(timelines[i], *reported_[i], offset_s, pictures, part);
    add_spacings(i, offset_s, trial);
  }
  const std::vector<LineResult> lines = study_->results();
  for (std::size_t i = 0; i < movable_.size(); ++i) add_curve(*movable_[i], lines[i], trial);
  trial.duration_s = offset_s + duration_s();
}

// The spacings at which the whole part is where the hull can be.
std::optional<collision::SpacingInterval> SessionResults::in_view(const SceneObject& object) const {
  return collision::interval_in_view(
      movable_part(object), {object.spacing->low_m, object.spacing->high_m},
      limiting_cameras(recorded_.deployment()), options_.rule.within_world_m);
}

void SessionResults::sweep(std::vector<std::vector<hull::Silhouette>>& waiting) {
  run_frames(pool_, waiting.size(), [&](std::size_t frame, std::size_t) {
    FrameHull hull(options_.rule, options_.eps_m);
    hull.set(waiting[frame]);
    if (!hull.is_unknown() && !hull.is_empty()) swept_->add(*hull.query);
  });
  waiting.clear();
}

void SessionResults::add_timeline(const std::vector<TimelinePoint>& timeline,
                                  const SceneObject& object, double offset_s,
                                  const EventPictures* pictures, report::PartResult& part) {
  const double start_s = times_s_.front() - offset_s;
  for (std::size_t i = 0; i < timeline.size(); ++i)
    if (timeline[i].verdict == collision::CollisionVerdict::colliding)
      part.collision_s += durations_s_[i];
    else if (timeline[i].verdict == collision::CollisionVerdict::undecided)
      part.undecided_s += durations_s_[i];
  for (const CollisionEvent& found : collision_events(timeline, kSameEvent_s)) {
    report::Event event{times_s_[found.first] - start_s,
                        times_s_[found.last] + durations_s_[found.last] - start_s};
    event.penetration = max_penetration(timeline, found);
    // Of the colliding frame next to the center of the event.
    std::size_t shown = (found.first + found.last) / 2;
    while (timeline[shown].verdict != collision::CollisionVerdict::colliding) ++shown;
    if (pictures && part.events.size() < kMaxPictures)
      event.picture_png = pictures->png_of(frames_[shown]);
    if (!event.picture_png.empty())
      event.picture_shows = fmt::format("the viewer's picture at {:.1f} s: {} collides",
                                        times_s_[shown] - start_s, object.name);
    part.events.push_back(std::move(event));
  }
  if (!part.clearance) {
    part.clearance.emplace();
    part.clearance->cap_m = options_.clearance_cap_m;
    part.clearance->errors = error_sources(
        recorded_.deployment(),
        object.world_from_object * geometry::bounds_m(config::mesh_of(object)).center(),
        options_.eps_m);
  }
  // At each time of the chart, the smallest clearance of the frames that it stands for.
  const std::size_t per_time = (timeline.size() + kMaxTimes - 1) / kMaxTimes;
  for (std::size_t i = 0; i < timeline.size(); i += per_time) {
    Bracket smallest = timeline[i].clearance;
    for (std::size_t k = i; k < std::min(timeline.size(), i + per_time); ++k)
      smallest = {std::min(smallest.min_m, timeline[k].clearance.min_m),
                  std::min(smallest.max_m, timeline[k].clearance.max_m)};
    const double time_s = times_s_[i] - start_s;
    if (!part.clearance->times_s.empty() && time_s <= part.clearance->times_s.back()) continue;
    part.clearance->times_s.push_back(time_s);
    part.clearance->distances.push_back(smallest);
  }
}

void SessionResults::add_spacings(std::size_t reported, double offset_s,
                                  report::Trial& trial) const {
  const auto& spacing = reported_[reported]->spacing;
  if (!spacing) return;
  const double start_s = times_s_.front() - offset_s;
  const auto add = [&](double time_s, double spacing_m) {
    const auto last = std::ranges::find_if(
        trial.layout_changes.rbegin(), trial.layout_changes.rend(),
        [&](const report::LayoutChange& c) { return c.part == reported_[reported]->name; });
    if (last != trial.layout_changes.rend() && last->spacing_m == spacing_m) return;
    trial.layout_changes.push_back({time_s, reported_[reported]->name, spacing_m});
  };
  add(offset_s, spacing_at(spacings_[reported], times_s_.front(), spacing->at_m));
  for (const RecordedSpacing& changed : spacings_[reported])
    if (changed.time_s > times_s_.front()) add(changed.time_s - start_s, changed.spacing_m);
}

}  // namespace fivepipe::study
