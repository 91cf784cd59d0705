// Layouts of a part against recorded frames: the same verdicts as detection of single layouts.
#include "common/study/spacing_study.h"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "common/collision/detection/cpu/cpu_detector.h"
#include "common/collision/oracle/distance_reference.h"
#include "common/collision/proximity/proximity.h"
#include "common/hull/query/hull_query.h"
#include "tests/support/collision/scene.h"
#include "tests/support/hull/test_pool.h"

namespace fivepipe::study {
namespace {

using collision::SpacingInterval;
using Eigen::Vector3d;
using test::test_pool;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr SpacingInterval kRange{-0.15, 0.25};

// A hand that moves past the part and back.
StudyFrame frame_at(double t) {
  return {test::hand_among(4, 200, {-0.25 + 0.3 * std::sin(3 * t), 0.02 * std::cos(5 * t), 0}),
          0.05};
}

collision::MovablePart part() {
  return {geometry::box_mesh({0.05, 0.15, 0.12}, 0.03), test::at({0, 0, 0.02}), Vector3d::UnitX()};
}

std::vector<double> equally_spaced(int count) {
  std::vector<double> spacings_m;
  for (int i = 0; i < count; ++i)
    spacings_m.push_back(std::min(
        kRange.high_m, kRange.low_m + (kRange.high_m - kRange.low_m) * i / std::max(1, count - 1)));
  return spacings_m;
}

LineResult studied(int frames, const std::vector<double>& spacings_m, bool with_distances = true,
                   int threads = 2) {
  base::WorkerPool pool(threads);
  SpacingStudy study({{part(), kRange, spacings_m, with_distances}}, {}, pool);
  for (int i = 0; i < frames; ++i) study.add(frame_at(0.05 * i));
  const LineResult result = study.results().front();
  EXPECT_EQ(study.frames(), std::size_t(frames));
  EXPECT_NEAR(study.duration_s(), 0.05 * frames, 1e-9);
  return result;
}

// One frame as a single layout is detected.
struct SingleFrame {
  StudyFrame frame;
  hull::CpuHull hull{test_pool(), frame.silhouettes};
  hull::HullQuery query{hull};
  std::unique_ptr<collision::CollisionDetector> detector;
  explicit SingleFrame(StudyFrame f, double eps_m = 0.5e-3)
      : frame(std::move(f)), detector(collision::cpu_detector({.eps_m = eps_m, .spacing_m = 0})) {
    detector->set_hull(query, frame.silhouettes);
  }
  bool collides(double spacing_m) {
    const collision::MovablePart moved = part();
    const std::vector<collision::DetectionObject> objects{{&moved.tree(), moved.pose(spacing_m)}};
    return detector->detect(objects)[0].colliding();
  }
};

TEST(SpacingStudy, EqualsDetectionOfSingleLayouts) {
  constexpr int kFrames = 50;
  const std::vector<double> spacings_m = equally_spaced(50);
  const LineResult result = studied(kFrames, spacings_m);
  std::vector<std::size_t> colliding(spacings_m.size());
  for (int i = 0; i < kFrames; ++i) {
    SingleFrame frame(frame_at(0.05 * i));
    for (std::size_t k = 0; k < spacings_m.size(); ++k)
      colliding[k] += frame.collides(spacings_m[k]);
  }
  std::size_t with_collision = 0;
  for (std::size_t k = 0; k < spacings_m.size(); ++k) {
    const LayoutResult& layout = result.layouts[k];
    EXPECT_EQ(layout.spacing_m, spacings_m[k]);
    EXPECT_EQ(layout.colliding_frames, colliding[k]) << spacings_m[k];
    EXPECT_NEAR(layout.collision_s, 0.05 * double(colliding[k]), 1e-9);
    with_collision += colliding[k] > 0;
  }
  EXPECT_GT(with_collision, 10u);
  EXPECT_LT(with_collision, 45u);
}

// The part's face crosses wires. The sweep finds balls in the hull of any radius, detection with a
// large eps_m finds few of them.
TEST(SpacingStudy, WiresThinnerThanEpsEqualDetectionOfSingleLayouts) {
  constexpr double kEps_m = 0.5;
  const std::vector<double> spacings_m{-0.028, -0.025, -0.022};
  int touching = 0, colliding = 0;
  for (int i = 0; i < 20; ++i) {
    const Vector3d end_m(5e-3, 0.0113 + 0.0007 * i, 0.0071 - 0.0003 * i);
    const StudyFrame wire{test::silhouettes_of({{end_m - Vector3d(0.01, 0, 0), end_m, 2e-4}},
                                               test::ring(4, 1.2, 0.6, 400, 0.05)),
                          0.05};
    base::WorkerPool pool(1);
    SpacingStudy study({{part(), kRange, spacings_m, false}}, {.eps_m = kEps_m}, pool);
    study.add(wire);
    const LineResult result = study.results().front();
    SingleFrame frame(wire, kEps_m);
    const collision::SpacingVerdicts found =
        collision::SpacingSweep(frame.query, {.solid_m = 0})(part(), kRange);
    for (const LayoutResult& layout : result.layouts) {
      const bool collides = frame.collides(layout.spacing_m);
      EXPECT_EQ(layout.colliding_frames, collides ? 1u : 0u) << i << ' ' << layout.spacing_m;
      colliding += collides;
      touching += verdict_at(found, layout.spacing_m) == collision::SpacingVerdict::colliding;
    }
  }
  EXPECT_GE(touching, colliding + 20);
}

TEST(SpacingStudy, FreeIntervalsAreFreeInEachFrame) {
  constexpr int kFrames = 40;
  const LineResult result = studied(kFrames, {});
  ASSERT_FALSE(result.free.empty());
  std::vector<double> in_free_m;
  for (const SpacingInterval& i : result.free)
    for (const double at : {0.0, 0.3, 1.0})
      in_free_m.push_back(i.low_m + at * (i.high_m - i.low_m));
  for (int i = 0; i < kFrames; ++i) {
    SingleFrame frame(frame_at(0.05 * i));
    for (const double spacing_m : in_free_m) EXPECT_FALSE(frame.collides(spacing_m)) << spacing_m;
  }
  const double min_m = min_free_spacing_m(result, kRange);
  EXPECT_EQ(min_m, result.free.back().low_m);
  EXPECT_EQ(result.free.back().high_m, kRange.high_m);
}

TEST(SpacingStudy, MinFreeSpacingIsTheLowEndOfTheLastInterval) {
  EXPECT_EQ(min_free_spacing_m({{}, {}}, kRange), kInfinity);
  EXPECT_EQ(min_free_spacing_m({{}, {{-0.1, 0.1}}}, kRange), kInfinity);
  EXPECT_EQ(min_free_spacing_m({{}, {{-0.1, 0.1}, {0.2, 0.25}}}, kRange), 0.2);
}

// The nearest triangle of each frame, one by one, and points of the part by the exact reference.
TEST(SpacingStudy, ClearanceContainsTheReference) {
  constexpr int kFrames = 12;
  const std::vector<double> spacings_m = equally_spaced(9);
  const LineResult result = studied(kFrames, spacings_m);
  const collision::MovablePart moved = part();
  test::Random random(7);
  int measured = 0;
  for (std::size_t k = 0; k < spacings_m.size(); ++k) {
    const Bracket& clearance = result.layouts[k].clearance;
    double least_min_m = kInfinity, least_max_m = kInfinity, least_reference_m = kInfinity;
    for (int i = 0; i < kFrames; ++i) {
      SingleFrame frame(frame_at(0.05 * i));
      collision::HullProximity proximity(frame.query, {.cap_m = 0.1, .tolerance_m = 5e-5});
      const std::vector<collision::Triangle> triangles =
          collision::world_triangles(moved.tree().mesh(), moved.pose(spacings_m[k]));
      std::vector<collision::Proximity> of_triangles(triangles.size());
      proximity.of_triangles(triangles, of_triangles);
      for (const collision::Proximity& p : of_triangles) {
        least_min_m = std::min(least_min_m, p.min_m);
        least_max_m = std::min(least_max_m, p.max_m);
      }
      const collision::HullDistance reference(frame.frame.silhouettes);
      for (int sample = 0; sample < 20; ++sample) {
        const auto& [a, b, c] = triangles[random() % triangles.size()];
        const double u = test::uniform(random, 0, 1), v = test::uniform(random, 0, 1 - u);
        least_reference_m =
            std::min(least_reference_m,
                     reference.clearance_m(a + u * (b - a) + v * (c - a), 0.1, 1e-3).max_m);
      }
    }
    EXPECT_LE(clearance.min_m, least_max_m) << spacings_m[k];
    EXPECT_LE(clearance.min_m, least_reference_m) << spacings_m[k];
    EXPECT_GE(clearance.max_m, least_min_m) << spacings_m[k];
    if (std::isfinite(clearance.max_m)) {
      EXPECT_LE(clearance.max_m - clearance.min_m, 2e-3);
      measured += clearance.min_m > 0;
    } else {
      EXPECT_GE(clearance.min_m, 0.1);
      EXPECT_GE(least_min_m, 0.1);
    }
  }
  EXPECT_GE(measured, 1);
}

// How far the part is in the way: the nearest spacing that does not collide, tried in steps.
TEST(SpacingStudy, PenetrationContainsTheNearestFreeSpacing) {
  constexpr double kStep_m = 0.5e-3;
  const std::vector<double> spacings_m = equally_spaced(17);
  int bounded = 0;
  for (int i = 0; i < 12; ++i) {
    SingleFrame frame(frame_at(0.4 * i));
    base::WorkerPool pool(1);
    SpacingStudy study({{part(), kRange, spacings_m}}, {}, pool);
    study.add(frame_at(0.4 * i));
    std::vector<double> free_m;
    for (double s = kRange.low_m; s <= kRange.high_m; s += kStep_m)
      if (!frame.collides(s)) free_m.push_back(s);
    const LineResult result = study.results().front();
    for (const LayoutResult& layout : result.layouts) {
      if (layout.colliding_frames == 0) {
        EXPECT_EQ(layout.penetration, (Bracket{0, 0}));
        continue;
      }
      double nearest_m = kInfinity;
      for (const double s : free_m) nearest_m = std::min(nearest_m, std::abs(s - layout.spacing_m));
      EXPECT_LE(layout.penetration.min_m, nearest_m) << layout.spacing_m;
      EXPECT_GE(layout.penetration.max_m, nearest_m - 2 * kStep_m) << layout.spacing_m;
      if (std::isinf(nearest_m)) continue;
      EXPECT_LE(layout.penetration.max_m - layout.penetration.min_m, 2e-3) << layout.spacing_m;
      ++bounded;
    }
  }
  EXPECT_GT(bounded, 20);
}

TEST(SpacingStudy, PenetrationIsTheMaximumOverTheFrames) {
  base::WorkerPool pool(2);
  const std::vector<double> spacings_m = equally_spaced(9);
  SpacingStudy all({{part(), kRange, spacings_m}}, {}, pool);
  std::vector<LineResult> each;
  for (int i = 0; i < 6; ++i) {
    all.add(frame_at(0.4 * i));
    SpacingStudy one({{part(), kRange, spacings_m}}, {}, pool);
    one.add(frame_at(0.4 * i));
    each.push_back(one.results().front());
  }
  const LineResult result = all.results().front();
  for (std::size_t k = 0; k < spacings_m.size(); ++k) {
    Bracket largest{0, 0};
    for (const LineResult& of_frame : each)
      largest = {std::max(largest.min_m, of_frame.layouts[k].penetration.min_m),
                 std::max(largest.max_m, of_frame.layouts[k].penetration.max_m)};
    EXPECT_EQ(result.layouts[k].penetration, largest);
  }
}

// A batch is searched only below the clearances of the batches before.
TEST(SpacingStudy, ClearanceOfManyBatchesIsTheMinimumOfTheFrames) {
  base::WorkerPool pool(2);
  const std::vector<double> spacings_m{0.08, 0.1, 0.12, 0.14, 0.16, 0.18, 0.2, 0.22, 0.24};
  SpacingStudy all({{part(), kRange, spacings_m}}, {}, pool);
  std::vector<Bracket> smallest(spacings_m.size(), {kInfinity, kInfinity});
  // The hand comes nearest in the second batch.
  for (std::size_t i = 0; i < 3 * kFramesPerBatch; ++i) {
    const double turn = double(i) / double(3 * kFramesPerBatch - 1);
    const StudyFrame frame{
        test::hand_among(4, 200, {-0.25 + 0.2 * std::sin(std::numbers::pi * turn), 0, 0}), 0.05};
    all.add(frame);
    SpacingStudy one({{part(), kRange, spacings_m}}, {}, pool);
    one.add(frame);
    const LineResult of_frame = one.results().front();
    for (std::size_t k = 0; k < spacings_m.size(); ++k)
      smallest[k] = {std::min(smallest[k].min_m, of_frame.layouts[k].clearance.min_m),
                     std::min(smallest[k].max_m, of_frame.layouts[k].clearance.max_m)};
  }
  const LineResult result = all.results().front();
  int measured = 0;
  for (std::size_t k = 0; k < spacings_m.size(); ++k) {
    const Bracket& clearance = result.layouts[k].clearance;
    EXPECT_LE(clearance.min_m, smallest[k].max_m);
    EXPECT_GE(clearance.max_m, smallest[k].min_m);
    EXPECT_TRUE(clearance.max_m - clearance.min_m <= 2e-3 || clearance.min_m >= 0.1)
        << clearance.min_m << ' ' << clearance.max_m;
    measured += clearance.min_m > 0 && clearance.min_m < 0.1;
  }
  EXPECT_GE(measured, 2);
}

TEST(SpacingStudy, KnowsFramesWithoutAHullAndUnknownOnes) {
  base::WorkerPool pool(1);
  SpacingStudy study({{part(), kRange, {0.0}}}, {}, pool);
  StudyFrame empty = frame_at(0), unusable = frame_at(0);
  empty.silhouettes[1].pixels = hull::ObjectPixels(200, 200);
  unusable.silhouettes[1].camera.pinhole.fx_px = std::numeric_limits<double>::quiet_NaN();
  study.add(empty);
  LineResult result = study.results().front();
  EXPECT_EQ(study.empty_frames(), 1u);
  EXPECT_EQ(result.free, (std::vector<SpacingInterval>{kRange}));
  EXPECT_EQ(result.layouts[0].undecided_frames, 0u);
  study.add(unusable);
  result = study.results().front();
  EXPECT_EQ(study.empty_frames(), 1u);
  EXPECT_TRUE(result.free.empty());
  EXPECT_EQ(result.layouts[0].undecided_frames, 1u);
  EXPECT_EQ(result.layouts[0].colliding_frames, 0u);
  EXPECT_EQ(result.layouts[0].clearance.min_m, 0);
  EXPECT_EQ(result.layouts[0].penetration, (Bracket{0, std::numeric_limits<double>::infinity()}))
      << "the part may be as deep in the hull as any";
}

TEST(SpacingStudy, UsesTheRuleOfTheHull) {
  base::WorkerPool pool(1);
  StudyOptions above;
  above.rule.within_world_m =
      Eigen::AlignedBox3d(Vector3d(-1, -1, 0.5), Vector3d(1, 1, 1));  // above the hand
  SpacingStudy study({{part(), kRange, equally_spaced(5)}}, above, pool),
      everywhere({{part(), kRange, equally_spaced(5)}}, {}, pool);
  study.add(frame_at(0.5));
  everywhere.add(frame_at(0.5));
  EXPECT_EQ(study.results().front().free, (std::vector<SpacingInterval>{kRange}));
  EXPECT_NE(everywhere.results().front().free, (std::vector<SpacingInterval>{kRange}));
}

TEST(SpacingStudy, DoesNotDependOnTheNumberOfThreads) {
  const LineResult one = studied(70, equally_spaced(11), true, 1),
                   three = studied(70, equally_spaced(11), true, 3);
  EXPECT_EQ(one.free, three.free);
  for (std::size_t k = 0; k < one.layouts.size(); ++k) {
    EXPECT_EQ(one.layouts[k].colliding_frames, three.layouts[k].colliding_frames);
    EXPECT_EQ(one.layouts[k].collision_s, three.layouts[k].collision_s);
    EXPECT_EQ(one.layouts[k].clearance, three.layouts[k].clearance);
    EXPECT_EQ(one.layouts[k].penetration, three.layouts[k].penetration);
  }
}

TEST(SpacingStudy, EachLineHasItsResult) {
  base::WorkerPool pool(2);
  const collision::MovablePart far(geometry::box_mesh({0.01, 0.01, 0.01}), test::at({0, 0, 5}),
                                   Vector3d::UnitX());
  SpacingStudy study({{part(), kRange, {0.1}}, {far, kRange, {-0.1, 0.1}}}, {}, pool);
  for (int i = 0; i < 5; ++i) study.add(frame_at(0.5));
  const std::vector<LineResult> results = study.results();
  ASSERT_EQ(results.size(), 2u);
  EXPECT_EQ(results[1].free, (std::vector<SpacingInterval>{kRange}));
  ASSERT_EQ(results[1].layouts.size(), 2u);
  EXPECT_EQ(results[1].layouts[0].colliding_frames, 0u);
  EXPECT_EQ(results[1].layouts[0].clearance, (Bracket{0.1, kInfinity}));
}

// Two parts on different lines; a frame counts once, whichever of them collides.
TEST(SpacingStudy, JointLayoutsCollideIfOneOfTheirPartsDoes) {
  constexpr int kFrames = 40;
  const std::vector<double> spacings_m = equally_spaced(9);
  const collision::MovablePart other = part().beside({-0.08, 0, 0}, {0, 0.6, -0.8});
  std::vector<JointLayout> joint;
  for (std::size_t i = 0; i < 9; ++i)
    for (std::size_t k = 0; k < 9; k += 2) joint.push_back({{0, i}, {1, k}});
  joint.push_back({{1, 3}});
  base::WorkerPool pool(2);
  SpacingStudy study({{part(), kRange, spacings_m}, {other, kRange, spacings_m}}, {}, pool, joint);
  std::vector<std::size_t> colliding(joint.size());
  std::size_t in_both = 0;
  for (int i = 0; i < kFrames; ++i) {
    study.add(frame_at(0.05 * i));
    SingleFrame frame(frame_at(0.05 * i));
    const auto collides = [&](const PlaceOnLine& place) {
      const collision::MovablePart moved = place.line == 0 ? part() : other;
      const collision::DetectionObject object{&moved.tree(), moved.pose(spacings_m[place.spacing])};
      return frame.detector->detect({&object, 1})[0].colliding();
    };
    for (std::size_t k = 0; k < joint.size(); ++k) {
      const auto count = std::ranges::count_if(joint[k], collides);
      colliding[k] += count > 0;
      in_both += count == 2;
    }
  }
  EXPECT_GT(in_both, 10u) << "the sum over the parts would be wrong";
  const std::vector<LineResult> lines = study.results();
  const std::vector<LayoutResult> found = study.joint_results();
  ASSERT_EQ(found.size(), joint.size());
  for (std::size_t k = 0; k < joint.size(); ++k) {
    EXPECT_EQ(found[k].colliding_frames, colliding[k]) << k;
    EXPECT_NEAR(found[k].collision_s, 0.05 * double(colliding[k]), 1e-9);
    Bracket clearance{0.1, kInfinity}, penetration{0, 0};
    for (const auto& [line, spacing] : joint[k]) {
      const LayoutResult& of_part = lines[line].layouts[spacing];
      clearance = {std::min(clearance.min_m, of_part.clearance.min_m),
                   std::min(clearance.max_m, of_part.clearance.max_m)};
      penetration = {std::max(penetration.min_m, of_part.penetration.min_m),
                     std::max(penetration.max_m, of_part.penetration.max_m)};
    }
    EXPECT_EQ(found[k].clearance, clearance);
    EXPECT_EQ(found[k].penetration, penetration);
  }
  EXPECT_THROW(SpacingStudy({{part(), kRange, {0.1}}}, {}, pool, {{{0, 1}}}),
               std::invalid_argument);
  EXPECT_THROW(SpacingStudy({{part(), kRange, {0.1}}}, {}, pool, {{{1, 0}}}),
               std::invalid_argument);
}

TEST(SpacingStudy, ReportsEachComputedFrame) {
  base::WorkerPool pool(2);
  SpacingStudy study({{part(), kRange, {0.1}}}, {}, pool);
  std::vector<std::size_t> computed;
  study.on_frame([&](std::size_t frames) { computed.push_back(frames); });
  for (std::size_t i = 0; i < kFramesPerBatch + 2; ++i) study.add(frame_at(0));
  ASSERT_EQ(computed.size(), kFramesPerBatch);
  EXPECT_EQ(computed.back(), kFramesPerBatch);
  study.results();
  EXPECT_EQ(computed.size(), kFramesPerBatch + 2);
  EXPECT_EQ(computed.back(), 2u);
}

TEST(SpacingStudy, RefusesSpacingsOutOfOrderOrRange) {
  base::WorkerPool pool(1);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const std::vector<double>& spacings_m :
       {std::vector<double>{0.1, 0}, {-1}, {1}, {nan}, {0, nan, 0.1}})
    EXPECT_THROW(SpacingStudy({{part(), kRange, spacings_m}}, {}, pool), std::invalid_argument);
  for (const SpacingInterval& range : {SpacingInterval{1, 0}, {nan, 1}, {0, kInfinity}})
    EXPECT_THROW(SpacingStudy({{part(), range, {}}}, {}, pool), std::invalid_argument);
  for (const StudyOptions& options :
       {StudyOptions{{}, 0}, {{}, 1e308}, {{}, 1e-3, 0}, {{}, 1e-3, kInfinity}, {{}, 1e-3, 0.1, 0}})
    EXPECT_THROW(SpacingStudy({{part(), kRange, {}}}, options, pool), std::invalid_argument);
}

}  // namespace
}  // namespace fivepipe::study
