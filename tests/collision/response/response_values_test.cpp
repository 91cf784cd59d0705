// Values of the response and of the contact manifold on fixed scenes, and their defaults.
#include <cmath>
#include <numbers>

#include "common/collision/response/contact_manifold.h"
#include "common/collision/response/hull_normal.h"
#include "tests/support/collision/response.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

// A virtual ball of points in the hull of two capsules, as seen by five cameras.
struct PointScene {
  std::vector<hull::Silhouette> silhouettes;
  std::optional<Queries> hull;
  Vector3d center;
  std::vector<Vector3d> surface;
  explicit PointScene(int number) {
    Random random(std::uint64_t(800 + number));
    std::vector<hull::Capsule> real;
    for (int i = 0; i < 2; ++i)
      real.push_back({random_in_ball(random, 0.03), random_in_ball(random, 0.03),
                      uniform(random, 0.01, 0.02)});
    silhouettes = silhouettes_of(real, ring(5, 1.0, 0.3, 320, 0.16));
    hull.emplace(silhouettes);
    // The ball reaches 6 mm into the first capsule.
    center = real[0].a_world_m + (real[0].radius_m + 0.014) * random_direction(random);
    for (int i = 0; i < 1500; ++i) surface.push_back(center + 0.02 * random_direction(random));
  }
  collision::ObjectCollision moved(const Vector3d& move_m) const {
    collision::ObjectCollision found;
    for (std::size_t i = 0; i < surface.size(); ++i)
      if (const Vector3d p = surface[i] + move_m; hull->query.contains(p))
        found.points.push_back({p, std::uint32_t(i)});
    return found;
  }
  collision::Response response(const collision::ResponseConfig& config = {}) const {
    return collision::respond(
        hull->query, moved(kOrigin), {center, std::nullopt, {true, true}},
        [this](const Vector3d& move_m) { return moved(move_m); }, config);
  }
};

// A hull of 0.5 m x 0.5 m x 0.25 m below z = 0.
std::vector<hull::Silhouette> large_plate() {
  std::vector<hull::Silhouette> silhouettes;
  for (const geometry::Camera& camera : ring(6, 1.0, 0, 320, 0.5)) {
    silhouettes.push_back({camera, hull::ObjectPixels(320, 320)});
    for (int v = 160; v < 320; ++v) silhouettes.back().pixels.set_run(0, 320, v);
  }
  return silhouettes;
}

collision::ObjectCollision one_point(const Vector3d& p) {
  collision::ObjectCollision collision;
  collision.points = {{p, 0}};
  return collision;
}

// The manifold is deterministic, so each of its samples, directions and steps changes these values.
TEST(ContactManifold, ContactsOfPointsKeepTheirValues) {
  struct Case {
    std::size_t contacts, converged;
    double first_m, depths_m;  // depth of the first contact, sum of all depths
  };
  const Case cases[] = {
      {6, 5, 0.01604490929945, 0.01721255256437},   {6, 4, 0.006377261288371, 0.01215618384707},
      {6, 6, 0.0003398939631213, 0.03006341707948}, {6, 3, 0.01333107573955, 0.0212402056178},
      {6, 5, 0.007795542887498, 0.008763652976334}, {6, 6, 0.006474700435542, 0.008154963140514},
  };
  for (int number = 0; number < 6; ++number) {
    const PointScene scene(number);
    const auto found = collision::contact_manifold(scene.hull->query, scene.moved(kOrigin),
                                                   {scene.center, 6, 0.05})
                           .contacts;
    double depths_m = 0;
    std::size_t converged = 0;
    for (const collision::Contact& c : found) depths_m += c.depth_m, converged += c.converged;
    ASSERT_FALSE(found.empty());
    EXPECT_EQ(found.size(), cases[number].contacts) << number;
    EXPECT_EQ(converged, cases[number].converged) << number;
    EXPECT_NEAR(found[0].depth_m, cases[number].first_m, 1e-10) << number;
    EXPECT_NEAR(depths_m, cases[number].depths_m, 1e-10) << number;
  }
}

// A contact converges if the border's normal is within 0.05 rad of its own.
TEST(ContactManifold, ConvergedContactsAreWithinATwentiethOfARadian) {
  int just_below = 0, just_above = 0;
  for (int number = 0; number < 12; ++number) {
    const PointScene scene(number);
    for (const collision::Contact& c :
         collision::contact_manifold(scene.hull->query, scene.moved(kOrigin), {scene.center, 40})
             .contacts) {
      if (c.status != collision::ContactStatus::defined) continue;
      const double outside_m = c.depth_m + c.depth_error_m;
      const auto border = hull::limiting_cameras(
          scene.hull->query, {c.on_object.p_world_m + outside_m * c.normal_world, -c.normal_world},
          0, outside_m);
      ASSERT_TRUE(border);
      const hull::LimitingCamera& first = border->cameras.front();
      const double off_rad = angle_rad(first.normal_world, c.normal_world);
      EXPECT_EQ(c.converged, off_rad <= 0.05) << off_rad;
      EXPECT_EQ(c.camera, first.camera);
      EXPECT_EQ(c.normal_error_rad, first.error_rad);
      just_below += off_rad > 0.025 && off_rad <= 0.05,
          just_above += off_rad > 0.05 && off_rad < 0.1;
    }
  }
  EXPECT_GT(just_below, 0);
  EXPECT_GT(just_above, 0);
}

