// Identity of hull components from frame to frame.
#include <limits>
#include <stdexcept>

#include "tests/collision/tracking/tracked_scene.h"

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

}  // namespace
}  // namespace fivepipe::test
