// Spacings of a part that are free of the hull, against certified detection at single spacings.
#include "common/collision/spacing/spacing_sweep.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/collision/spacing/swept_frame.h"

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;
using test::length_m;
using test::test_pool;
using Frame = test::SweptFrame;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// Each list is ascending, disjoint and in the range, and no spacing is in both.
void expect_well_formed(const SpacingVerdicts& found, const SpacingInterval& range) {
  std::vector<SpacingInterval> all;
  for (const SpacingInterval& i : found.colliding)
    EXPECT_TRUE(std::ranges::any_of(found.touching, [&](const SpacingInterval& touching) {
      return touching.low_m <= i.low_m && i.high_m <= touching.high_m;
    }));
  for (const auto& list : {found.free, found.touching}) {
    for (std::size_t i = 0; i < list.size(); ++i) {
      EXPECT_LE(list[i].low_m, list[i].high_m);
      EXPECT_GE(list[i].low_m, range.low_m);
      EXPECT_LE(list[i].high_m, range.high_m);
      if (i > 0) {
        EXPECT_GT(list[i].low_m, list[i - 1].high_m);
      }
    }
    all.insert(all.end(), list.begin(), list.end());
  }
  std::ranges::sort(all, {}, &SpacingInterval::low_m);
  for (std::size_t i = 1; i < all.size(); ++i) EXPECT_GE(all[i].low_m, all[i - 1].high_m);
}

// The detector agrees at `count` spacings and at the ends of all intervals.
void expect_agreement(Frame& frame, const MovablePart& part, const SpacingInterval& range,
                      const SpacingVerdicts& found, int count) {
  std::vector<double> spacings_m;
  for (int i = 0; i < count; ++i)
    spacings_m.push_back(range.low_m + (range.high_m - range.low_m) * (i + 0.5) / count);
  for (const auto& list : {found.free, found.colliding})
    for (const SpacingInterval& i : list) spacings_m.insert(spacings_m.end(), {i.low_m, i.high_m});
  for (const double spacing_m : spacings_m) {
    const SpacingVerdict verdict = verdict_at(found, spacing_m);
    if (verdict == SpacingVerdict::undecided) continue;
    EXPECT_EQ(frame.collides(part, spacing_m), verdict == SpacingVerdict::colliding) << spacing_m;
  }
}

MovablePart plate(const Vector3d& at_m, const Vector3d& axis = Vector3d::UnitX()) {
  return {geometry::box_mesh({0.02, 0.2, 0.2}, 0.02), test::at(at_m), axis};
}

// A ball of 5 cm at the origin, and a plate of 2 cm that moves through it.
TEST(SpacingSweep, FindsBothSidesOfABall) {
  Frame frame(
      test::silhouettes_of({test::ball(test::kOrigin, 0.05)}, test::ring(8, 1.2, 0.5, 400, 0.4)));
  const MovablePart part = plate({-0.2, 0, 0});
  const SpacingInterval range{0, 0.4};
  const SpacingVerdicts found = frame.sweep(part, range);
  expect_well_formed(found, range);
  ASSERT_EQ(found.free.size(), 2u);
  ASSERT_EQ(found.colliding.size(), 1u);
  // The hull is larger than the ball, by two pixels of 1 mm and by its corners.
  EXPECT_LT(found.free[0].high_m, 0.2 - 0.06);
  EXPECT_GT(found.free[0].high_m, 0.2 - 0.06 - 0.012);
  EXPECT_GT(found.free[1].low_m, 0.2 + 0.06);
  EXPECT_LT(found.free[1].low_m, 0.2 + 0.06 + 0.012);
  EXPECT_LT(found.colliding[0].low_m - found.free[0].high_m, 0.004);
  EXPECT_LT(found.free[1].low_m - found.colliding[0].high_m, 0.004);
  expect_agreement(frame, part, range, found, 200);
}

