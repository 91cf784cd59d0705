// Hard cases of the exact reference for triangles: empty hulls, extreme sizes and distances,
// triangles seen edge-on or without area, and invalid input.
#include <algorithm>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "common/hull/oracle/reference.h"
#include "tests/collision/oracle/triangle_reference_checks.h"

namespace fivepipe::test {
namespace {

TEST(TriangleReference, NothingCrossesAnEmptyHull) {
  const collision::Triangle t{Eigen::Vector3d(-0.1, 0, 0), {0.1, 0, 0}, {0, 0.1, 0}};
  auto silhouettes = hand_among();
  EXPECT_TRUE(collision::triangle_truth(collision::HullDistance(silhouettes), t).crosses);
  silhouettes[2].pixels = hull::ObjectPixels(200, 200);
  for (const auto& none : {silhouettes, std::vector<hull::Silhouette>{}}) {
    const collision::TriangleTruth truth =
        collision::triangle_truth(collision::HullDistance(none), t);
    EXPECT_FALSE(truth.crosses);
    EXPECT_FALSE(truth.inside);
    EXPECT_EQ(truth.area_in_hull_m2, 0);
    EXPECT_EQ(truth.deepest_at_most_m, 0);
  }
}

TEST(TriangleReference, ReportsATriangleInsideTheHull) {
  const auto silhouettes = silhouettes_of({ball(kOrigin, 0.1)}, ring(3, 1, 0.5, 200, 0.5));
  const collision::TriangleTruth truth =
      collision::triangle_truth(collision::HullDistance(silhouettes),
                                {Eigen::Vector3d(0, 0, 0.01), {0.02, 0, 0.01}, {0, 0.02, 0.01}});
  EXPECT_TRUE(truth.inside);
  EXPECT_NEAR(truth.area_in_hull_m2, 0.0002, 1e-14);
  EXPECT_FALSE(
      collision::triangle_truth(collision::HullDistance(silhouettes),
                                {Eigen::Vector3d(0, 0, 0.01), {0.3, 0, 0.01}, {0, 0.02, 0.01}})
          .inside);
}

// The hull's section in a large triangle equals that in a 200 times smaller one in the same plane.
TEST(TriangleReference, FindsAHullOfOneCentimetreInATriangleOfTenMetres) {
  const auto silhouettes = silhouettes_of({ball({0.1, 0.2, 0}, 0.005)}, ring(3, 1, 0.5, 300, 0.6));
  const collision::HullDistance hull(silhouettes);
  const collision::Triangle large{Eigen::Vector3d(-5, -5, 0), {5, -5, 0}, {0, 5, 0}},
      small{Eigen::Vector3d(0.075, 0.175, 0), {0.125, 0.175, 0}, {0.1, 0.24, 0}};
  const collision::TriangleTruth of_large = collision::triangle_truth(hull, large),
                                 of_small = collision::triangle_truth(hull, small);
  EXPECT_GT(of_small.area_in_hull_m2, std::numbers::pi * 0.005 * 0.005);
  EXPECT_NEAR(of_large.area_in_hull_m2, of_small.area_in_hull_m2, 1e-9 * of_small.area_in_hull_m2);
  EXPECT_NEAR(
      of_large.deepest_m, of_small.deepest_m,
      collision::kDepthTolerance_m + collision::kDepthToleranceFraction * of_small.deepest_m);
}

TEST(TriangleReference, AgreesWithInHullForATriangleSeenEdgeOn) {
  Random random(8);
  const std::vector<hull::Capsule> object{ball(kOrigin, 0.05), ball({0.08, 0.02, 0}, 0.02)};
  const collision::Triangle t{Eigen::Vector3d(-0.1, -0.1, 0), {0.1, -0.1, 0}, {0, 0.15, 0}};
  for (const int size_px :
       {200, 201}) {  // The plane is on the border between two rows, and in the middle of a row.
    const auto by_every_camera = silhouettes_of(object, ring(3, 1, 0, size_px, 0.5));
    EXPECT_GT(check_samples(random, by_every_camera, t, 1000), 100);
    auto by_one = silhouettes_of(object, ring(3, 1, 0.6, size_px, 0.5));
    by_one.push_back(by_every_camera[0]);
    EXPECT_GT(check_samples(random, by_one, t, 1000), 100);
  }
}

// On a segment, the hull covers the intervals of the reference for rays.
TEST(TriangleReference, TreatsTrianglesWithoutAreaAsSegmentsAndPoints) {
  const auto silhouettes = hand_among();
  const Eigen::Vector3d a(-0.3, -0.02, 0.01), b(0.2, 0.05, 0.03),
      direction = b - a, outside(0.3, 0.3, 0.3), inside(0, 0, 0.02);
  const auto intervals = hull::reference_intervals(silhouettes, {a, direction}, 0, 1);
  ASSERT_FALSE(intervals.empty());
  for (const collision::Triangle& t : {collision::Triangle{a, b, b}, collision::Triangle{a, a, b},
                                       collision::Triangle{a, a + 0.3 * direction, b}}) {
    double first = 1, last = 0;
    for (const auto& polygon : collision::hull_on_triangle(silhouettes, t))
      for (const Eigen::Vector3d& p : polygon) {
        const double along = (p - a).dot(direction) / direction.squaredNorm();
        const auto holds = [along](const hull::Interval& i) {
          return along > i.enter - 1e-9 && along < i.leave + 1e-9;
        };
        EXPECT_TRUE(std::any_of(intervals.begin(), intervals.end(), holds));
        first = std::min(first, along);
        last = std::max(last, along);
      }
    EXPECT_NEAR(first, intervals.front().enter, 1e-9);
    EXPECT_NEAR(last, intervals.back().leave, 1e-9);
    EXPECT_LT(collision::triangle_truth(collision::HullDistance(silhouettes), t).area_in_hull_m2,
              1e-15);
  }
  EXPECT_TRUE(
      collision::triangle_truth(collision::HullDistance(silhouettes), {inside, inside, inside})
          .inside);
  EXPECT_EQ(
      collision::triangle_truth(collision::HullDistance(silhouettes), {inside, inside, inside})
          .deepest_m,
      collision::HullDistance(silhouettes).depth_m(inside));
  EXPECT_FALSE(
      collision::triangle_truth(collision::HullDistance(silhouettes), {outside, outside, outside})
          .crosses);
}

TEST(TriangleReference, AgreesWithInHullOnASliverOfOneMicrometre) {
  Random random(9);
  const auto silhouettes = hand_among();
  const collision::Triangle t{Eigen::Vector3d(-0.5, 0.0031, 0),
                              {0.5, 0.0031, 0},
                              {0, 0.003101, 0}};  // not on a pixel border of the cameras in y = 0
  EXPECT_GT(check_samples(random, silhouettes, t, 2000, 1e-8),
            100);  // 1e-8, because the rounding of 1e-15 m is a billionth of the sliver's width
  // The sliver is so thin that the hull covers the same fraction of its width as of its axis.
  const auto intervals = hull::reference_intervals(silhouettes, {t[0], t[1] - t[0]}, 0, 1);
  ASSERT_EQ(intervals.size(), 1u);
  const auto cut_off = [](double x) {
    return 2 * std::min(x, 1 - x) * std::min(x, 1 - x);
  };  // fraction of the area left of x, or right of it
  const double left = intervals[0].enter, right = intervals[0].leave;
  ASSERT_TRUE(left < 0.5 && right > 0.5);
  EXPECT_NEAR(fraction(silhouettes, t), 1 - cut_off(left) - cut_off(right), 1e-4);
}

TEST(TriangleReference, GivesTheSameFractionOneKilometreFromTheOrigin) {
  Random random(10);
  const Eigen::Vector3d far_away_m(1000, -700, 50);
  const collision::Triangle t{
      Eigen::Vector3d(-0.1, -0.1, 0.01), {0.1, -0.08, 0.02}, {0, 0.15, 0.04}};
  const collision::Triangle shifted{t[0] + far_away_m, t[1] + far_away_m, t[2] + far_away_m};
  const auto silhouettes = hand_among(4, 200, far_away_m);
  // Coordinates round to 1e-13 m: about 1e-8 of a pixel and of the triangle.
  EXPECT_GT(check_samples(random, silhouettes, shifted, 2000, 1e-8), 100);
  EXPECT_NEAR(fraction(silhouettes, shifted), fraction(hand_among(), t), 1e-8);
}

// Pixel 32 begins at x = 0 and y = 0, exactly. A polygon with a vertex or an edge there loses no
// area, and gains none.
TEST(TriangleReference, VerticesOnABorderBetweenPixelsBelongToBothSides) {
  const geometry::Camera camera{{64, 64, 64, 64, 31.5, 31.5}, Eigen::Isometry3d::Identity()};
  for (const bool columns : {true, false})
    for (const bool low : {true, false}) {
      hull::Silhouette s{camera, hull::ObjectPixels(64, 64)};
      for (int v = 0; v < 64; ++v)
        for (int u = 0; u < 64; ++u) s.pixels.set(u, v, ((columns ? u : v) < 32) == low);
      const auto at = [&](double across, double along) -> Eigen::Vector3d {
        return columns ? Eigen::Vector3d(across, along, 1) : Eigen::Vector3d(along, across, 1);
      };
      const auto part = [&](const collision::Triangle& t) {  // of the triangle's area
        double twice = 0;
        for (const auto& polygon : collision::weights_in_hull({&s, 1}, t))
          for (std::size_t i = 0; i < polygon.size(); ++i) {
            const Eigen::Vector3d &w = polygon[i], &next = polygon[(i + 1) % polygon.size()];
            twice += w.y() * next.z() - w.z() * next.y();
          }
        return twice;
      };
      EXPECT_DOUBLE_EQ(part({at(-0.25, -0.25), at(0.25, -0.25), at(0, 0.25)}), 0.5);
      EXPECT_DOUBLE_EQ(part({at(-0.25, -0.25), at(0.25, 0.25), at(0, -0.125)}), 0.5);
      EXPECT_DOUBLE_EQ(part({at(0, -0.25), at(0, 0.25), at(-0.25, 0)}), low ? 1 : 0);
      EXPECT_DOUBLE_EQ(part({at(0, -0.25), at(0, 0.25), at(0.25, 0)}), low ? 0 : 1);
      EXPECT_DOUBLE_EQ(part({at(0, -0.25), at(-0.25, 0), at(-0.25, 0.25)}), low ? 1 : 0);
    }
}

// A triangle with a vertex at the camera's center and its opposite edge at a depth of 4 nm: the
// quarter of its height nearest to the camera is a sixteenth of its area.
TEST(TriangleReference, ExcludesDepthsBelowOneNanometre) {
  const std::vector<hull::Silhouette> all{
      all_object({{64, 64, 64, 64, 31.5, 31.5}, Eigen::Isometry3d::Identity()})};
  EXPECT_NEAR(fraction(all, {Eigen::Vector3d(0, 0, 0), {-1e-9, 0, 4e-9}, {1e-9, 0, 4e-9}}),
              15.0 / 16, 1e-9);
}

// The corner beyond the image has the fraction (d / (1 + d))^2 of the area.
TEST(TriangleReference, IsInsideUpToATenBillionthOfTheArea) {
  const std::vector<hull::Silhouette> all{
      all_object({{64, 64, 32, 32, 31.5, 31.5}, Eigen::Isometry3d::Identity()})};  // |X|, |Y| < Z
  const collision::HullDistance hull(all);
  for (const auto& [outside, inside] : {std::pair{0.7e-10, true}, {1.4e-10, false}}) {
    const double d = std::sqrt(outside) / (1 - std::sqrt(outside));
    const auto truth =
        collision::triangle_truth(hull, {Eigen::Vector3d(1 + d, 0, 1), {0, -0.5, 1}, {0, 0.5, 1}});
    EXPECT_NEAR(1 - truth.fraction_in_hull, outside, 1e-13);
    EXPECT_EQ(truth.inside, inside) << outside;
    EXPECT_TRUE(truth.crosses);
  }
}

TEST(TriangleReference, RejectsVerticesThatAreNotFinite) {
  const auto silhouettes = hand_among();
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    for (int i = 0; i < 3; ++i) {
      collision::Triangle t{Eigen::Vector3d(-0.1, 0, 0), {0.1, 0, 0}, {0, 0.1, 0}};
      t[i].y() = bad;
      EXPECT_THROW(collision::hull_on_triangle(silhouettes, t), std::invalid_argument);
      EXPECT_THROW(collision::triangle_truth(collision::HullDistance(silhouettes), t),
                   std::invalid_argument);
    }
}

TEST(TriangleReference, ACameraThatIsNotFiniteGivesAnEmptyHull) {
  auto silhouettes = hand_among();
  silhouettes[1].camera.camera_from_world.translation().x() =
      std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(collision::triangle_truth(collision::HullDistance(silhouettes),
                                         {Eigen::Vector3d(-0.1, 0, 0), {0.1, 0, 0}, {0, 0.1, 0}})
                   .crosses);
}

}  // namespace
}  // namespace fivepipe::test
