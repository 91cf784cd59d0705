// Identity of hull components from frame to frame.
#include <algorithm>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "tests/collision/tracking/tracked_scene.h"
#include "tests/support/not_finite.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

TEST(ComponentTracker, MergeAndSplitListPredecessors) {
  const std::vector<geometry::Camera> cameras = lab_cameras();
  collision::ComponentTracker tracker;
  std::uint64_t left = 0, right = 0, merged_id = 0;
  bool was_merged = false, was_split = false;
  for (int frame = 0; frame < 50; ++frame) {
    const double gap_m = std::abs(frame - 24) * 0.006 - 0.02;  // the balls approach, then separate
    const auto& components =
        tracker.add(frame * kFrame_s, components_of({ball({-0.04 - 0.5 * gap_m, 0, 0}, 0.04),
                                                     ball({0.04 + 0.5 * gap_m, 0.01, 0}, 0.035)},
                                                    cameras, 0.004));
    if (components.size() == 2 && left == 0) left = components[0].id, right = components[1].id;
    if (components.size() == 1 && !was_merged) {
      was_merged = true;
      EXPECT_EQ(components[0].origin, collision::ComponentOrigin::merged);
      EXPECT_EQ(components[0].from.size(), 2u);
      merged_id = components[0].id;
      EXPECT_NE(merged_id, left);
      EXPECT_NE(merged_id, right);
    } else if (components.size() == 2 && was_merged && !was_split) {
      was_split = true;
      for (const collision::TrackedComponent& p : components) {
        EXPECT_EQ(p.origin, collision::ComponentOrigin::split);
        EXPECT_EQ(p.from, std::vector<std::uint64_t>{merged_id});
        EXPECT_GT(p.id, merged_id);
      }
    } else if (frame > 0) {
      for (const collision::TrackedComponent& p : components)
        EXPECT_EQ(p.origin, collision::ComponentOrigin::tracked) << frame;
    }
  }
  EXPECT_TRUE(was_merged && was_split);
}

// The boxes meet, the components do not: a speck, and a ball of a fifth of the rod's volume.
TEST(ComponentTracker, ComponentBesideARodIsNotMerged) {
  const std::vector<geometry::Camera> cameras = lab_cameras();
  const hull::Capsule rod{{-0.15, -0.15, 0}, {0.15, 0.15, 0}, 0.02};
  for (const double radius_m : {0.008, 0.03}) {
    const hull::Capsule beside = ball(0.11 * Vector3d(1, -1, 0).normalized(), radius_m);
    collision::ComponentTracker tracker;
    for (int frame = 0; frame < 24; ++frame) {
      const bool is_present = frame % 4 == 3;
      const auto& components = tracker.add(
          frame * kFrame_s,
          components_of(is_present ? std::vector{rod, beside} : std::vector{rod}, cameras, 0.002));
      ASSERT_EQ(components.size(), is_present ? 2u : 1u) << frame;
      EXPECT_EQ(components[0].id, 1u) << frame;
      EXPECT_EQ(components[0].origin, frame > 0 ? collision::ComponentOrigin::tracked
                                                : collision::ComponentOrigin::appeared)
          << frame;
      if (!is_present) continue;
      EXPECT_EQ(components[1].origin, collision::ComponentOrigin::appeared) << frame;
      EXPECT_TRUE(components[1].from.empty());
    }
  }
}

// A ball of a quarter of the other's volume joins it and leaves it.
TEST(ComponentTracker, MergeOfUnequalComponentsIsReported) {
  const std::vector<geometry::Camera> cameras = lab_cameras();
  collision::ComponentTracker tracker;
  int merged = 0, split = 0;
  for (int frame = 0; frame < 40; ++frame) {
    const double gap_m = std::abs(frame - 19.5) * 0.004 - 0.02;
    const auto& components = tracker.add(
        frame * kFrame_s,
        components_of({ball({-0.05, 0, 0}, 0.05), ball({0.032 + gap_m, 0.01, 0}, 0.032)}, cameras,
                      0.004));
    merged += components[0].origin == collision::ComponentOrigin::merged &&
              components[0].from == std::vector<std::uint64_t>{1, 2};
    for (const collision::TrackedComponent& p : components)
      split += p.origin == collision::ComponentOrigin::split;
  }
  EXPECT_EQ(merged, 1);
  EXPECT_EQ(split, 2);
}

collision::HullComponent component_at(const Vector3d& p, double volume_m3 = 1e-4) {
  collision::HullComponent component;
  component.centroid_world_m = p;
  component.volume_m3 = volume_m3;
  component.covariance_world_m2 = Eigen::Vector3d(1e-4, 2e-4, 4e-4).asDiagonal();
  component.box_world_m = {p - Vector3d::Constant(0.01), p + Vector3d::Constant(0.01)};
  component.cells = 100;
  return component;
}