// Bisection between a free and a colliding spacing would not find the arm behind the part.
TEST(SpacingSweep, AnArmBehindThePartLimitsItFromBehind) {
  Frame frame(test::silhouettes_of(
      {{Vector3d(-0.15, -0.3, 0), Vector3d(-0.15, 0.3, 0), 0.01}, test::ball({0.15, 0, 0}, 0.03)},
      test::ring(6, 1.5, 0.9, 400, 0.8)));
  const MovablePart part = plate(test::kOrigin);
  const SpacingInterval range{-0.3, 0.3};
  const SpacingVerdicts found = frame.sweep(part, range);
  expect_well_formed(found, range);
  ASSERT_EQ(found.free.size(), 3u);
  EXPECT_EQ(verdict_at(found, 0), SpacingVerdict::free);
  EXPECT_EQ(verdict_at(found, -0.15), SpacingVerdict::colliding);
  EXPECT_EQ(verdict_at(found, 0.15), SpacingVerdict::colliding);
  EXPECT_EQ(verdict_at(found, -0.29), SpacingVerdict::free);
  expect_agreement(frame, part, range, found, 200);
}

TEST(SpacingSweep, AgreesWithDetectionOnRandomScenes) {
  test::Random random(18);
  double undecided_m = 0, colliding_m = 0;
  for (int scene = 0; scene < 40; ++scene) {
    Frame frame(test::silhouettes_of(
        {test::random_cameras(random, 2 + scene % 4), test::random_object(random, 3)}));
    Eigen::Isometry3d pose = test::at(test::random_in_ball(random, 0.3));
    pose.rotate(test::random_rotation(random, 0, 3));
    const geometry::Mesh mesh =
        scene % 2 ? geometry::sphere_mesh(0.05, 2) : geometry::box_mesh({0.1, 0.05, 0.01}, 0);
    const MovablePart part(mesh, pose, test::random_vector(random, 0.1, 9));
    const SpacingInterval range{-test::uniform(random, 0, 0.4), test::uniform(random, 0, 0.4)};
    const SpacingVerdicts found = frame.sweep(part, range);
    expect_well_formed(found, range);
    expect_agreement(frame, part, range, found, 60);
    colliding_m += length_m(found.colliding);
    undecided_m += range.high_m - range.low_m - length_m(found.free) - length_m(found.colliding);
  }
  EXPECT_GT(colliding_m, 1);
  EXPECT_LT(undecided_m, 0.5);
  std::cout << "colliding " << colliding_m << " m, undecided " << undecided_m << " m\n";
}

// A ball is found in a mesh of many small triangles, too.
TEST(SpacingSweep, AFineMeshCollidesThroughout) {
  Frame frame(
      test::silhouettes_of({test::ball(test::kOrigin, 0.06)}, test::ring(6, 1.2, 0.5, 400, 0.4)));
  const MovablePart part(geometry::sphere_mesh(0.05, 6), test::at({-0.2, 0, 0}), Vector3d::UnitX());
  const SpacingInterval range{0, 0.4};
  const SpacingVerdicts found = frame.sweep(part, range);
  EXPECT_EQ(found.free.size(), 2u);
  ASSERT_GE(found.colliding.size(), 1u);
  EXPECT_LT(0.4 - length_m(found.free) - length_m(found.colliding), 0.02);
  expect_agreement(frame, part, range, found, 20);
}

// With a bounded volume, and with both limits of the hull.
TEST(SpacingSweep, AgreesWithDetectionWithOtherRules) {
  test::Random random(19);
  double colliding_m = 0;
  for (int scene = 0; scene < 30; ++scene) {
    const std::vector<hull::Silhouette> silhouettes = test::silhouettes_of(
        {test::narrow_cameras(random, 3 + scene % 3), test::random_object(random, 3)});
    hull::HullRule rule;
    if (scene % 2 != 0) rule = {.limits = hull::Limits::seen, .min_seen = 2};
    rule.within_world_m =
        Eigen::AlignedBox3d(Vector3d(-0.2, -0.25, -0.15), Vector3d(0.1, 0.2, 0.2));
    hull::CpuHull hull(test_pool(), silhouettes, rule);
    const hull::HullQuery query(hull);
    const auto detector = cpu_detector({.eps_m = 0.5e-3, .spacing_m = 0});
    detector->set_hull(query, silhouettes);
    const MovablePart part{geometry::box_mesh({0.1, 0.05, 0.03}, 0.03),
                           test::at(test::random_in_ball(random, 0.2)),
                           test::random_direction(random)};
    const SpacingInterval range{-0.3, 0.3};
    const SpacingVerdicts found = SpacingSweep(query, {})(part, range);
    expect_well_formed(found, range);
    EXPECT_TRUE(found.is_complete);
    colliding_m += length_m(found.colliding);
    for (int i = 0; i <= 60; ++i) {
      const double spacing_m = -0.3 + 0.01 * i;
      const SpacingVerdict verdict = verdict_at(found, spacing_m);
      if (verdict == SpacingVerdict::undecided) continue;
      const std::vector<DetectionObject> objects{{&part.tree(), part.pose(spacing_m)}};
      EXPECT_EQ(detector->detect(objects)[0].colliding(), verdict == SpacingVerdict::colliding)
          << scene << ' ' << spacing_m;
    }
  }
  EXPECT_GT(colliding_m, 0.5);
}

