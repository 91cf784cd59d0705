// The normal of a ball's contact against the analytic hull, and the tangent planes that it rests
// on.
#include "common/collision/response/ball_contact.h"

#include "common/hull/silhouette/hull_border.h"
#include "tests/support/collision/scene.h"
#include "tests/support/hull/queries.h"
#include "tests/support/hull/tangent_cones.h"
#include "tests/support/not_finite.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;
using hull::TangentPlane;

constexpr double kReal_m = 0.05;

// A real ball at the origin whose outline has this radius in each of seven cameras.
struct RealBall {
  std::vector<geometry::Camera> cameras;
  Queries hull;
  explicit RealBall(double radius_px)
      : cameras(ring(7, 1.5, 0.4, int(4 * radius_px), 4 * kReal_m)),
        hull(silhouettes_of({ball(Vector3d::Zero(), kReal_m)}, cameras, hull::PixelRule::center)) {}
};

// Each camera's cone touches the real ball in a circle.
TEST(TangentPlanes, AreThoseOfTheConesThatTouchTheBall) {
  Random random(21);
  const RealBall real(25);
  std::vector<double> angles_deg, offsets_px;
  for (int i = 0; i < 400; ++i) {
    const geometry::Camera& camera = real.cameras[std::size_t(i) % real.cameras.size()];
    const Vector3d eye_m = geometry::camera_center_world_m(camera);
    // On the circle, the normal is perpendicular to the line of sight.
    const Vector3d axis = eye_m.normalized(),
                   across = axis.cross(random_direction(random)).normalized();
    const double sine = kReal_m / eye_m.norm();
    const Vector3d normal = sine * axis + std::sqrt(1 - sine * sine) * across,
                   p_m = kReal_m * normal;
    const auto planes = hull::tangent_planes(real.hull.query, p_m, 3);
    // The camera's own plane holds its eye.
    const auto plane = std::find_if(planes.begin(), planes.end(), [&](const TangentPlane& other) {
      return std::abs(other.normal_world.dot(eye_m) - other.offset_m) < 1e-9;
    });
    ASSERT_NE(plane, planes.end());
    angles_deg.push_back(between_deg(plane->normal_world, normal));
    offsets_px.push_back(std::abs(plane->normal_world.dot(p_m) - plane->offset_m) / (kReal_m / 25));
    EXPECT_NEAR(plane->thickness_px, 50, 3);
  }
  std::sort(angles_deg.begin(), angles_deg.end());
  std::sort(offsets_px.begin(), offsets_px.end());
  std::printf("tangent planes: %.2f deg median, %.2f p95; %.2f px median, %.2f p95\n",
              angles_deg[200], angles_deg[380], offsets_px[200], offsets_px[380]);
  EXPECT_LT(angles_deg[200], 0.5);
  EXPECT_LT(angles_deg[380], 1.5);
  EXPECT_LT(offsets_px[200], 0.15);
  EXPECT_LT(offsets_px[380], 0.4);
}

TEST(TangentPlanes, AreThoseOfNearBordersOnly) {
  const RealBall real(25);
  EXPECT_TRUE(hull::tangent_planes(real.hull.query, Vector3d::Zero(), 3).empty());
  EXPECT_EQ(hull::tangent_planes(real.hull.query, Vector3d::Zero(), 30).size(), 7u);
  for (const double bad : {kNaN, kInfinity})
    EXPECT_TRUE(hull::tangent_planes(real.hull.query, {0, bad, 0}, 3).empty());
}

TEST(NearestInPlanes, IsThePointOfTheFaceEdgeOrCorner) {
  const TangentPlane x{{1, 0, 0}, 1, 0, 64}, y{{0, 1, 0}, 1, 0, 64}, z{{0, 0, 1}, 1, 0, 64};
  const std::vector<TangentPlane> cube = {x, y, z};
  EXPECT_EQ(hull::nearest_in(cube, {0, 0.5, 1}), Vector3d(0, 0.5, 1)) << "inside";
  EXPECT_LT((*hull::nearest_in(cube, {3, 0.5, 0}) - Vector3d(1, 0.5, 0)).norm(), 1e-12);
  EXPECT_LT((*hull::nearest_in(cube, {3, 2, 0}) - Vector3d(1, 1, 0)).norm(), 1e-12);
  EXPECT_LT((*hull::nearest_in(cube, {3, 2, 9}) - Vector3d(1, 1, 1)).norm(), 1e-12);
  const std::vector<TangentPlane> twice = {z, x, y, x, z};
  EXPECT_LT((*hull::nearest_in(twice, {3, 2, 9}) - Vector3d(1, 1, 1)).norm(), 1e-12)
      << "in another order, with repeated planes";
  const std::vector<TangentPlane> apart = {x, {{-1, 0, 0}, -2, 0, 64}};
  EXPECT_FALSE(hull::nearest_in(apart, {0, 0, 0})) << "no point is on the inner side of both";
  EXPECT_EQ(hull::nearest_in({}, {1, 2, 3}), Vector3d(1, 2, 3));
}

TEST(BallContact, HasTheNormalOfTheAnalyticHull) {
  Random random(22);
  const RealBall real(25);
  const TangentCones cones{real.cameras, Vector3d::Zero(), kReal_m};
  std::vector<double> off_deg;
  for (int i = 0; i < 100; ++i) {
    const double radius_m = uniform(random, 0.01, 0.05);
    const Vector3d direction = random_direction(random);
    // Moved towards the real ball until it touches the cones.
    double far_m = 0.3, near_m = 0.05;
    while (far_m - near_m > 1e-6) {
      const double d = 0.5 * (far_m + near_m);
      const double gap_m = (cones.nearest(d * direction) - d * direction).norm();
      (gap_m > radius_m ? far_m : near_m) = d;
    }
    const Vector3d center_m = far_m * direction,
                   expected = (center_m - cones.nearest(center_m)).normalized();
    const Vector3d estimate = (expected + 0.3 * random_direction(random)).normalized();
    const Vector3d normal =
        collision::ball_contact_normal(real.hull.query, center_m, radius_m, estimate);
    EXPECT_NEAR(normal.norm(), 1, 1e-12);
    off_deg.push_back(between_deg(normal, expected));
  }
  std::sort(off_deg.begin(), off_deg.end());
  std::printf("contact normal of a ball: %.2f deg median, %.2f p95\n", off_deg[50], off_deg[95]);
  EXPECT_LT(off_deg[50], 1.5);
}

TEST(BallContact, KeepsTheEstimateOnThinPartsAndFarFromTheHull) {
  const Vector3d estimate = Vector3d(0.1, 0.2, 1).normalized();
  const RealBall thin(6);
  EXPECT_EQ(collision::ball_contact_normal(thin.hull.query, 0.08 * estimate, 0.03, estimate),
            estimate);
  const RealBall real(25);
  EXPECT_NE(collision::ball_contact_normal(real.hull.query, 0.08 * estimate, 0.03, estimate),
            estimate);
  EXPECT_EQ(collision::ball_contact_normal(real.hull.query, {0.3, 0, 0}, 0.03, estimate), estimate);
  const Vector3d away = Vector3d(1, 0, -0.4).normalized();
  EXPECT_EQ(collision::ball_contact_normal(real.hull.query, 0.08 * estimate, 0.03, away), away);
}

}  // namespace
}  // namespace fivepipe::test