TEST(ContactManifold, DefaultsAreFourContactsAndFiveCentimetres) {
  const PointScene scene(0);
  const auto contacts = [&](const collision::ManifoldRequest& request) {
    return collision::contact_manifold(scene.hull->query, scene.moved(kOrigin), request).contacts;
  };
  EXPECT_EQ(contacts({scene.center}).size(), 4u);
  // The only exit of a point deep in a plate is beyond the reach, or before it.
  const std::vector<hull::Silhouette> plate = large_plate();
  const Queries below(plate);
  for (const auto& [depth_m, has_exit] : {std::pair{0.049, true}, {0.051, false}}) {
    const Vector3d p(0.001, 0.002, -depth_m);
    const auto found =
        collision::contact_manifold(below.query, one_point(p), {Vector3d(0.001, 0.002, 1)})
            .contacts;
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].status != collision::ContactStatus::no_exit_within_reach, has_exit)
        << depth_m;
  }
}

// The four points of the ball's hull and their error, from the exits along the triangles' edges.
TEST(HullNormal, FourPointsAreTheExitsAlongTheEdges) {
  int defined = 0, uncertain = 0;
  for (int number = 0; number < 12; ++number) {
    const PointScene scene(number);
    for (const double apex_rad : {0.03, 0.3, 1.0}) {
      const collision::ResponseConfig config{.apex_angle_rad = apex_rad};
      const collision::Response response = scene.response(config);
      const auto status = response.four_points.status;
      if (status != collision::NormalStatus::defined &&
          status != collision::NormalStatus::too_uncertain)
        continue;
      const Vector3d &a = response.cp_object_world_m, &v = response.v_rec_world;
      const double reach_m = std::min(0.05, (scene.center - a).norm()),
                   edge_m = reach_m / std::cos(apex_rad / 2);
      // The frame of the edges follows from the first of them: the paper leaves it open.
      Eigen::Index axis = 0;
      v.cwiseAbs().minCoeff(&axis);
      const Vector3d across = v.cross(Vector3d::Unit(axis)).normalized();
      std::vector<Vector3d> points;
      double step_m = 0;
      for (const Vector3d& sideways : {across, Vector3d(v.cross(across))})
        for (const double side : {-1.0, 1.0}) {
          const Vector3d edge =
              std::cos(apex_rad / 2) * v + side * std::sin(apex_rad / 2) * sideways;
          const auto exit = collision::exit_from_base(scene.hull->query, a, edge, edge_m);
          ASSERT_TRUE(exit);
          points.push_back(a + exit->distance_m * edge);
          step_m = std::max(step_m, exit->error_m);
        }
      const Vector3d ij = points[1] - points[0], kl = points[3] - points[2];
      Vector3d normal = ij.cross(kl).normalized();
      if (normal.dot(v) < 0) normal = -normal;
      EXPECT_LT(angle_rad(response.four_points.normal_world, normal), 1e-9) << number;
      const double error_rad = std::atan(std::sqrt(2.0) * (step_m + response.pixel_footprint_m) /
                                         std::min(ij.norm(), kl.norm()));
      EXPECT_NEAR(response.four_points.error_rad, error_rad, 1e-9);
      EXPECT_EQ(status == collision::NormalStatus::defined, error_rad <= std::numbers::pi / 4);
      ++(status == collision::NormalStatus::defined ? defined : uncertain);
    }
  }
  EXPECT_GT(defined, 5);
  EXPECT_GT(uncertain, 0);
}

// All edges leave the hull at once, so the four points are one.
TEST(HullNormal, FourEqualPointsSpanNoPlane) {
  const PointScene scene(0);
  const Vector3d outside(0, 0, 0.2), up(0, 0, 1);
  EXPECT_EQ(
      collision::four_point_normal(scene.hull->query, {outside, up, 0.05, {0, 1e-14}}, {}).status,
      collision::NormalStatus::parallel);
}

TEST(Response, DefaultsAreAnExactTriangleOfFiveCentimetresAndTenDegrees) {
  const double ten_degrees_rad = std::numbers::pi / 18;
  using collision::HullSearch;
  int compared = 0;
  for (int number = 0; number < 6; ++number) {
    const PointScene scene(number);
    if (!scene.response().has_exit()) continue;
    ++compared;
    const auto normal = [&](const collision::ResponseConfig& config) {
      return scene.response(config).four_points.normal_world;
    };
    const Vector3d expected = normal({HullSearch::from_reference, 0.05, ten_degrees_rad, 400});
    EXPECT_LT((normal({}) - expected).norm(), 1e-7);
    const auto step_m = [&](const collision::ResponseConfig& config) {
      return scene.response(config).d_rec_error_m;
    };
    EXPECT_DOUBLE_EQ(step_m({.search = HullSearch::sampled}),
                     step_m({.search = HullSearch::sampled, .window_px = 400}));
    EXPECT_NE(step_m({.search = HullSearch::sampled}),
              step_m({.search = HullSearch::sampled, .window_px = 401}));
    // By default only the closed form is requested.
    const auto response =
        collision::respond(scene.hull->query, scene.moved(kOrigin), {scene.center, std::nullopt},
                           [&](const Vector3d& move_m) { return scene.moved(move_m); });
    EXPECT_EQ(response.four_points.status, collision::NormalStatus::not_requested);
    EXPECT_NE(response.closed_form.status, collision::NormalStatus::not_requested);
  }
  EXPECT_GE(compared, 3);
  // The base is 5 cm from CP_obj, in a hull that ends there or a little farther.
  const std::vector<hull::Silhouette> plate = large_plate();
  const Queries below(plate);
  for (const auto& [depth_m, has_exit] : {std::pair{0.049, true}, {0.051, false}}) {
    const auto response = collision::respond(
        below.query, one_point({0.001, 0.002, -depth_m}), {Vector3d(0.001, 0.002, 1), std::nullopt},
        [](const Vector3d&) { return collision::ObjectCollision{}; });
    EXPECT_EQ(response.has_exit(), has_exit) << depth_m;
  }
}

}  // namespace
}  // namespace fivepipe::test