// A box with edges of 0.3 m, as seen by three cameras along its axes from 30 m, and a plate of the
// same width that moves through it: their faces are parallel. All is turned by world_from_box.
struct FlatFaces {
  static constexpr double kHalf_m = 0.15, kPlate_m = 0.01;
  Eigen::Isometry3d world_from_box;
  Frame frame;
  SpacingInterval range{0, 1.2};  // the plate's middle is in the middle of the box at 0.6

  FlatFaces(const Eigen::Isometry3d& pose, const Vector3d& up)
      : world_from_box(pose), frame(silhouettes(pose, up)) {}
  // camera_from_world of all cameras turns by the inverse of the pose.
  static std::vector<hull::Silhouette> silhouettes(const Eigen::Isometry3d& pose,
                                                   const Vector3d& up) {
    const geometry::OrientedBox box{pose, Vector3d::Constant(kHalf_m)};
    std::vector<hull::Silhouette> seen;
    for (const Vector3d& eye_m : {Vector3d(0, -30, 0), Vector3d(30, 0, 0), Vector3d(0, 0, 30)}) {
      geometry::Camera camera = test::camera_at(eye_m, 600, 1.2, test::kOrigin, up);
      camera.camera_from_world = camera.camera_from_world * pose.inverse();
      seen.push_back({camera, hull::true_object_pixels(box, camera)});
    }
    return seen;
  }
  MovablePart plate(double max_edge_m) const {
    return {geometry::box_mesh({kPlate_m, 2 * kHalf_m, 2 * kHalf_m}, max_edge_m),
            world_from_box * test::at({-0.6, 0, 0}), world_from_box.linear() * Vector3d::UnitX()};
  }
  // Up to the hull, which is larger than the box: by a pixel of 2 mm, and by the width of a pyramid
  // of pixels, which grows by 0.15 / 30 of its half width from the middle of the box to its end,
  // and by as much from its near end to the middle.
  void expect_free_up_to_the_hull(const SpacingVerdicts& found, double pixel_m) const {
    const double contact_m = 0.6 - kHalf_m - kPlate_m / 2,
                 excess_m = pixel_m + 2 * kHalf_m * kHalf_m / 30;
    ASSERT_EQ(found.free.size(), 2u);
    EXPECT_EQ(found.free[0].low_m, range.low_m);
    EXPECT_LE(found.free[0].high_m, contact_m);
    EXPECT_GT(found.free[0].high_m, contact_m - excess_m - 1e-3);
    EXPECT_GE(found.free[1].low_m, 1.2 - contact_m);
    EXPECT_LT(found.free[1].low_m, 1.2 - contact_m + excess_m + 1e-3);
    EXPECT_EQ(found.free[1].high_m, range.high_m);
    EXPECT_LT(1.2 - length_m(found.free) - length_m(found.touching), 2e-3);
  }
};

Eigen::Isometry3d turned(double angle_rad) {
  return Eigen::Isometry3d(Eigen::AngleAxisd(angle_rad, Vector3d(1, 2, 3).normalized()));
}

// Each test certifies a whole part of the face: with cubes, a face would need about (0.3 m / d)^2
// of them at a distance of d.
TEST(SpacingSweep, AFlatFaceBesideAParallelBorderIsFreeUpToTheHull) {
  for (const double angle_rad : {0.0, 0.8})
    for (const double max_edge_m : {0.0, 0.02}) {
      SCOPED_TRACE(testing::Message() << angle_rad << ' ' << max_edge_m);
      FlatFaces faces(turned(angle_rad), Vector3d(0, 1, 1));
      const MovablePart part = faces.plate(max_edge_m);
      const SpacingVerdicts found = faces.frame.sweep(part, faces.range);
      EXPECT_TRUE(found.is_complete);
      expect_well_formed(found, faces.range);
      faces.expect_free_up_to_the_hull(found, 2e-3);
      expect_agreement(faces.frame, part, faces.range, found, 40);
    }
}

