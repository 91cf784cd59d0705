// Parts of the hull followed over frames.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "common/collision/tracking/component_tracker.h"
#include "tests/support/collision_scene.h"

namespace fivepipe::test {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector3d;

constexpr double kFrame_s = 1.0 / 60;
const Eigen::AlignedBox3d kSpace(Vector3d(-0.5, -0.5, -0.4), Vector3d(0.5, 0.5, 0.4));

std::vector<hull::Capsule> moved(std::vector<hull::Capsule> object, const Eigen::Isometry3d& by) {
  for (hull::Capsule& c : object) c.a_world_m = by * c.a_world_m, c.b_world_m = by * c.b_world_m;
  return object;
}

// Turned about its middle.
std::vector<hull::Capsule> centred(std::vector<hull::Capsule> object) {
  Eigen::AlignedBox3d box;
  for (const hull::Capsule& c : object)
    for (const Vector3d& p : {c.a_world_m, c.b_world_m})
      box.extend(p - Vector3d::Constant(c.radius_m)),
          box.extend(p + Vector3d::Constant(c.radius_m));
  Vector3d sum = Vector3d::Zero();
  int count = 0;
  for (int i = 0; i < 50 * 50 * 50; ++i) {
    const Vector3d p =
        box.min() +
        box.sizes().cwiseProduct(Vector3d(i % 50 + 0.5, i / 50 % 50 + 0.5, i / 2500 + 0.5)) / 50;
    const bool in = std::any_of(object.begin(), object.end(), [&](const hull::Capsule& c) {
      const Vector3d axis = c.b_world_m - c.a_world_m;
      return (p - c.a_world_m -
              std::clamp((p - c.a_world_m).dot(axis) / axis.squaredNorm(), 0.0, 1.0) * axis)
                 .norm() <= c.radius_m;
    });
    if (in) sum += p, ++count;
  }
  Eigen::Isometry3d to_center = Eigen::Isometry3d::Identity();
  to_center.translation() = -sum / count;
  return moved(std::move(object), to_center);
}

// The paper's pipe and a hand with its forearm.
std::vector<hull::Capsule> pipe() { return {{{-0.15, 0, 0}, {0.15, 0, 0}, 0.02}}; }
std::vector<hull::Capsule> hand() {
  std::vector<hull::Capsule> object{{{-0.12, 0, 0}, {-0.02, 0, 0}, 0.035}};
  for (const double y : {-0.03, -0.01, 0.01, 0.03})
    object.push_back({{0, y, 0}, {0.07, 1.6 * y, 0}, 0.011});
  object.push_back({{-0.02, -0.03, 0}, {0.03, -0.08, 0}, 0.011});
  return object;
}

std::vector<geometry::Camera> lab_cameras() {
  std::vector<geometry::Camera> cameras = ring(4, 1.6, 0.75, 480, 1.1);
  for (const geometry::Camera& c : ring(4, 1.6, 0.3, 480, 1.1)) cameras.push_back(c);
  return cameras;
}

std::vector<collision::HullComponent> parts_of(const std::vector<hull::Capsule>& object,
                                               const std::vector<geometry::Camera>& cameras,
                                               double cell_m, Random* noise = nullptr) {
  std::vector<hull::Silhouette> silhouettes = silhouettes_of(object, cameras);
  if (noise)  // each border pixel, by chance: what a camera's noise does to a silhouette after it
              // was cleaned
    for (hull::Silhouette& s : silhouettes) {
      const hull::ObjectPixels before = s.pixels;
      std::bernoulli_distribution flips(0.25);
      const hull::PixelRect bounds = before.bounds();
      for (int v = std::max(bounds.v0_px - 1, 0);
           v < std::min(bounds.v1_px + 1, before.height_px()); ++v)
        for (int u = std::max(bounds.u0_px - 1, 0);
             u < std::min(bounds.u1_px + 1, before.width_px()); ++u) {
          const bool here = before.contains(u, v);
          const auto other = [&](int du, int dv) {
            return before.contains(u + du, v + dv) != here;
          };
          const bool at_border = other(-1, 0) || other(1, 0) || other(0, -1) || other(0, 1);
          if (at_border && flips(*noise)) s.pixels.set(u, v, !here);
        }
    }
  base::WorkerPool pool(2);
  hull::CpuHull hull(pool, silhouettes);
  return collision::hull_components(hull::HullQuery(hull), {kSpace, cell_m, 20, true});
}

struct Script {  // of a thing that passes the origin in the middle of the time, by what it is
                 // turned then
  Vector3d velocity_m_s, turn_rad_s;
  Eigen::Matrix3d turned;
  Eigen::Isometry3d pose(double t_s) const {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() =
        AngleAxisd(turn_rad_s.norm() * t_s, turn_rad_s.normalized()).toRotationMatrix() * turned;
    pose.translation() = t_s * velocity_m_s;
    return pose;
  }
  // A pipe's turn about itself is not determined: what is left, on average from one time to
  // another.
  Vector3d turn_across_x_rad_s(double from_s, double to_s) const {
    Vector3d sum = Vector3d::Zero();
    for (int i = 0; i <= 100; ++i) {
      const Vector3d axis = pose(from_s + 0.01 * i * (to_s - from_s)).linear().col(0);
      sum += (turn_rad_s - turn_rad_s.dot(axis) * axis) / 101;
    }
    return sum;
  }
};

// The first passes level, as a hand does over a table; others any way.
Script script_of(int number, double speed_m_s) {
  const double rad_m = 3;  // 1.5 rad/s at 0.5 m/s
  if (number == 0) {
    const Vector3d way(0.6, 0.7, -0.39), axis(0, 0.25, 1);
    return {speed_m_s * way.normalized(), rad_m * speed_m_s * axis.normalized(),
            AngleAxisd(0.3, Vector3d::UnitY()).toRotationMatrix()};
  }
  Random random{std::uint64_t(number)};
  const Vector3d way = random_direction(random), axis = random_direction(random),
                 lying = random_direction(random);
  return {speed_m_s * way, rad_m * speed_m_s * axis,
          AngleAxisd(uniform(random, -1, 1), lying).toRotationMatrix()};
}

struct Off {  // as a fraction
  double velocity = 0, turn = 0;
};

// At worst over a few frames, after the window has filled.
Off worst_of(bool is_hand, double speed_m_s, int number) {
  static const std::vector<geometry::Camera> cameras = lab_cameras();
  static const std::vector<hull::Capsule> objects[] = {centred(pipe()), centred(hand())};
  const Script script = script_of(number, speed_m_s);
  const int window = speed_m_s < 0.3   ? 48
                     : speed_m_s < 0.8 ? 20
                     : speed_m_s < 1.5 ? 12
                                       : 8,
            frames = window + 4;
  Random noise{std::uint64_t(number + 1)};
  collision::ComponentTracker tracker({.window_frames = window});
  Off worst;
  int judged = 0;
  for (int frame = 0; frame < frames; ++frame) {
    const double t_s = (frame - 0.5 * frames) * kFrame_s;
    const auto& parts =
        tracker.add(frame * kFrame_s,
                    parts_of(moved(objects[is_hand], script.pose(t_s)), cameras, 0.004, &noise));
    if (parts.size() != 1 || parts[0].id != 1)
      return ADD_FAILURE() << parts.size() << " parts", Off{1, 1};
    if (!parts[0].motion || parts[0].motion->frames < window) continue;
    ++judged;
    EXPECT_EQ(parts[0].motion->determined_axes, is_hand ? 3 : 2);
    const Vector3d turn = is_hand ? script.turn_rad_s
                                  : script.turn_across_x_rad_s(t_s - (window - 1) * kFrame_s, t_s);
    worst.velocity =
        std::max(worst.velocity,
                 (parts[0].motion->velocity_world_m_s - script.velocity_m_s).norm() / speed_m_s);
    worst.turn = std::max(
        worst.turn, (parts[0].motion->angular_velocity_world_rad_s - turn).norm() / turn.norm());
  }
  EXPECT_GT(judged, 3);
  return worst;
}

TEST(ComponentTracker, VelocityAndRotationOfAHandAndAPipe) {
  const bool all = std::getenv("FIVEPIPE_LONG") !=
                   nullptr;  // 20 motions instead of 3, five speeds instead of three
  for (const bool is_hand : {false, true})
    for (const double speed_m_s :
         all ? std::vector{0.1, 0.2, 0.5, 1.0, 2.0} : std::vector{0.1, 0.5, 2.0}) {
      Off worst;
      for (int number = 0; number < (all ? 20 : 3); ++number) {
        const Off off = worst_of(is_hand, speed_m_s, number);
        worst.velocity = std::max(worst.velocity, off.velocity),
        worst.turn = std::max(worst.turn, off.turn);
      }
      std::printf("%s at %.1f m/s: velocity off by %.1f %% at most, rotation by %.1f %%\n",
                  is_hand ? "hand" : "pipe", speed_m_s, 100 * worst.velocity, 100 * worst.turn);
      EXPECT_LT(worst.velocity, 0.05);
      EXPECT_LT(worst.turn, 0.05);
    }
}

TEST(ComponentTracker, DeceleratingBallHasNoAngularVelocity) {
  const std::vector<geometry::Camera> cameras = lab_cameras();
  for (const int window : {8, 20}) {
    collision::ComponentTracker tracker({.window_frames = window});
    for (int frame = 0; frame < 50; ++frame) {
      const double t_s = (frame - 24.5) * kFrame_s;  // 1 m/s, then still
      const auto& parts =
          tracker.add(frame * kFrame_s,
                      parts_of({ball({std::min(t_s, 0.0) + 0.1, 0, 0}, 0.05)}, cameras, 0.004));
      ASSERT_EQ(parts.size(), 1u);
      EXPECT_EQ(parts[0].motion ? parts[0].motion->determined_axes : 0, 0)
          << "window " << window << ", frame " << frame;
    }
  }
}

TEST(ComponentTracker, ReversingPipeIsNotOverestimated) {
  const std::vector<geometry::Camera> cameras = lab_cameras();
  constexpr double kRate_rad_s = 3;
  constexpr int kWindow = 12;
  collision::ComponentTracker tracker({.window_frames = kWindow});
  int determined = 0;
  for (int frame = 0; frame < 48; ++frame) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = AngleAxisd(kRate_rad_s * kFrame_s * (24 - std::abs(frame - 24)),
                               Vector3d(0, 0.25, 1).normalized())
                        .toRotationMatrix();
    const auto& parts =
        tracker.add(frame * kFrame_s, parts_of(moved(pipe(), pose), cameras, 0.004));
    ASSERT_EQ(parts.size(), 1u);
    if (!parts[0].motion || parts[0].motion->determined_axes == 0) continue;
    EXPECT_EQ(parts[0].motion->determined_axes, 2) << frame;
    EXPECT_LT(parts[0].motion->angular_velocity_world_rad_s.norm(), 1.05 * kRate_rad_s) << frame;
    const bool even = frame >= kWindow && (frame <= 24 || frame >= 24 + kWindow);
    determined += even;
    EXPECT_GT(parts[0].motion->angular_velocity_world_rad_s.norm(), even ? 0.9 * kRate_rad_s : 0)
        << frame;
  }
  EXPECT_EQ(determined, 25);
}

