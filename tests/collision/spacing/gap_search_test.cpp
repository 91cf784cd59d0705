// What a sweep left undecided, against the exact reference of triangles and single detections.
#include "common/collision/spacing/gap_search.h"

#include <gtest/gtest.h>

#include "common/collision/oracle/triangle_reference.h"
#include "tests/collision/spacing/swept_frame.h"

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;
using test::length_m;
using Frame = test::SweptFrame;

// Whether a point of the part's surface is in the hull, exactly.
bool touches(const Frame& frame, const MovablePart& part, double spacing_m) {
  return std::ranges::any_of(world_triangles(part.tree().mesh(), part.pose(spacing_m)),
                             [&](const Triangle& triangle) {
                               return !weights_in_hull(frame.silhouettes, triangle).empty();
                             });
}

MovablePart random_part(test::Random& random) {
  Eigen::Isometry3d pose = test::at(test::random_in_ball(random, 0.1));
  pose.rotate(test::random_rotation(random, 0, 3));
  return {geometry::box_mesh({0.1, 0.05, 0.01}, 0), pose, test::random_direction(random)};
}

TEST(GapSearch, WhatTouchesTouchesByTheExactReference) {
  test::Random random(52);
  double added_m = 0;
  int tested = 0;
  for (int scene = 0; scene < 30; ++scene) {
    Frame frame(test::silhouettes_of(
        {test::random_cameras(random, 3 + scene % 3), test::random_object(random, 3)}));
    const MovablePart part = random_part(random);
    const SpacingInterval range{-0.3, 0.3};
    const SpacingVerdicts swept = frame.sweep(part, range);
    SpacingVerdicts found = swept;
    narrow_gaps(found, part, range, frame.query, *frame.detector);
    EXPECT_EQ(found.free, swept.free);
    EXPECT_EQ(found.colliding, swept.colliding);
    const double added_here_m = length_m(found.touching) - length_m(swept.touching);
    EXPECT_GE(added_here_m, -1e-12);
    added_m += added_here_m;
    for (std::size_t i = 0; i < found.touching.size(); ++i) {
      const auto [low_m, high_m] = found.touching[i];
      if (i > 0) {
        EXPECT_GT(low_m, found.touching[i - 1].high_m);
      }
      for (const double at : {0.0, 0.01, 0.37, 1.0}) {
        const double spacing_m = low_m + at * (high_m - low_m);
        EXPECT_TRUE(touches(frame, part, spacing_m)) << scene << ' ' << spacing_m;
        EXPECT_NE(verdict_at(found, spacing_m), SpacingVerdict::free) << scene << ' ' << spacing_m;
        ++tested;
      }
    }
  }
  EXPECT_GT(tested, 50);
  EXPECT_GT(added_m, 0.001);
}

// In a gap that is still wide, no part of a triangle in the hull is known.
TEST(GapSearch, LeavesNoGapInACollision) {
  test::Random random(53);
  int collisions = 0;
  for (int scene = 0; scene < 30; ++scene) {
    Frame frame(test::silhouettes_of(
        {test::random_cameras(random, 3 + scene % 3), test::random_object(random, 3)}));
    const MovablePart part = random_part(random);
    const SpacingInterval range{-0.3, 0.3};
    SpacingVerdicts found = frame.sweep(part, range);
    narrow_gaps(found, part, range, frame.query, *frame.detector);
    std::vector<SpacingInterval> known = found.free;
    known.insert(known.end(), found.touching.begin(), found.touching.end());
    std::ranges::sort(known, {}, &SpacingInterval::low_m);
    double from_m = range.low_m;
    known.push_back({range.high_m, range.high_m});
    for (const SpacingInterval& i : known) {
      if (i.low_m - from_m > 3 * kNarrowGap_m) {
        for (const double at : {0.25, 0.5, 0.75})
          EXPECT_FALSE(frame.collides(part, from_m + at * (i.low_m - from_m)))
              << scene << ' ' << from_m << ' ' << i.low_m;
      }
      from_m = std::max(from_m, i.high_m);
    }
    collisions += !found.touching.empty();
  }
  EXPECT_GT(collisions, 8);
}

// A gap between two collisions may be free, however short it is.
TEST(GapSearch, ClosesShortGapsBetweenCollisions) {
  Frame frame(
      test::silhouettes_of({test::ball(test::kOrigin, 0.05)}, test::ring(8, 1.2, 0.5, 400, 0.4)));
  const MovablePart part(geometry::box_mesh({0.02, 0.2, 0.2}), test::at({-0.2, 0, 0}),
                         Vector3d::UnitX());
  SpacingVerdicts found;
  found.free = {{0, 0.12}, {0.28, 0.4}};
  found.touching = {{0.15, 0.2}, {0.2001, 0.25}};
  narrow_gaps(found, part, {0, 0.4}, frame.query, *frame.detector);
  ASSERT_EQ(found.touching.size(), 1u);
  EXPECT_LT(found.touching[0].low_m, 0.145);
  EXPECT_GT(found.touching[0].high_m, 0.255);
}

TEST(GapSearch, EndsWhereNothingCanBeFound) {
  Frame frame(test::silhouettes_of({}, test::ring(3, 1, 0.5, 50, 0.5)));
  const MovablePart part(geometry::box_mesh({0.02, 0.2, 0.2}), test::at(test::kOrigin),
                         Vector3d::UnitX());
  SpacingVerdicts found;
  narrow_gaps(found, part, {-1, 1}, frame.query, *frame.detector);
  EXPECT_TRUE(found.touching.empty());
}

}  // namespace
}  // namespace fivepipe::collision