// The images are rolled, and the tolerance is too small for the limit of the search.
TEST(SpacingSweep, AtItsLimitTheSearchLeavesOnlyWhatIsBesideContact) {
  FlatFaces faces(turned(0), Vector3d(0.3, 0.35, 0.8));
  const MovablePart part = faces.plate(0.02);
  const SpacingVerdicts found = faces.frame.sweep(part, faces.range, {.tolerance_m = 1e-9});
  EXPECT_FALSE(found.is_complete);
  expect_well_formed(found, faces.range);
  // A row of pixels that is not along the border has steps of two pixels.
  faces.expect_free_up_to_the_hull(found, 4e-3);
}

// A plate slides along a flat side of the hull at 0.2 mm: the search ends and says so.
TEST(SpacingSweep, EndsForAPartThatSlidesAlongTheHull) {
  const Eigen::AlignedBox3d box(Vector3d(-0.2, -0.2, -0.05), Vector3d(0.2, 0.2, 0.05));
  Frame frame(test::silhouettes_of_box(
      box, {test::camera_at({0, -3, 0.0}, 300, 0.6), test::camera_at({3, 0, 0.0}, 300, 0.6),
            test::camera_at({0, 0, 3}, 300, 0.6)}));
  double top_m = 0.05;  // of the hull, in its middle
  while (frame.query.contains({0, 0, top_m})) top_m += 1e-5;
  const MovablePart part(geometry::box_mesh({0.1, 0.1, 0.01}),
                         test::at({0, 0, top_m + 0.005 + 0.2e-3}), Vector3d::UnitX());
  const SpacingVerdicts found = frame.sweep(part, {-0.1, 0.1});
  expect_agreement(frame, part, {-0.1, 0.1}, found, 50);
  EXPECT_TRUE(found.colliding.empty() || !found.free.empty());
}

TEST(SpacingSweep, WithoutAHullAllIsFree) {
  const std::vector<geometry::Camera> cameras = test::ring(3, 1, 0.5, 50, 0.5);
  Frame frame(test::silhouettes_of({}, cameras));
  const SpacingVerdicts found = frame.sweep(plate(test::kOrigin), {-1, 1});
  EXPECT_EQ(found.free, (std::vector<SpacingInterval>{{-1, 1}}));
  EXPECT_TRUE(found.colliding.empty());
}

TEST(SpacingSweep, WithACameraThatIsNotFiniteNothingIsDecided) {
  std::vector<geometry::Camera> cameras = test::ring(3, 1, 0.5, 50, 0.5);
  std::vector<hull::Silhouette> silhouettes =
      test::silhouettes_of({test::ball(test::kOrigin, 0.1)}, cameras);
  silhouettes[1].camera.pinhole.fx_px = kNan;
  Frame frame(silhouettes);
  const SpacingVerdicts found = frame.sweep(plate(test::kOrigin), {-1, 1});
  EXPECT_TRUE(found.free.empty());
  EXPECT_TRUE(found.colliding.empty());
}

TEST(SpacingSweep, ARangeOfOneSpacingAndAPartWithoutTriangles) {
  Frame frame(test::hand_among());
  const SpacingVerdicts found = frame.sweep(plate({-0.05, 0, 0}), {0, 0});
  EXPECT_EQ(found.colliding, (std::vector<SpacingInterval>{{0, 0}}));
  EXPECT_EQ(frame.sweep(plate({-0.4, 0, 0}), {0, 0}).free, (std::vector<SpacingInterval>{{0, 0}}));
  const MovablePart nothing({}, test::at(test::kOrigin), Vector3d::UnitX());
  EXPECT_EQ(frame.sweep(nothing, {-1, 1}).free, (std::vector<SpacingInterval>{{-1, 1}}));
}

// A needle and a point still have a surface.
TEST(SpacingSweep, TrianglesWithoutAreaCollide) {
  Frame frame(test::hand_among());
  for (const double length_m : {0.02, 0.0}) {
    const geometry::Mesh mesh{{{0, 0, 0}, {0, length_m, 0}, {0, length_m / 2, 0}}, {{0, 1, 2}}};
    const MovablePart part(mesh, test::at({-0.05, 0, -0.2}), Vector3d::UnitZ());
    const SpacingInterval range{0, 0.4};
    const SpacingVerdicts found = frame.sweep(part, range);
    expect_agreement(frame, part, range, found, 100);
    EXPECT_EQ(found.free.size(), 2u);
    EXPECT_EQ(found.colliding.size(), 1u);
  }
}