TEST(ComponentTracker, WithoutOutlinesRotationIsUndetermined) {
  collision::ComponentTracker tracker;
  const Script script{Vector3d::UnitX(), Vector3d::UnitZ(), Eigen::Matrix3d::Identity()};
  for (int frame = 0; frame < 6; ++frame) {
    auto parts = parts_of(moved(hand(), script.pose(frame * kFrame_s)), lab_cameras(), 0.01);
    parts[0].outlines.clear();
    tracker.add(frame * kFrame_s, parts);
  }
  ASSERT_TRUE(tracker.parts()[0].motion);
  EXPECT_EQ(tracker.parts()[0].motion->determined_axes, 0);
  EXPECT_EQ(tracker.parts()[0].motion->angular_velocity_world_rad_s, kOrigin);
  EXPECT_LT((tracker.parts()[0].motion->velocity_world_m_s - Vector3d::UnitX()).norm(), 0.1);
}

TEST(ComponentTracker, MergeAndSplitListPredecessors) {
  const std::vector<geometry::Camera> cameras = lab_cameras();
  collision::ComponentTracker tracker;
  std::uint64_t left = 0, right = 0, joined = 0;
  bool was_joined = false, was_split = false;
  for (int frame = 0; frame < 50; ++frame) {
    const double gap_m = std::abs(frame - 24) * 0.006 - 0.02;  // comes together, and apart again
    const auto& parts =
        tracker.add(frame * kFrame_s, parts_of({ball({-0.04 - 0.5 * gap_m, 0, 0}, 0.04),
                                                ball({0.04 + 0.5 * gap_m, 0.01, 0}, 0.035)},
                                               cameras, 0.004));
    if (parts.size() == 2 && left == 0) left = parts[0].id, right = parts[1].id;
    if (parts.size() == 1 && !was_joined) {
      was_joined = true;
      EXPECT_EQ(parts[0].origin, collision::ComponentOrigin::merged);
      EXPECT_EQ(parts[0].from.size(), 2u);
      joined = parts[0].id;
      EXPECT_NE(joined, left);
      EXPECT_NE(joined, right);
    } else if (parts.size() == 2 && was_joined && !was_split) {
      was_split = true;
      for (const collision::TrackedComponent& p : parts) {
        EXPECT_EQ(p.origin, collision::ComponentOrigin::split);
        EXPECT_EQ(p.from, std::vector<std::uint64_t>{joined});
        EXPECT_GT(p.id, joined);
      }
    } else if (frame > 0) {
      for (const collision::TrackedComponent& p : parts)
        EXPECT_EQ(p.origin, collision::ComponentOrigin::tracked) << frame;
    }
  }
  EXPECT_TRUE(was_joined && was_split);
}

