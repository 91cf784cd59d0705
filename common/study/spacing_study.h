// What-if: in which layouts would the real objects of recorded frames have collided with a movable
// part?
//
// Each frame's hull is prepared once for all layouts. A sweep (common/collision/spacing) certifies
// whole intervals of spacing; only layouts in its undecided gaps are detected one by one. Distances
// are certified by HullProximity, and a distance at one spacing bounds those at others, because
// moving the part by d changes its distance by at most d.
#pragma once
#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "common/base/worker_pool.h"
#include "common/collision/detection/detection.h"
#include "common/collision/spacing/spacing_sweep.h"
#include "common/hull/hull.h"

namespace fivepipe::study {

struct FrameHull;

// One part on one axis, and its layouts.
struct Line {
  collision::MovablePart part;
  collision::SpacingInterval range;
  std::vector<double> spacings_m;  // ascending, in the range
  bool with_distances = true;      // whether clearance and penetration are requested
};

// A spacing of a line: lines[line].spacings_m[spacing].
struct PlaceOnLine {
  std::size_t line, spacing;
};
// A layout of several parts: where each of them is.
using JointLayout = std::vector<PlaceOnLine>;

// Returns `count` spacings at equal distances, with both ends of the range; of one, its low end.
std::vector<double> equally_spaced_m(const collision::SpacingInterval& range, int count);

// The real objects of one recorded frame.
struct StudyFrame {
  std::vector<hull::Silhouette> silhouettes;
  double duration_s;  // until the next frame
};

struct StudyOptions {
  hull::HullRule rule = {};
  // Of the detection of single layouts, by backend cpu (DetectionOptions).
  double eps_m = 0.5e-3;
  // Largest clearance that is measured; a larger one is {clearance_cap_m, infinity}.
  double clearance_cap_m = 0.1;
  double tolerance_m = 1e-3;  // of a clearance: largest max_m - min_m
};

// Throws std::invalid_argument if an option is out of range.
void check(const StudyOptions& options);

// Calls `compute` once per frame, in the pool, and rethrows the first exception.
void run_frames(base::WorkerPool& pool, std::size_t frames,
                const std::function<void(std::size_t frame, std::size_t thread)>& compute);

// min_m <= value <= max_m.
struct Bracket {
  double min_m, max_m;
  bool operator==(const Bracket&) const = default;
};

// All frames, one spacing or one joint layout.
struct LayoutResult {
  double spacing_m = 0;  // 0 of a joint layout
  std::size_t colliding_frames = 0;
  // Frames in which the layout is neither certified free nor known to collide: the hull may touch
  // the part.
  std::size_t undecided_frames = 0;
  double collision_s = 0;
  // Minimum distance between the part and the hull; {0, 0} if they collide in a frame.
  Bracket clearance{};
  // Largest distance, over the frames with a collision, to the nearest spacing of the range at
  // which the part is free in that frame: how far the part is in the way along its axis. {0, 0} if
  // all frames are free. In an undecided frame min_m is 0 and max_m as in one with a collision:
  // infinite if no spacing of the range is certified free in that frame. min_m is infinite if the
  // part collides at each spacing of the range.
  Bracket penetration{};
};

struct LineResult {
  std::vector<LayoutResult> layouts;
  // Spacings that are certified free in all frames; ascending, disjoint. The rest of the range
  // collides in a frame, or is undecided within the tolerance of the sweep.
  std::vector<collision::SpacingInterval> free;
  std::size_t incomplete_frames = 0;  // see SpacingVerdicts::is_complete
};

// The results do not depend on the number of threads. A call of results() ends a batch, which may
// change clearances within their tolerance.
class SpacingStudy {
 public:
  // Throws std::invalid_argument if a line's spacings do not ascend or are not in its range, if a
  // joint layout has a place that is on no line, or if an option is out of range.
  SpacingStudy(std::vector<Line> lines, const StudyOptions& options, base::WorkerPool& pool,
               std::vector<JointLayout> joint_layouts = {});
  ~SpacingStudy();

  // Calls `each` when a frame of a batch is computed, with their number in this batch: in one
  // thread at a time, during add() and results().
  void on_frame(std::function<void(std::size_t computed)> each) { on_frame_ = std::move(each); }

  // Computes a batch when it is full. Returns the number of frames that are computed.
  std::size_t add(StudyFrame frame);
  // One per line. Computes the frames that are still waiting.
  std::vector<LineResult> results();
  // One per joint layout, of the frames that are computed. It collides in a frame if one of its
  // parts does; clearance and penetration are the smallest and the largest of its parts. Each part
  // collides with the real objects only, not with the others.
  std::vector<LayoutResult> joint_results() const;
  std::size_t frames() const { return frames_; }
  // Frames whose hull is empty: a camera saw no object, or the silhouettes have no common point.
  std::size_t empty_frames() const { return empty_frames_; }
  double duration_s() const { return duration_s_; }

 private:
  struct LineFrame;
  void compute();
  LineFrame frame_of(FrameHull& hull, std::size_t line) const;
  void fold(std::size_t line, const LineFrame& found, double duration_s);
  void fold_joint(const std::vector<LineFrame>& found, double duration_s);

  std::vector<Line> lines_;
  StudyOptions options_;
  base::WorkerPool& pool_;
  std::vector<std::unique_ptr<FrameHull>> hulls_;  // one per thread of the pool
  std::vector<StudyFrame> waiting_;
  std::vector<LineResult> results_;
  std::vector<JointLayout> joint_layouts_;
  std::vector<LayoutResult> joint_results_;  // without clearances and penetrations
  std::function<void(std::size_t)> on_frame_;
  std::size_t frames_ = 0, empty_frames_ = 0;
  double duration_s_ = 0;
};

// Adds the result of other frames of the same line, with the same layouts.
void add(LineResult& result, const LineResult& of_other_frames);

// Frames that are computed together. Their clearances are searched only below the minima of
// earlier batches, so the size is fixed.
inline constexpr std::size_t kFramesPerBatch = 32;

// Returns the minimum spacing above which the whole range is certified free; infinity if there is
// none.
double min_free_spacing_m(const LineResult& result, const collision::SpacingInterval& range);

}  // namespace fivepipe::study
