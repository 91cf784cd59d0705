#include "common/study/spacing_study.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <mutex>
#include <optional>
#include <stdexcept>

#include "common/collision/proximity/proximity.h"
#include "common/collision/spacing/gap_search.h"
#include "common/study/frame_hull.h"

namespace fivepipe::study {
namespace {

using collision::SpacingInterval;
using collision::SpacingVerdict;
using collision::SpacingVerdicts;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

constexpr double kMaxEps_m = 1;

void check(const Line& line) {
  const std::vector<double>& spacings_m = line.spacings_m;
  const bool is_valid =
      std::abs(line.range.low_m) <= collision::kMaxSpacing_m &&
      std::abs(line.range.high_m) <= collision::kMaxSpacing_m &&
      line.range.low_m <= line.range.high_m && std::ranges::is_sorted(spacings_m) &&
      std::ranges::all_of(
          spacings_m, [&](double s) { return s >= line.range.low_m && s <= line.range.high_m; });
  if (!is_valid)
    throw std::invalid_argument("study: spacings must ascend and be in a range within 1 km");
}

// The intervals that are in both lists.
std::vector<SpacingInterval> in_both(const std::vector<SpacingInterval>& a,
                                     const std::vector<SpacingInterval>& b) {
  std::vector<SpacingInterval> both;
  for (std::size_t i = 0, k = 0; i < a.size() && k < b.size();) {
    const SpacingInterval common{std::max(a[i].low_m, b[k].low_m),
                                 std::min(a[i].high_m, b[k].high_m)};
    if (common.low_m <= common.high_m) both.push_back(common);
    (a[i].high_m < b[k].high_m ? i : k) += 1;
  }
  return both;
}

// Distance to the nearest spacing that the list holds; infinity if it is empty.
double distance_to(const std::vector<SpacingInterval>& list, double spacing_m) {
  double distance_m = kInfinity;
  for (const SpacingInterval& i : list)
    distance_m = std::min(distance_m, std::max({0.0, i.low_m - spacing_m, spacing_m - i.high_m}));
  return distance_m;
}

// Lower bound of the distance to the nearest spacing of the range at which the part is free: to the
// end of the interval in which the part touches the hull throughout.
double certified_depth_m(const SpacingVerdicts& verdicts, const SpacingInterval& range,
                         double spacing_m) {
  for (const SpacingInterval& i : verdicts.touching) {
    if (spacing_m < i.low_m || spacing_m > i.high_m) continue;
    // Beyond the range there is no layout.
    const double below_m = i.low_m > range.low_m ? spacing_m - i.low_m : kInfinity,
                 above_m = i.high_m < range.high_m ? i.high_m - spacing_m : kInfinity;
    return std::min(below_m, above_m);
  }
  return 0;
}

}  // namespace

// One frame of one line.
struct SpacingStudy::LineFrame {
  SpacingVerdicts verdicts;
  std::vector<bool> collides, is_undecided;  // per layout
  std::vector<Bracket> clearances;           // per layout, if requested
  std::vector<Bracket> penetrations;         // per layout, if requested
};

std::vector<double> equally_spaced_m(const SpacingInterval& range, int count) {
  std::vector<double> spacings_m;
  for (int i = 0; i < count; ++i)
    spacings_m.push_back(
        count == 1
            ? range.low_m
            : std::min(range.high_m, range.low_m + (range.high_m - range.low_m) * i / (count - 1)));
  return spacings_m;
}

void check(const StudyOptions& options) {
  if (!(options.clearance_cap_m > 0 && std::isfinite(options.clearance_cap_m) &&
        options.tolerance_m > 0 && options.eps_m <= kMaxEps_m &&
        options.eps_m >= collision::kMinEps_m))
    throw std::invalid_argument("study: clearance_cap_m, tolerance_m or eps_m is out of range");
}

void run_frames(base::WorkerPool& pool, std::size_t frames,
                const std::function<void(std::size_t frame, std::size_t thread)>& compute) {
  std::mutex mutex;
  std::exception_ptr failure;
  pool.run(int(frames), [&](int frame, int thread) {
    try {
      compute(std::size_t(frame), std::size_t(thread));
    } catch (...) {
      const std::lock_guard lock(mutex);
      if (!failure) failure = std::current_exception();
    }
  });
  if (failure) std::rethrow_exception(failure);
}

SpacingStudy::SpacingStudy(std::vector<Line> lines, const StudyOptions& options,
                           base::WorkerPool& pool, std::vector<JointLayout> joint_layouts)
    : lines_(std::move(lines)),
      options_(options),
      pool_(pool),
      joint_layouts_(std::move(joint_layouts)),
      joint_results_(joint_layouts_.size()) {
  check(options);
  for (const JointLayout& layout : joint_layouts_)
    for (const auto& [line, spacing] : layout)
      if (line >= lines_.size() || spacing >= lines_[line].spacings_m.size())
        throw std::invalid_argument("study: a joint layout has a place that is on no line");
  for (const Line& line : lines_) {
    check(line);
    LineResult& result = results_.emplace_back();
    result.free = {line.range};
    for (const double spacing_m : line.spacings_m)
      result.layouts.push_back(
          {.spacing_m = spacing_m, .clearance = {options.clearance_cap_m, kInfinity}});
  }
  for (int i = 0; i < pool.threads(); ++i)
    hulls_.push_back(std::make_unique<FrameHull>(options.rule, options.eps_m));
}

SpacingStudy::~SpacingStudy() = default;

std::size_t SpacingStudy::add(StudyFrame frame) {
  ++frames_;
  duration_s_ += frame.duration_s;
  waiting_.push_back(std::move(frame));
  if (waiting_.size() == kFramesPerBatch) compute();
  return frames_ - waiting_.size();
}

std::vector<LineResult> SpacingStudy::results() {
  compute();
  return results_;
}

void SpacingStudy::compute() {
  std::vector<std::vector<LineFrame>> found(waiting_.size());
  std::vector<char> is_empty(waiting_.size());
  std::mutex mutex;
  std::size_t computed = 0;
  run_frames(pool_, waiting_.size(), [&](std::size_t frame, std::size_t thread) {
    FrameHull& hull = *hulls_[thread];
    hull.set(waiting_[frame].silhouettes);
    is_empty[frame] = hull.is_empty();
    for (std::size_t line = 0; line < lines_.size(); ++line)
      found[frame].push_back(frame_of(hull, line));
    if (!on_frame_) return;
    const std::lock_guard lock(mutex);
    on_frame_(++computed);
  });
  for (std::size_t frame = 0; frame < found.size(); ++frame) {
    for (std::size_t line = 0; line < lines_.size(); ++line)
      fold(line, found[frame][line], waiting_[frame].duration_s);
    fold_joint(found[frame], waiting_[frame].duration_s);
  }
  empty_frames_ += std::size_t(std::ranges::count(is_empty, 1));
  waiting_.clear();
}

SpacingStudy::LineFrame SpacingStudy::frame_of(FrameHull& hull, std::size_t index) const {
  const Line& line = lines_[index];
  LineFrame found;
  // Balls of twice eps_m are collisions that the detector finds, too.
  found.verdicts =
      collision::SpacingSweep(*hull.query, {.solid_m = 2 * options_.eps_m})(line.part, line.range);
  for (const double spacing_m : line.spacings_m) {
    const SpacingVerdict verdict = collision::verdict_at(found.verdicts, spacing_m);
    bool collides = verdict == SpacingVerdict::colliding;
    bool is_undecided = verdict == SpacingVerdict::undecided;
    if (is_undecided && !hull.is_unknown()) {
      const collision::DetectionObject object{&line.part.tree(), line.part.pose(spacing_m)};
      const collision::CollisionVerdict detected = hull.detector->detect({&object, 1})[0].verdict;
      collides = detected == collision::CollisionVerdict::colliding;
      is_undecided = detected == collision::CollisionVerdict::undecided;
    }
    found.collides.push_back(collides);
    found.is_undecided.push_back(is_undecided);
  }
  if (!line.with_distances) return found;

  if (!hull.is_unknown())
    collision::narrow_gaps(found.verdicts, line.part, line.range, *hull.query, *hull.detector);
  std::optional<collision::HullProximity> proximity;  // only if a distance is searched for
  const std::vector<LayoutResult>& before = results_[index].layouts;
  // Of the layouts so far: largest lower bound of the clearance plus the spacing.
  double reach_m = -kInfinity;
  for (std::size_t i = 0; i < line.spacings_m.size(); ++i) {
    const double spacing_m = line.spacings_m[i];
    const double to_free_m = distance_to(found.verdicts.free, spacing_m);
    found.penetrations.push_back(
        found.collides[i]
            ? Bracket{certified_depth_m(found.verdicts, line.range, spacing_m), to_free_m}
        : found.is_undecided[i] ? Bracket{0, to_free_m}
                                : Bracket{0, 0});
    if (found.collides[i]) {
      found.clearances.push_back({0, 0});
      continue;
    }
    const double enough_m = before[i].clearance.max_m;
    // From the layouts before, whose spacings are smaller.
    const double known_m = std::max(0.0, reach_m - spacing_m);
    if (known_m >= std::min(enough_m, options_.clearance_cap_m)) {
      found.clearances.push_back({known_m, kInfinity});
      continue;
    }
    if (!proximity)
      proximity.emplace(
          *hull.query, collision::ProximityOptions{options_.clearance_cap_m, options_.tolerance_m});
    const collision::Proximity p =
        proximity->of_part(line.part.tree(), line.part.pose(spacing_m), enough_m);
    found.clearances.push_back({p.min_m, p.max_m});
    reach_m = std::max(reach_m, p.min_m + spacing_m);
  }
  return found;
}

void SpacingStudy::fold(std::size_t index, const LineFrame& found, double duration_s) {
  LineResult& result = results_[index];
  result.free = in_both(result.free, found.verdicts.free);
  result.incomplete_frames += !found.verdicts.is_complete;
  for (std::size_t i = 0; i < result.layouts.size(); ++i) {
    LayoutResult& layout = result.layouts[i];
    if (found.collides[i]) {
      ++layout.colliding_frames;
      layout.collision_s += duration_s;
    }
    layout.undecided_frames += found.is_undecided[i];
    if (!lines_[index].with_distances) continue;
    const Bracket &clearance = found.clearances[i], &penetration = found.penetrations[i];
    layout.clearance = {std::min(layout.clearance.min_m, clearance.min_m),
                        std::min(layout.clearance.max_m, clearance.max_m)};
    layout.penetration = {std::max(layout.penetration.min_m, penetration.min_m),
                          std::max(layout.penetration.max_m, penetration.max_m)};
  }
}

void SpacingStudy::fold_joint(const std::vector<LineFrame>& found, double duration_s) {
  for (std::size_t i = 0; i < joint_layouts_.size(); ++i) {
    bool collides = false, is_undecided = false;
    for (const auto& [line, spacing] : joint_layouts_[i]) {
      collides = collides || found[line].collides[spacing];
      is_undecided = is_undecided || found[line].is_undecided[spacing];
    }
    LayoutResult& result = joint_results_[i];
    result.colliding_frames += collides;
    result.collision_s += collides ? duration_s : 0;
    result.undecided_frames += !collides && is_undecided;
  }
}

std::vector<LayoutResult> SpacingStudy::joint_results() const {
  std::vector<LayoutResult> results = joint_results_;
  for (std::size_t i = 0; i < results.size(); ++i) {
    Bracket &clearance = results[i].clearance, &penetration = results[i].penetration;
    clearance = {options_.clearance_cap_m, kInfinity};
    for (const auto& [line, spacing] : joint_layouts_[i]) {
      const LayoutResult& part = results_[line].layouts[spacing];
      clearance = {std::min(clearance.min_m, part.clearance.min_m),
                   std::min(clearance.max_m, part.clearance.max_m)};
      penetration = {std::max(penetration.min_m, part.penetration.min_m),
                     std::max(penetration.max_m, part.penetration.max_m)};
    }
  }
  return results;
}

void add(LineResult& result, const LineResult& of_other_frames) {
  result.free = in_both(result.free, of_other_frames.free);
  result.incomplete_frames += of_other_frames.incomplete_frames;
  for (std::size_t i = 0; i < result.layouts.size(); ++i) {
    LayoutResult& layout = result.layouts[i];
    const LayoutResult& other = of_other_frames.layouts.at(i);
    layout.colliding_frames += other.colliding_frames;
    layout.undecided_frames += other.undecided_frames;
    layout.collision_s += other.collision_s;
    layout.clearance = {std::min(layout.clearance.min_m, other.clearance.min_m),
                        std::min(layout.clearance.max_m, other.clearance.max_m)};
    layout.penetration = {std::max(layout.penetration.min_m, other.penetration.min_m),
                          std::max(layout.penetration.max_m, other.penetration.max_m)};
  }
}

double min_free_spacing_m(const LineResult& result, const SpacingInterval& range) {
  return !result.free.empty() && result.free.back().high_m >= range.high_m
             ? result.free.back().low_m
             : kInfinity;
}

}  // namespace fivepipe::study