// Their boxes meet, they don't: a speck, and a ball of a fifth of the rod's volume.
TEST(ComponentTracker, ComponentBesideARodIsNotMerged) {
  const std::vector<geometry::Camera> cameras = lab_cameras();
  const hull::Capsule rod{{-0.15, -0.15, 0}, {0.15, 0.15, 0}, 0.02};
  for (const double radius_m : {0.008, 0.03}) {
    const hull::Capsule beside = ball(0.11 * Vector3d(1, -1, 0).normalized(), radius_m);
    collision::ComponentTracker tracker;
    for (int frame = 0; frame < 24; ++frame) {
      const bool is_there = frame % 4 == 3;
      const auto& parts = tracker.add(
          frame * kFrame_s,
          parts_of(is_there ? std::vector{rod, beside} : std::vector{rod}, cameras, 0.002));
      ASSERT_EQ(parts.size(), is_there ? 2u : 1u) << frame;
      EXPECT_EQ(parts[0].id, 1u) << frame;
      EXPECT_EQ(parts[0].origin, frame > 0 ? collision::ComponentOrigin::tracked
                                           : collision::ComponentOrigin::appeared)
          << frame;
      if (!is_there) continue;
      EXPECT_EQ(parts[1].origin, collision::ComponentOrigin::appeared) << frame;
      EXPECT_TRUE(parts[1].from.empty());
    }
  }
}