// Certified verdicts agree for two orders of the triangles.
TEST(SpacingSweep, TheOrderOfTrianglesDoesNotMatter) {
  Frame frame(test::hand_among());
  geometry::Mesh mesh = geometry::box_mesh({0.03, 0.1, 0.1}, 0.02);
  const SpacingInterval range{-0.3, 0.3};
  const SpacingVerdicts before =
      frame.sweep({mesh, test::at(test::kOrigin), Vector3d::UnitX()}, range);
  std::ranges::reverse(mesh.triangles);
  for (auto& triangle : mesh.triangles)
    std::rotate(triangle.begin(), triangle.begin() + 1, triangle.end());
  const SpacingVerdicts after =
      frame.sweep({mesh, test::at(test::kOrigin), Vector3d::UnitX()}, range);
  for (int i = 0; i < 500; ++i) {
    const double spacing_m = -0.3 + 0.6 * i / 500;
    const auto a = verdict_at(before, spacing_m), b = verdict_at(after, spacing_m);
    if (a != SpacingVerdict::undecided && b != SpacingVerdict::undecided) {
      EXPECT_EQ(a, b);
    }
  }
  EXPECT_NEAR(length_m(before.free), length_m(after.free), 0.002);
}

// A part on another line shares the tree, and has the results of a part that is built there.
TEST(SpacingSweep, APartBesideEqualsOneThatIsThere) {
  test::Random random(11);
  int colliding = 0;
  for (int scene = 0; scene < 10; ++scene) {
    Frame frame(test::hand_among(4, 200, 0.05 * test::random_direction(random)));
    const Vector3d at_m = test::random_in_ball(random, 0.2),
                   first_m = test::random_in_ball(random, 0.1),
                   second_m = test::random_in_ball(random, 0.1),
                   axis = test::random_direction(random);
    const MovablePart there = plate(at_m + first_m + second_m, axis),
                      first = plate(at_m, Vector3d::UnitZ()).beside(first_m, Vector3d::UnitY()),
                      beside = first.beside(second_m, 3 * axis);
    EXPECT_EQ(&beside.tree(), &first.tree());
    EXPECT_LT((beside.move_world_m(0.1) - first_m - second_m - 0.1 * axis).norm(), 1e-12);
    const SpacingInterval range{-0.2, 0.2};
    const SpacingVerdicts found = frame.sweep(beside, range);
    expect_well_formed(found, range);
    expect_agreement(frame, beside, range, found, 40);
    expect_agreement(frame, there, range, found, 40);
    EXPECT_NEAR(length_m(found.free), length_m(frame.sweep(there, range).free), 1e-3);
    colliding += !found.colliding.empty();
  }
  EXPECT_GE(colliding, 5);
}

TEST(SpacingSweep, RefusesWhatIsNotFinite) {
  Frame frame(test::hand_among());
  const MovablePart part = plate(test::kOrigin);
  for (const SpacingInterval& range :
       {SpacingInterval{kNan, 1}, {0, kNan}, {0, HUGE_VAL}, {1, 0}, {0, 1001}, {-6e11, 0}})
    EXPECT_THROW(frame.sweep(part, range), std::invalid_argument);
  for (const SpacingOptions& options :
       {SpacingOptions{0, 0}, {-1, 0}, {kNan, 0}, {1e-3, -1}, {1e-3, kNan}})
    EXPECT_THROW(frame.sweep(part, {0, 1}, options), std::invalid_argument);
  for (const Vector3d& axis : {Vector3d(0, 0, 0), Vector3d(kNan, 0, 0), Vector3d(HUGE_VAL, 0, 0)})
    EXPECT_THROW(plate(test::kOrigin, axis), std::invalid_argument);
  EXPECT_THROW(plate({kNan, 0, 0}), std::invalid_argument);
  EXPECT_THROW(part.beside({kNan, 0, 0}, Vector3d::UnitX()), std::invalid_argument);
  EXPECT_THROW(part.beside({0, 0, 0}, {0, 0, 0}), std::invalid_argument);
}

}  // namespace
}  // namespace fivepipe::collision
