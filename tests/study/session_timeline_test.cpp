// Parts over time, against single detections and the exact reference.
#include "common/study/session_timeline.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <queue>

#include "common/collision/oracle/distance_reference.h"
#include "tests/support/collision/scene.h"

namespace fivepipe::study {
namespace {

using collision::CollisionVerdict;
using Eigen::Vector3d;

constexpr double kNoLimit_m = std::numeric_limits<double>::infinity();

std::vector<hull::Silhouette> timeline_hand(double x_m) {
  return test::hand_among(4, 200, {x_m, 0, 0});
}

const Vector3d kTimelineSize_m{0.05, 0.15, 0.12};
const geometry::Mesh kTimelinePart = geometry::box_mesh(kTimelineSize_m, 0.03);

std::vector<std::vector<TimelinePoint>> timeline_of(int frames, int threads) {
  base::WorkerPool pool(threads);
  SessionTimeline timeline({{kTimelinePart}, {kTimelinePart}}, {}, pool);
  for (int i = 0; i < frames; ++i)
    timeline.add({timeline_hand(-0.3 + 0.01 * i),
                  0.1 * i,
                  0.1,
                  {test::at({0, 0, 0.02}), test::at({1, 0, 0})}});
  return timeline.results();
}

// A piece of a face of the box, by its center and its half edges.
struct Piece {
  Vector3d center_m, u_m, v_m;
  Bracket clearance;  // of the piece
  bool operator<(const Piece& other) const { return clearance.min_m > other.clearance.min_m; }
};

// The clearance of the box's surface from the distances of points of it: the pieces of its faces
// are divided, nearest first, because a distance changes by at most that between two points.
Bracket reference_clearance(const collision::HullDistance& hull, const Vector3d& box_center_m) {
  constexpr double kCap_m = 0.1, kPointTolerance_m = 0.5e-3, kSmallest_m = 1e-3;
  const Vector3d half_m = 0.5 * kTimelineSize_m;
  const auto piece = [&](const Vector3d& center_m, const Vector3d& u_m, const Vector3d& v_m) {
    const double radius_m = (u_m + v_m).norm();
    const collision::Clearance at_center =
        hull.clearance_m(center_m, kCap_m + radius_m, std::max(kPointTolerance_m, radius_m / 4));
    return Piece{center_m, u_m, v_m, {at_center.min_m - radius_m, at_center.max_m}};
  };
  std::priority_queue<Piece> pieces;
  for (const int axis : {0, 1, 2})
    for (const double side : {-1, 1}) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      pieces.push(piece(box_center_m + side * half_m[axis] * Vector3d::Unit(axis),
                        half_m[u] * Vector3d::Unit(u), half_m[v] * Vector3d::Unit(v)));
    }
  double max_m = kNoLimit_m;
  for (;;) {
    const Piece nearest = pieces.top();
    max_m = std::min(max_m, nearest.clearance.max_m);
    const double min_m = std::max(0.0, nearest.clearance.min_m);
    if (min_m >= kCap_m) return {kCap_m, kNoLimit_m};
    const bool is_small = (nearest.u_m + nearest.v_m).norm() <= kSmallest_m;
    if (is_small) return {min_m, max_m};
    pieces.pop();
    for (const double u : {-0.5, 0.5})
      for (const double v : {-0.5, 0.5})
        pieces.push(piece(nearest.center_m + u * nearest.u_m + v * nearest.v_m, 0.5 * nearest.u_m,
                          0.5 * nearest.v_m));
  }
}

TEST(SessionTimeline, EqualsSingleDetections) {
  constexpr int kFrames = 40;
  const auto found = timeline_of(kFrames, 2);
  ASSERT_EQ(found.size(), 2u);
  ASSERT_EQ(found[0].size(), std::size_t(kFrames));
  int colliding = 0, measured = 0, compared = 0;
  for (int i = 0; i < kFrames; ++i) {
    const TimelinePoint& point = found[0][std::size_t(i)];
    EXPECT_EQ(point.time_s, 0.1 * i);
    const std::vector<hull::Silhouette> silhouettes = timeline_hand(-0.3 + 0.01 * i);
    FrameHull hull({}, 0.5e-3);
    hull.set(silhouettes);
    const collision::Bvh tree(kTimelinePart);
    const collision::DetectionObject object{&tree, test::at({0, 0, 0.02})};
    EXPECT_EQ(point.verdict, hull.detector->detect({&object, 1})[0].verdict) << i;
    colliding += point.verdict == CollisionVerdict::colliding;
    if (point.verdict == CollisionVerdict::colliding) {
      EXPECT_EQ(point.clearance, (Bracket{0, 0}));
      continue;
    }
    // Of some frames: the reference is slow.
    if (point.clearance.max_m == kNoLimit_m ? i % 10 == 0 : measured % 4 == 0) {
      const Bracket truth = reference_clearance(collision::HullDistance(silhouettes), {0, 0, 0.02});
      EXPECT_LE(point.clearance.min_m, truth.max_m) << i;
      EXPECT_GE(point.clearance.max_m, truth.min_m) << i;
      compared += std::isfinite(truth.max_m) && truth.max_m - truth.min_m <= 2e-3;
    }
    if (point.clearance.max_m == kNoLimit_m) {
      EXPECT_EQ(point.clearance.min_m, 0.1);
    } else {
      EXPECT_LE(point.clearance.max_m - point.clearance.min_m, 1e-3 + 1e-9);
      ++measured;
    }
    EXPECT_EQ(found[1][std::size_t(i)].clearance, (Bracket{0.1, kNoLimit_m}));
  }
  EXPECT_GT(colliding, 5);
  EXPECT_GT(measured, 5);
  EXPECT_GE(compared, 2);
}

TEST(SessionTimeline, DoesNotDependOnTheNumberOfThreads) {
  const auto one = timeline_of(40, 1), three = timeline_of(40, 3);
  for (std::size_t part = 0; part < one.size(); ++part)
    for (std::size_t i = 0; i < one[part].size(); ++i) {
      EXPECT_EQ(one[part][i].verdict, three[part][i].verdict);
      EXPECT_EQ(one[part][i].clearance, three[part][i].clearance);
    }
}

TEST(SessionTimeline, KnowsFramesWithoutAHullAndUnknownOnes) {
  base::WorkerPool pool(1);
  SessionTimeline timeline({{kTimelinePart}}, {}, pool);
  std::vector<hull::Silhouette> empty = timeline_hand(0), unknown = timeline_hand(0);
  empty[1].pixels = hull::ObjectPixels(200, 200);
  unknown[1].camera.pinhole.fx_px = std::numeric_limits<double>::quiet_NaN();
  timeline.add({empty, 0, 0.1, {test::at({0, 0, 0})}});
  timeline.add({unknown, 1, 0.1, {test::at({0, 0, 0})}});
  const auto& found = timeline.results()[0];
  EXPECT_EQ(found[0].verdict, CollisionVerdict::free);
  EXPECT_EQ(found[0].clearance, (Bracket{0.1, kNoLimit_m}));
  EXPECT_EQ(found[1].verdict, CollisionVerdict::undecided);
  EXPECT_EQ(found[1].clearance, (Bracket{0, kNoLimit_m}));
}

TEST(SessionTimeline, RefusesAnotherNumberOfPoses) {
  base::WorkerPool pool(1);
  SessionTimeline timeline({{kTimelinePart}}, {}, pool);
  EXPECT_THROW(timeline.add({timeline_hand(0), 0, 0.1, {}}), std::invalid_argument);
  EXPECT_THROW(timeline.add({timeline_hand(0), 0, 0.1, {test::at({0, 0, 0})}, {0, 0}}),
               std::invalid_argument);
  EXPECT_THROW(SessionTimeline({{kTimelinePart}}, {.clearance_cap_m = 0}, pool),
               std::invalid_argument);
}

TEST(SessionTimeline, PenetrationIsThatOfThePartAtItsSpacing) {
  const collision::SpacingInterval range{-0.15, 0.25};
  const std::vector<double> spacings_m{-0.02, 0.0, 0.03};
  base::WorkerPool pool(2);
  SessionTimeline timeline(
      {{kTimelinePart, PartDepth(kTimelinePart, test::at({0, 0, 0.02}), {1, 0, 0}, range)},
       {kTimelinePart}},
      {}, pool);
  for (std::size_t i = 0; i < spacings_m.size(); ++i)
    timeline.add({timeline_hand(-0.05),
                  0.1 * double(i),
                  0.1,
                  {test::at({spacings_m[i], 0, 0.02}), test::at({0, 0, 0.02})},
                  {spacings_m[i], 0}});
  // The study sweeps the whole range.
  SpacingStudy study({{{kTimelinePart, test::at({0, 0, 0.02}), {1, 0, 0}}, range, spacings_m}}, {},
                     pool);
  study.add({timeline_hand(-0.05), 0.1});
  const std::vector<LayoutResult> layouts = study.results()[0].layouts;
  Bracket largest{0, 0};
  for (std::size_t i = 0; i < spacings_m.size(); ++i) {
    const TimelinePoint& point = timeline.results()[0][i];
    ASSERT_EQ(point.verdict, CollisionVerdict::colliding);
    EXPECT_LE(point.penetration.min_m, layouts[i].penetration.max_m) << i;
    EXPECT_GE(point.penetration.max_m, layouts[i].penetration.min_m) << i;
    EXPECT_GT(point.penetration.min_m, 1e-3) << i;
    EXPECT_LE(point.penetration.max_m - point.penetration.min_m, 2e-3) << i;
    EXPECT_EQ(timeline.results()[1][i].penetration, (Bracket{0, 0})) << "not requested";
    largest = {std::max(largest.min_m, point.penetration.min_m),
               std::max(largest.max_m, point.penetration.max_m)};
  }
  EXPECT_EQ(max_penetration(timeline.results()[0], {0, 2}), largest);
}

TEST(CollisionEvents, JoinAcrossShortGaps) {
  std::vector<TimelinePoint> timeline;
  for (const bool collides : {false, true, true, false, true, false, false, false, true})
    timeline.push_back({0.1 * double(timeline.size()),
                        0.1,
                        collides ? CollisionVerdict::colliding : CollisionVerdict::free,
                        {}});
  const auto events_of = [&](double min_gap_s) {
    std::vector<std::pair<std::size_t, std::size_t>> events;
    for (const CollisionEvent& e : collision_events(timeline, min_gap_s))
      events.emplace_back(e.first, e.last);
    return events;
  };
  using Events = std::vector<std::pair<std::size_t, std::size_t>>;
  EXPECT_EQ(events_of(0), (Events{{1, 2}, {4, 4}, {8, 8}}));
  EXPECT_EQ(events_of(0.1), (Events{{1, 4}, {8, 8}}));
  EXPECT_EQ(events_of(0.25), (Events{{1, 4}, {8, 8}}));
  EXPECT_EQ(events_of(1), (Events{{1, 8}}));
  EXPECT_TRUE(collision_events({}, 1).empty());
  // The cameras stall: neighbours in the timeline are apart in time.
  timeline[2].time_s += 30;
  EXPECT_EQ(events_of(1).size(), 2u);
}

}  // namespace
}  // namespace fivepipe::study
