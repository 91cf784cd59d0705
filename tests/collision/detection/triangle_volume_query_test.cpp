// Volume queries of triangles in viewports of their own (paper, section 4.2.4).
#include <algorithm>
#include <set>
#include <stdexcept>

#include "common/collision/detection/paper/triangle_volume_query.h"
#include "common/hull/oracle/reference.h"
#include "tests/support/collision/scene.h"
#include "tests/support/not_finite.h"

namespace fivepipe::test {
namespace {

class TriangleQuery : public GlTest {};

bool same_points(const std::vector<collision::CollisionPoint>& a,
                 const std::vector<collision::CollisionPoint>& b) {
  return a == b;
}

std::vector<hull::Silhouette> hand(int size_px = 200) {
  return silhouettes_of(
      {{{-0.1, 0, 0}, {0.02, 0.01, 0.03}, 0.03}, {{0.02, 0.01, 0.03}, {0.08, 0.05, 0.02}, 0.012}},
      ring(3, 1.2, 0.6, size_px, 0.5));
}

// Full maps: the hull is the region that all cameras see.
std::vector<hull::Silhouette> everything(const std::vector<geometry::Camera>& cameras) {
  std::vector<hull::Silhouette> all;
  for (const geometry::Camera& camera : cameras) {
    all.push_back({camera, hull::ObjectPixels(camera.pinhole.width_px, camera.pinhole.height_px)});
    for (int v = 0; v < camera.pinhole.height_px; ++v)
      for (int u = 0; u < camera.pinhole.width_px; ++u) all.back().pixels.set(u, v);
  }
  return all;
}

collision::Triangle random_triangle(Random& random, double extent_m) {
  return {random_in_ball(random, extent_m), random_in_ball(random, extent_m),
          random_in_ball(random, extent_m)};
}

TEST(TriangleView, AnyTriangleFillsTheViewport) {
  Random random(1);
  for (int i = 0; i < 1000; ++i) {
    const collision::Triangle t = random_triangle(random, 1);
    const collision::TriangleView view = collision::view_of(t);
    const double longest_m = (view.base1_world_m - view.base0_world_m).norm();
    for (int a = 0; a < 3; ++a) EXPECT_LE((t[a] - t[(a + 1) % 3]).norm(), longest_m);
    EXPECT_EQ(collision::point_at(view, 0, 0), view.base0_world_m);
    EXPECT_LT((collision::point_at(view, 1, 0) - view.base1_world_m).norm(), 1e-15);
    EXPECT_LT((collision::point_at(view, view.apex_x, 1) - view.apex_world_m).norm(), 1e-15);
    // The view is along the normal, not sheared: the foot of the height is under the apex.
    const Eigen::Vector3d foot = collision::point_at(view, view.apex_x, 0);
    EXPECT_NEAR((view.apex_world_m - foot).dot(view.base1_world_m - view.base0_world_m), 0, 1e-12);
  }
}

TEST(TriangleView, ClampsPointsOutsideTheTriangleToItsBorder) {
  Random random(2);
  for (int i = 0; i < 1000; ++i) {
    const collision::TriangleView view = collision::view_of(random_triangle(random, 1));
    const double x = uniform(random, -0.1, 1.1), y = uniform(random, -0.1, 1.1);
    const Eigen::Vector3d p = collision::point_at(view, x, y);
    Eigen::Matrix3d vertices;
    vertices << view.base0_world_m, view.base1_world_m, view.apex_world_m;
    const Eigen::Vector3d weights = vertices.fullPivLu().solve(p);
    EXPECT_GE(weights.minCoeff(), -1e-9);
    EXPECT_NEAR(weights.sum(), 1, 1e-9);
  }
}

// Membership by the independent reference, which shares no code with the query or with in_hull():
// an interval of the line through the point contains parameter 1.
bool in_reference_hull(std::span<const hull::Silhouette> silhouettes,
                       const Eigen::Vector3d& p_world_m) {
  const Eigen::Vector3d origin_world_m(0.31, -0.47, 1.9);  // no camera's centre
  constexpr double kRounding = 1e-9;
  for (const hull::Interval& interval : hull::reference_intervals(
           silhouettes, geometry::Ray{origin_world_m, p_world_m - origin_world_m}, 0.5, 1.5))
    if (interval.enter <= 1 + kRounding && interval.leave >= 1 - kRounding) return true;
  return false;
}

TEST_F(TriangleQuery, EveryPointIsInTheHullAndOnItsTriangle) {
  const auto silhouettes = hand();
  collision::TriangleVolumeQuery query(400, 10);
  query.set_silhouettes(silhouettes);
  Random random(3);
  std::vector<collision::Triangle> triangles;
  for (int i = 0; i < 3000; ++i) triangles.push_back(random_triangle(random, 0.15));
  const collision::TriangleQueryResult result = query.query(triangles);
  ASSERT_GT(result.points.size(), 1000u);
  for (const collision::CollisionPoint& point : result.points) {
    EXPECT_TRUE(in_reference_hull(silhouettes, point.p_world_m));
    const collision::Triangle& t = triangles[point.triangle];
    const Eigen::Vector3d normal = (t[1] - t[0]).cross(t[2] - t[0]).normalized();
    EXPECT_NEAR(normal.dot(point.p_world_m - t[0]), 0, 1e-9);
  }
  // Float rounding only affects samples at the borders of pixels.
  EXPECT_LT(result.points_unconfirmed, result.points.size() / 100);
}

// The query reports each sample that is clearly inside its triangle and clearly in the hull, and
// none that is clearly outside the triangle.
TEST_F(TriangleQuery, ReportsExactlyTheSamplesInTheHull) {
  const auto silhouettes = hand();
  constexpr int kViewport = 10;
  constexpr double kClear =
      // Margin in pixels of the images and of the viewport: OpenGL snaps vertices to 1/256 px and
      // rounds to float.
      0.02;
  const auto clearly = [&](const Eigen::Vector3d& p_world_m) {
    for (const hull::Silhouette& s : silhouettes) {
      const auto uv = geometry::project(s.camera, p_world_m);
      for (const double du : {-kClear, kClear})
        for (const double dv : {-kClear, kClear})
          if (!s.pixels.contains_at(uv->x() + du, uv->y() + dv)) return false;
    }
    return true;
  };
  collision::TriangleVolumeQuery query(130, kViewport);
  query.set_silhouettes(silhouettes);
  Random random(4);
  std::vector<collision::Triangle> triangles;
  for (int i = 0; i < 500; ++i) triangles.push_back(random_triangle(random, 0.15));
  const auto result = query.query(triangles);
  std::size_t next = 0, expected = 0;
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    const collision::TriangleView view = collision::view_of(triangles[i]);
    for (int row = 0; row < kViewport; ++row)
      for (int column = 0; column < kViewport; ++column) {
        const double x = column + 0.5, y = row + 0.5, left = view.apex_x * y,
                     right = kViewport - (1 - view.apex_x) * y;
        // point_at() moves a sample outside to the border, where another may be. If the query
        // reports one clearly outside, `next` stays below the number of its points.
        if (x < left - kClear || x > right + kClear) continue;
        const Eigen::Vector3d p_world_m = collision::point_at(view, x / kViewport, y / kViewport);
        // Reported in this order: by triangle, row, column.
        const bool reported = next < result.points.size() &&
                              result.points[next] == collision::CollisionPoint{p_world_m, i};
        next += reported;
        if (x > left + kClear && x < right - kClear && clearly(p_world_m)) {
          EXPECT_TRUE(reported) << "triangle " << i << " row " << row << " column " << column;
          ++expected;
        }
      }
  }
  EXPECT_EQ(next, result.points.size());
  EXPECT_GT(expected, 500u);
}

TEST_F(TriangleQuery, IsIndependentOfVertexOrder) {
  collision::TriangleVolumeQuery query(400, 10);
  query.set_silhouettes(hand());
  Random random(5);
  for (int i = 0; i < 20; ++i) {
    collision::Triangle t = random_triangle(random, 0.1);
    std::array<int, 3> order = {0, 1, 2};
    const auto expected = query.query(std::vector<collision::Triangle>{t}).points;
    while (std::next_permutation(order.begin(), order.end()))
      EXPECT_TRUE(same_points(
          expected,
          query.query(std::vector<collision::Triangle>{{t[order[0]], t[order[1]], t[order[2]]}})
              .points));
  }
}

TEST_F(TriangleQuery, IsIndependentOfAViewportsPlaceInTheWindow) {
  collision::TriangleVolumeQuery query(50, 10), wide(400, 10);
  query.set_silhouettes(hand());
  wide.set_silhouettes(hand());
  Random random(6);
  std::vector<collision::Triangle> triangles;
  for (int i = 0; i < 60; ++i) triangles.push_back(random_triangle(random, 0.1));
  const auto together = query.query(triangles), in_one_window = wide.query(triangles);
  std::size_t border = 0;  // the interpolation rounds differently at each place
  std::set<std::pair<std::uint32_t, double>> seen;
  for (const auto& p : together.points) seen.insert({p.triangle, p.p_world_m.x()});
  for (const auto& p : in_one_window.points)
    border += !seen.contains({p.triangle, p.p_world_m.x()});
  EXPECT_LE(border, in_one_window.points.size() / 100);
}

TEST_F(TriangleQuery, EverySampleOfATriangleInsideTheHullIsAPoint) {
  collision::TriangleVolumeQuery query(100, 10);
  query.set_silhouettes(silhouettes_of({ball(kOrigin, 0.1)}, ring(3, 1, 0.5, 200, 0.5)));
  const auto result = query.query(std::vector<collision::Triangle>{
      {Eigen::Vector3d(0, 0, 0.01), {0.02, 0, 0.01}, {0, 0.02, 0.01}}});
  EXPECT_GE(result.points.size(), 45u);  // half of 10 x 10, with the diagonal on either side
  EXPECT_LE(result.points.size(), 55u);
}

TEST_F(TriangleQuery, FindsATriangleThatEveryCameraSeesEdgeOn) {
  // The cameras and the triangle are in the plane z = 0.
  collision::TriangleVolumeQuery query(100, 10);
  query.set_silhouettes(silhouettes_of({ball(kOrigin, 0.05)}, ring(3, 1, 0, 200, 0.5)));
  EXPECT_GT(query
                .query(std::vector<collision::Triangle>{
                    {Eigen::Vector3d(-0.1, -0.1, 0), {0.1, -0.1, 0}, {0, 0.15, 0}}})
                .points.size(),
            5u);
}

TEST_F(TriangleQuery, SamplesDegenerateTrianglesAlongTheirLongestEdgeAndCountsThem) {
  collision::TriangleVolumeQuery query(100, 10);
  query.set_silhouettes(silhouettes_of({ball(kOrigin, 0.05)}, ring(3, 1, 0.5, 200, 0.5)));
  const Eigen::Vector3d a(-0.2, 0, 0), b(0.2, 0, 0), middle(0, 0, 0), outside(0.3, 0.3, 0.3);
  for (const collision::Triangle& t :
       {collision::Triangle{a, middle, b}, collision::Triangle{a, b, b},
        collision::Triangle{a, a, b}}) {
    const auto result = query.query(std::vector<collision::Triangle>{t});
    EXPECT_EQ(result.triangles_degenerate, 1u);
    ASSERT_FALSE(result.points.empty());
    for (const auto& p : result.points) EXPECT_EQ(p.p_world_m.tail<2>(), Eigen::Vector2d::Zero());
  }
  EXPECT_FALSE(
      query.query(std::vector<collision::Triangle>{{middle, middle, middle}}).points.empty());
  EXPECT_TRUE(
      query.query(std::vector<collision::Triangle>{{outside, outside, outside}}).points.empty());
  // A sliver of 1 m x 1 um is not degenerate.
  const auto sliver = query.query(
      std::vector<collision::Triangle>{{Eigen::Vector3d(-0.5, 0, 0), {0.5, 0, 0}, {0, 1e-6, 0}}});
  EXPECT_EQ(sliver.triangles_degenerate, 0u);
  EXPECT_FALSE(sliver.points.empty());
}

TEST_F(TriangleQuery, RejectsVerticesThatAreNotFinite) {
  collision::TriangleVolumeQuery query(100, 10);
  query.set_silhouettes(hand());
  for (const double bad : {kNaN, kInfinity})
    EXPECT_THROW(
        query.query(std::vector<collision::Triangle>{{kOrigin, {0.1, 0, bad}, {0, 0.1, 0}}}),
        std::invalid_argument);
}

TEST_F(TriangleQuery, RejectsViewportsAndMapsThatDoNotFit) {
  EXPECT_THROW(collision::TriangleVolumeQuery(10, 11), std::invalid_argument);
  EXPECT_THROW(collision::TriangleVolumeQuery(10, 0), std::invalid_argument);
  collision::TriangleVolumeQuery query(100, 10);
  auto silhouettes = hand();
  for (const auto& [width_px, height_px] : {std::pair{3, 3}, {200, 3}, {3, 200}}) {
    silhouettes[1].pixels = hull::ObjectPixels(width_px, height_px);
    EXPECT_THROW(query.set_silhouettes(silhouettes), std::invalid_argument) << width_px;
  }
}

// The stencil counts the cameras in 8 bits.
TEST_F(TriangleQuery, Counts255CamerasAndRejectsMore) {
  const std::vector<collision::Triangle> triangles{{kOrigin, {0.05, 0, 0}, {0, 0.05, 0.05}}};
  const hull::Silhouette camera = hand(50).front();
  collision::TriangleVolumeQuery query(100, 10);
  query.set_silhouettes(std::vector{camera});
  const auto points = query.query(triangles).points;
  ASSERT_FALSE(points.empty());
  query.set_silhouettes(std::vector(255, camera));
  EXPECT_TRUE(same_points(query.query(triangles).points, points));
  EXPECT_THROW(query.set_silhouettes(std::vector(256, camera)), std::invalid_argument);
}

TEST_F(TriangleQuery, TheHullIsEmptyWithoutACameraOrObjectPixels) {
  const std::vector<collision::Triangle> triangles = {
      {Eigen::Vector3d(-0.1, 0, 0), {0.1, 0, 0}, {0, 0.1, 0}}};
  collision::TriangleVolumeQuery query(100, 10);
  EXPECT_TRUE(query.query(triangles).points.empty());
  auto silhouettes = hand();
  query.set_silhouettes(silhouettes);
  EXPECT_FALSE(query.query(triangles).points.empty());
  silhouettes[2].pixels = hull::ObjectPixels(200, 200);
  query.set_silhouettes(silhouettes);
  EXPECT_TRUE(query.query(triangles).points.empty());
  query.set_silhouettes({});
  EXPECT_TRUE(query.query(triangles).points.empty());
}

TEST_F(TriangleQuery, ReportsNoPointBehindACameraOrOutsideItsImage) {
  const auto cameras = ring(2, 1, 0, 64, 0.2);
  collision::TriangleVolumeQuery query(100, 10);
  query.set_silhouettes(everything(cameras));
  // The triangle reaches from behind one camera to behind the other; the points are in the 20 cm
  // that both images show.
  const auto result = query.query(
      std::vector<collision::Triangle>{{Eigen::Vector3d(-2, 0, 0), {2, 0, 0}, {0, 0.01, 0.01}}});
  ASSERT_FALSE(result.points.empty());
  for (const auto& p : result.points) EXPECT_LT(std::abs(p.p_world_m.x()), 1.0);
  // Float rounds no sample across a border: those at x = 0.2 and 0.6 m are at least 3 cm within the
  // images, and the next ones are in a camera's plane, at 0.5 mm beside the camera or more.
  EXPECT_EQ(result.points_unconfirmed, 0u);
  EXPECT_TRUE(query
                  .query(std::vector<collision::Triangle>{
                      {Eigen::Vector3d(-0.5, 0.3, 0), {0.5, 0.3, 0}, {0, 0.4, 0}}})
                  .points.empty());
}

TEST_F(TriangleQuery, PointsOfSixteenCamerasWithOddImageSizesAreInTheHull) {
  Random random(7);
  const auto silhouettes =
      silhouettes_of({random_cameras(random, 16, 131, 77), random_object(random, 4)});
  collision::TriangleVolumeQuery query(400, 20);
  query.set_silhouettes(silhouettes);
  std::vector<collision::Triangle> triangles;
  for (int i = 0; i < 300; ++i) triangles.push_back(random_triangle(random, 0.2));
  const auto result = query.query(triangles);
  EXPECT_GT(result.points.size(), 100u);
  for (const auto& p : result.points) EXPECT_TRUE(hull::in_hull(silhouettes, p.p_world_m));
}

// The limit of the method: samples at a spacing of 10 m / 10 px miss a hull of 1 cm, and a finer
// viewport finds it.
TEST_F(TriangleQuery, MissesDetailThinnerThanTheSampleSpacing) {
  const auto silhouettes = silhouettes_of({ball({0.1, 0.2, 0}, 0.005)}, ring(3, 1, 0.5, 300, 0.6));
  const std::vector<collision::Triangle> ten_metres = {
      {Eigen::Vector3d(-5, -5, 0), {5, -5, 0}, {0, 5, 0}}};
  collision::TriangleVolumeQuery coarse(400, 10), fine(2048, 2048);
  coarse.set_silhouettes(silhouettes);
  fine.set_silhouettes(silhouettes);
  EXPECT_TRUE(coarse.query(ten_metres).points.empty());
  EXPECT_FALSE(fine.query(ten_metres).points.empty());
}

TEST_F(TriangleQuery, KeepsItsSamplesOneKilometreFromTheOrigin) {
  const Eigen::Vector3d far_away(1000, -700, 0);
  const auto silhouettes =
      silhouettes_of({ball(far_away, 0.05)}, ring(3, 1, 0.5, 200, 0.3, far_away));
  collision::TriangleVolumeQuery query(400, 40);
  query.set_silhouettes(silhouettes);
  const auto result = query.query(std::vector<collision::Triangle>{
      {far_away + Eigen::Vector3d(-0.1, -0.1, 0), far_away + Eigen::Vector3d(0.1, -0.1, 0),
       far_away + Eigen::Vector3d(0, 0.15, 0)}});
  EXPECT_GT(result.points.size(), 100u);
  EXPECT_LT(result.points_unconfirmed, result.points.size() / 50);
}

TEST_F(TriangleQuery, GivesTheSameBitsForTheSameInput) {
  Random random(8);
  std::vector<collision::Triangle> triangles;
  for (int i = 0; i < 500; ++i) triangles.push_back(random_triangle(random, 0.15));
  collision::TriangleVolumeQuery first(200, 10), second(200, 10);
  first.set_silhouettes(hand());
  second.set_silhouettes(hand(150));
  second.query(triangles);
  second.set_silhouettes(hand());
  EXPECT_TRUE(same_points(first.query(triangles).points, second.query(triangles).points));
}

}  // namespace
}  // namespace fivepipe::test