TEST(ComponentTracker, AmbiguousMatchGetsNewId) {
  collision::ComponentTracker tracker;
  tracker.add(0.01, {component_at({-0.02, 0, 0}), component_at({0.02, 0, 0})});
  const auto& components =
      tracker.add(0.02, {component_at({0, 0.001, 0})});  // halfway between both
  EXPECT_NE(components[0].origin, collision::ComponentOrigin::tracked);
  EXPECT_EQ(components[0].id, 3u);
}

TEST(ComponentTracker, TracksMotionLargerThanTheComponent) {
  collision::ComponentTracker tracker;
  for (int frame = 0; frame < 6; ++frame) {
    const auto& components =
        tracker.add(1 + frame * kFrame_s, {component_at(frame * kFrame_s * Vector3d(5, 0, 0))});
    EXPECT_EQ(components[0].id, 1u);
    if (frame >= 2) {
      EXPECT_LT((components[0].motion->velocity_world_m_s - Vector3d(5, 0, 0)).norm(), 1e-9);
    }
  }
  EXPECT_EQ(tracker.add(1.2, {component_at({3, 0, 0})})[0].origin,
            collision::ComponentOrigin::appeared);  // faster than max_speed_m_s
}

TEST(ComponentTracker, LargeVolumeChangeGetsANewId) {
  collision::ComponentTracker tracker;
  tracker.add(0.01, {component_at({0, 0, 0})});
  EXPECT_NE(tracker.add(0.02, {component_at({0, 0, 0}, 5e-4)})[0].origin,
            collision::ComponentOrigin::tracked);
}

TEST(ComponentTracker, LongGapGetsNewIds) {
  collision::ComponentTracker tracker({.max_gap_s = 0.25});
  tracker.add(1, {component_at({0, 0, 0})});
  EXPECT_EQ(tracker.add(1.24, {component_at({0, 0, 0})})[0].id, 1u);
  EXPECT_EQ(tracker.add(1.5, {component_at({0, 0, 0})})[0].id, 2u);
  EXPECT_EQ(tracker.components()[0].origin, collision::ComponentOrigin::appeared);
  EXPECT_EQ(tracker.add(3601.5, {component_at({4, 0, 0})})[0].id, 3u);
  EXPECT_THROW(collision::ComponentTracker({.max_gap_s = 0}), std::invalid_argument);
  EXPECT_THROW(collision::ComponentTracker({.max_gap_s = std::numeric_limits<double>::quiet_NaN()}),
               std::invalid_argument);
}

TEST(ComponentTracker, BackwardTimeResetsAndIdsAreNeverReused) {
  collision::ComponentTracker tracker;
  tracker.add(5, {component_at({0, 0, 0})});
  EXPECT_EQ(tracker.add(4, {component_at({0, 0, 0})})[0].id, 2u);
  EXPECT_EQ(tracker.components()[0].origin, collision::ComponentOrigin::appeared);
  EXPECT_THROW(tracker.add(std::numeric_limits<double>::quiet_NaN(), {}), std::invalid_argument);
  EXPECT_THROW(collision::ComponentTracker({.window_frames = 2}), std::invalid_argument);
}

collision::ComponentTrackerOptions with_max_speed(double max_speed_m_s) {
  return {.max_speed_m_s = max_speed_m_s};
}

// Limits at which the numbers are exact in binary: each is inside, the next number is outside.
TEST(ComponentTracker, MatchesUpToEachLimit) {
  const auto is_tracked = [](const std::vector<collision::HullComponent>& first,
                             const std::vector<collision::HullComponent>& second,
                             std::size_t which = 0) {
    collision::ComponentTracker tracker(with_max_speed(4));
    tracker.add(1, first);
    return tracker.add(1.25, second)[which].origin == collision::ComponentOrigin::tracked;
  };
  const auto alone = [](double x_m, double volume_m3 = 1) {
    return std::vector{component_at({x_m, 0, 0}, volume_m3)};
  };
  // 4 m/s over 0.25 s.
  EXPECT_TRUE(is_tracked(alone(0), alone(1)));
  EXPECT_FALSE(is_tracked(alone(0), alone(1.001)));
  // Twice and half the volume.
  EXPECT_TRUE(is_tracked(alone(0), alone(0, 2)));
  EXPECT_FALSE(is_tracked(alone(0), alone(0, 2.001)));
  EXPECT_TRUE(is_tracked(alone(0, 2), alone(0)));
  EXPECT_FALSE(is_tracked(alone(0, 2.001), alone(0)));
  // Another predecessor, or another successor, at twice the distance. It is out of a merge's reach.
  for (const bool other_is_earlier : {false, true})
    for (const bool other_first : {false, true}) {
      const auto pair = [&](double x_m, double other_m) {
        std::vector<collision::HullComponent> both = alone(x_m);
        both.insert(other_first ? both.begin() : both.end(), component_at({other_m, 0, 0}, 64));
        return both;
      };
      const std::size_t which = other_is_earlier ? 0 : other_first;
      for (const double other_m : {0.75, -0.25})  // 0.5 from 0.25
        EXPECT_TRUE(other_is_earlier ? is_tracked(pair(0, other_m), alone(0.25))
                                     : is_tracked(alone(0.25), pair(0, other_m), which))
            << other_m;
      for (const double other_m : {0.749, -0.249})
        EXPECT_FALSE(other_is_earlier ? is_tracked(pair(0, other_m), alone(0.25))
                                      : is_tracked(alone(0.25), pair(0, other_m), which))
            << other_m;
    }
}

