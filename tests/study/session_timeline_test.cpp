// Parts over time, against single detections and the exact reference.
#include "common/study/session_timeline.h"

#include <gtest/gtest.h>

#include <limits>

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

const geometry::Mesh kTimelinePart = geometry::box_mesh({0.05, 0.15, 0.12}, 0.03);

std::vector<std::vector<TimelinePoint>> timeline_of(int frames, int threads) {
  base::WorkerPool pool(threads);
  const std::vector<geometry::Mesh> parts{kTimelinePart, kTimelinePart};
  SessionTimeline timeline(parts, {}, pool);
  for (int i = 0; i < frames; ++i)
    timeline.add({timeline_hand(-0.3 + 0.01 * i),
                  0.1 * i,
                  0.1,
                  {test::at({0, 0, 0.02}), test::at({1, 0, 0})}});
  return timeline.results();
}

TEST(SessionTimeline, EqualsSingleDetections) {
  constexpr int kFrames = 40;
  const auto found = timeline_of(kFrames, 2);
  ASSERT_EQ(found.size(), 2u);
  ASSERT_EQ(found[0].size(), std::size_t(kFrames));
  int colliding = 0, measured = 0;
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
    // The nearest of some points of the part bounds the clearance from above.
    const collision::HullDistance reference(silhouettes);
    double nearest_m = kNoLimit_m;
    for (const Vector3d& v : kTimelinePart.vertices_m)
      nearest_m =
          std::min(nearest_m, reference.clearance_m(test::at({0, 0, 0.02}) * v, 0.1, 1e-3).max_m);
    EXPECT_LE(point.clearance.min_m, nearest_m) << i;
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
  SessionTimeline timeline(std::vector{kTimelinePart}, {}, pool);
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
  SessionTimeline timeline(std::vector{kTimelinePart}, {}, pool);
  EXPECT_THROW(timeline.add({timeline_hand(0), 0, 0.1, {}}), std::invalid_argument);
  EXPECT_THROW(SessionTimeline(std::vector{kTimelinePart}, {.clearance_cap_m = 0}, pool),
               std::invalid_argument);
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