// One that is a quarter of the other is clearly not it, and is said to join it and to leave it.
TEST(ComponentTracker, LargerComponentKeepsItsIdThroughAMerge) {
  const std::vector<geometry::Camera> cameras = lab_cameras();
  collision::ComponentTracker tracker;
  int merged = 0, split = 0;
  for (int frame = 0; frame < 40; ++frame) {
    const double gap_m = std::abs(frame - 19.5) * 0.004 - 0.02;
    const auto& parts =
        tracker.add(frame * kFrame_s,
                    parts_of({ball({-0.05, 0, 0}, 0.05), ball({0.032 + gap_m, 0.01, 0}, 0.032)},
                             cameras, 0.004));
    merged += parts[0].origin == collision::ComponentOrigin::merged &&
              parts[0].from == std::vector<std::uint64_t>{1, 2};
    for (const collision::TrackedComponent& p : parts)
      split += p.origin == collision::ComponentOrigin::split;
  }
  EXPECT_EQ(merged, 1);
  EXPECT_EQ(split, 2);
}

collision::HullComponent at_place(const Vector3d& p, double volume_m3 = 1e-4) {
  collision::HullComponent part;
  part.centroid_world_m = p;
  part.volume_m3 = volume_m3;
  part.covariance_world_m2 = Eigen::Vector3d(1e-4, 2e-4, 4e-4).asDiagonal();
  part.box_world_m = {p - Vector3d::Constant(0.01), p + Vector3d::Constant(0.01)};
  part.cells = 100;
  return part;
}