TEST(ComponentTracker, ResetsOnlyAfterALongerGapOrWithoutProgress) {
  for (const auto& [time_s, id] : {std::pair{1.25, 1u}, {1.2500001, 2u}, {1.0, 2u}, {1.001, 1u}}) {
    collision::ComponentTracker tracker;  // at most 0.25 s
    tracker.add(1, {component_at({0, 0, 0})});
    EXPECT_EQ(tracker.add(time_s, {component_at({0, 0, 0})})[0].id, id) << time_s;
  }
  collision::ComponentTracker tracker;
  tracker.add(1, {component_at({0, 0, 0})});
  tracker.reset();
  EXPECT_TRUE(tracker.components().empty());
  const auto& components = tracker.add(1.01, {component_at({0, 0, 0})});
  EXPECT_EQ(components[0].id, 2u);
  EXPECT_EQ(components[0].origin, collision::ComponentOrigin::appeared);
}

// An accelerating component with unequal frame times, without outlines.
TEST(ComponentTracker, VelocityIsTheSlopeOverTheLastFrames) {
  collision::ComponentTracker tracker;  // at most 6 m/s, 8 frames
  std::vector<std::pair<double, Vector3d>> path;
  for (int frame = 0; frame < 20; ++frame) {
    const double t_s = 0.02 * frame + 0.003 * (frame % 3);
    path.emplace_back(7 + t_s, Vector3d(2 * t_s, -t_s + 3 * t_s * t_s, 0.5 * t_s * t_s * t_s));
    const auto& found = tracker.add(path.back().first, {component_at(path.back().second)});
    EXPECT_EQ(found[0].id, 1u);
    if (frame < 2) {
      EXPECT_FALSE(found[0].motion);
      continue;
    }
    const int frames = std::min(frame + 1, 8);
    ASSERT_TRUE(found[0].motion);
    EXPECT_EQ(found[0].motion->frames, frames);
    EXPECT_DOUBLE_EQ(found[0].motion->window_s,
                     path.back().first - path[path.size() - std::size_t(frames)].first);
    EXPECT_EQ(found[0].motion->determined_axes, 0);
    EXPECT_EQ(found[0].motion->residual_m, 0);
    EXPECT_EQ(found[0].motion->angular_velocity_world_rad_s, kOrigin);
    // Normal equations of p = a + b t.
    Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
    Eigen::Matrix<double, 2, 3> right = Eigen::Matrix<double, 2, 3>::Zero();
    for (int i = 0; i < frames; ++i) {
      const auto& [time_s, p] = path[path.size() - 1 - std::size_t(i)];
      const Eigen::Vector2d row(1, time_s - 7);
      normal += row * row.transpose(), right += row * p.transpose();
    }
    const Vector3d slope = normal.inverse().row(1) * right;
    EXPECT_LT((found[0].motion->velocity_world_m_s - slope).norm(), 1e-9) << frame;
  }
}

// At 5 m/s the first component passes the second one between two frames.
TEST(ComponentTracker, PredictsFromTheLastVelocity) {
  collision::ComponentTracker tracker(with_max_speed(8));
  for (int frame = 0; frame < 4; ++frame)
    tracker.add(1 + 0.02 * frame,
                {component_at({0.1 * frame - 0.3, 0, 0}), component_at({0.3, 0, 0})});
  // The first passes the second.
  const auto& passed = tracker.add(1.26, {component_at({1, 0, 0}), component_at({0.3, 0, 0})});
  EXPECT_EQ(passed[0].id, 1u);
  EXPECT_EQ(passed[1].id, 2u);
}

collision::HullComponent boxed(const Vector3d& p, double half_m, double volume_m3) {
  collision::HullComponent component = component_at(p, volume_m3);
  component.box_world_m = {p - Vector3d::Constant(half_m), p + Vector3d::Constant(half_m)};
  return component;
}