TEST(ComponentTracker, AmbiguousMatchGetsNewId) {
  collision::ComponentTracker tracker;
  tracker.add(0.01, {at_place({-0.02, 0, 0}), at_place({0.02, 0, 0})});
  const auto& parts = tracker.add(0.02, {at_place({0, 0.001, 0})});  // half way between: either
  EXPECT_NE(parts[0].origin, collision::ComponentOrigin::tracked);
  EXPECT_EQ(parts[0].id, 3u);
}

TEST(ComponentTracker, TracksMotionLargerThanTheComponent) {
  collision::ComponentTracker tracker;
  for (int frame = 0; frame < 6; ++frame) {
    const auto& parts =
        tracker.add(1 + frame * kFrame_s, {at_place(frame * kFrame_s * Vector3d(5, 0, 0))});
    EXPECT_EQ(parts[0].id, 1u);
    if (frame >= 2) {
      EXPECT_LT((parts[0].motion->velocity_world_m_s - Vector3d(5, 0, 0)).norm(), 1e-9);
    }
  }
  EXPECT_EQ(tracker.add(1.2, {at_place({3, 0, 0})})[0].origin,
            collision::ComponentOrigin::appeared);  // nothing moves that fast
}

TEST(ComponentTracker, VolumeChangeAssignsANewId) {
  collision::ComponentTracker tracker;
  tracker.add(0.01, {at_place({0, 0, 0})});
  EXPECT_NE(tracker.add(0.02, {at_place({0, 0, 0}, 5e-4)})[0].origin,
            collision::ComponentOrigin::tracked);
}

TEST(ComponentTracker, LongGapAssignsNewIds) {
  collision::ComponentTracker tracker({.max_gap_s = 0.25});
  tracker.add(1, {at_place({0, 0, 0})});
  EXPECT_EQ(tracker.add(1.24, {at_place({0, 0, 0})})[0].id, 1u);
  EXPECT_EQ(tracker.add(1.5, {at_place({0, 0, 0})})[0].id, 2u);
  EXPECT_EQ(tracker.parts()[0].origin, collision::ComponentOrigin::appeared);
  EXPECT_EQ(tracker.add(3601.5, {at_place({4, 0, 0})})[0].id, 3u);
  EXPECT_THROW(collision::ComponentTracker({.max_gap_s = 0}), std::invalid_argument);
  EXPECT_THROW(collision::ComponentTracker({.max_gap_s = std::numeric_limits<double>::quiet_NaN()}),
               std::invalid_argument);
}

TEST(ComponentTracker, BackwardTimeResetsAndIdsAreNeverReused) {
  collision::ComponentTracker tracker;
  tracker.add(5, {at_place({0, 0, 0})});
  EXPECT_EQ(tracker.add(4, {at_place({0, 0, 0})})[0].id, 2u);
  EXPECT_EQ(tracker.parts()[0].origin, collision::ComponentOrigin::appeared);
  EXPECT_THROW(tracker.add(std::numeric_limits<double>::quiet_NaN(), {}), std::invalid_argument);
  EXPECT_THROW(collision::ComponentTracker({.window_frames = 2}), std::invalid_argument);
}

}  // namespace
}  // namespace fivepipe::test