// A large component grows by the volume of a small one that touches its box and vanishes, or
// shrinks by that of a new one.
TEST(ComponentTracker, VolumesMustAccountForAMergeOrSplit) {
  struct Case {
    double small_m3, change_m3;
    bool counts;
  };
  for (const Case& c : {Case{0.125, 0.0625, true}, Case{0.125, 0.0624, false}, Case{0.1, 0.1, true},
                        Case{0.0999, 0.0999, false}, Case{0.5, 0.25, true}})
    for (const bool merge : {true, false}) {
      collision::ComponentTracker tracker;
      const auto small = boxed({0.3, 0, 0}, 0.1, c.small_m3);
      tracker.add(1, merge ? std::vector{boxed(kOrigin, 0.2, 1), small}
                           : std::vector{boxed(kOrigin, 0.2, 1)});
      const double after_m3 = merge ? 1 + c.change_m3 : 1 - c.change_m3;
      const auto& found =
          tracker.add(1.02, merge ? std::vector{boxed(kOrigin, 0.2, after_m3)}
                                  : std::vector{boxed(kOrigin, 0.2, after_m3), small});
      using collision::ComponentOrigin;
      if (merge) {
        EXPECT_EQ(found[0].origin, c.counts ? ComponentOrigin::merged : ComponentOrigin::tracked);
        EXPECT_EQ(found[0].from,
                  c.counts ? (std::vector<std::uint64_t>{1, 2}) : std::vector<std::uint64_t>{1});
        EXPECT_EQ(found[0].id, c.counts ? 3u : 1u);
      } else {
        EXPECT_EQ(found[0].origin, c.counts ? ComponentOrigin::split : ComponentOrigin::tracked);
        EXPECT_EQ(found[1].origin, c.counts ? ComponentOrigin::split : ComponentOrigin::appeared);
        EXPECT_EQ(found[0].from, std::vector<std::uint64_t>{1});
        EXPECT_EQ(found[1].from,
                  c.counts ? std::vector<std::uint64_t>{1} : std::vector<std::uint64_t>{});
        EXPECT_EQ(found[0].id, c.counts ? 2u : 1u);
        EXPECT_EQ(found[1].id, c.counts ? 3u : 2u);
      }
    }
}

// The boxes touch at 0.3 m; a moving one reaches half of its motion farther on each side.
TEST(ComponentTracker, OnlyMeetingBoxesMergeOrSplit) {
  for (const auto& [gap_m, meets] : {std::pair{-1e-6, true}, {1e-6, false}})
    for (int axis = 0; axis < 3; ++axis) {
      collision::ComponentTracker tracker;
      const Vector3d off = (0.3 + gap_m) * Vector3d::Unit(axis);
      tracker.add(1, {boxed(kOrigin, 0.2, 1), boxed(off, 0.1, 0.5)});
      EXPECT_EQ(tracker.add(1.02, {boxed(kOrigin, 0.2, 1.5)})[0].origin ==
                    collision::ComponentOrigin::merged,
                meets)
          << axis << ' ' << gap_m;
    }
  // 0.04 m per frame: the box of 0.1 m is predicted 0.04 m ahead and extends by 0.02 m.
  for (const auto& [gap_m, meets] : {std::pair{-1e-6, true}, {1e-6, false}})
    for (const double direction : {1.0, -1.0}) {
      collision::ComponentTracker tracker;
      const double large_m = direction * (0.2 + 0.1 + 0.02 + gap_m);  // from the predicted center
      for (int frame = 0; frame < 4; ++frame) {
        std::vector<collision::HullComponent> both{
            boxed(Vector3d(large_m, 0, 0), 0.2, 1),
            boxed(Vector3d(0.04 * (frame - 4), 0, 0), 0.1, 0.5)};
        ASSERT_EQ(tracker.add(1 + 0.02 * frame, both)[1].id, 2u);
      }
      EXPECT_EQ(tracker.add(1.08, {boxed(Vector3d(large_m, 0, 0), 0.2, 1.5)})[0].origin ==
                    collision::ComponentOrigin::merged,
                meets)
          << direction << ' ' << gap_m;
    }
}

TEST(ComponentTracker, RejectsInvalidOptions) {
  for (const collision::ComponentTrackerOptions& options :
       {collision::ComponentTrackerOptions{.max_speed_m_s = 0},
        collision::ComponentTrackerOptions{.max_speed_m_s = kNaN},
        collision::ComponentTrackerOptions{.window_frames = 2}})
    EXPECT_THROW(collision::ComponentTracker{options}, std::invalid_argument);
  EXPECT_NO_THROW(
      collision::ComponentTracker({.window_frames = 3, .max_speed_m_s = 0.1, .max_gap_s = 0.01}));
}

}  // namespace
}  // namespace fivepipe::test
