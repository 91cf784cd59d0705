// Values of the response and of the contact manifold on fixed scenes, and their defaults.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/collision/response/contact_manifold.h"
#include "common/collision/response/hull_normal.h"
#include "tests/support/collision/response.h"
#include "tests/support/collision/triangles.h"
#include "tests/support/not_finite.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

constexpr double kReach_m = 0.05;  // a deeper point has no exit

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

// Farthest-point sampling (Gonzalez 1985) of points of which no two are equally far.
std::vector<std::size_t> sampled(const std::vector<Vector3d>& points_m, std::size_t first,
                                 std::size_t count, double min_m) {
  std::vector<std::size_t> chosen{first};
  while (chosen.size() < count) {
    std::size_t farthest = 0;
    double farthest_m = 0;
    for (std::size_t i = 0; i < points_m.size(); ++i) {
      double nearest_m = kInfinity;
      for (const std::size_t j : chosen)
        nearest_m = std::min(nearest_m, (points_m[i] - points_m[j]).norm());
      if (nearest_m > farthest_m) farthest = i, farthest_m = nearest_m;
    }
    if (!(farthest_m > min_m)) break;
    chosen.push_back(farthest);
  }
  return chosen;
}

// The points of a manifold: the deepest towards `center` of a sample, and of a sample of the
// points that are nearer to that one than the samples are to each other; then the farthest ones.
std::vector<Vector3d> contact_points(const PointScene& scene, std::size_t count) {
  constexpr std::size_t kSamples = 64;
  std::vector<Vector3d> points;
  for (const collision::CollisionPoint& p : scene.moved(kOrigin).points)
    points.push_back(p.p_world_m);
  const auto depth_m = [&](const Vector3d& p) {
    const auto exit =
        collision::exit_outward(scene.hull->query, p, (scene.center - p).normalized(), kReach_m);
    return exit ? exit->distance_m : kReach_m;
  };
  const auto deepest_in = [&](const std::vector<Vector3d>& all, std::size_t first, double min_m) {
    const auto sample = sampled(all, first, kSamples, min_m);
    const std::size_t deepest = *std::max_element(
        sample.begin(), sample.end(),
        [&](std::size_t a, std::size_t b) { return depth_m(all[a]) < depth_m(all[b]); });
    double spacing_m = kInfinity;
    for (const std::size_t i : sample)
      if (i != sample.back()) spacing_m = std::min(spacing_m, (all[i] - all[sample.back()]).norm());
    return std::pair(deepest, spacing_m);
  };
  const double footprint_m = collision::pixel_footprint_m(scene.hull->query, points.front());
  const auto farther = [&](const Vector3d& a, const Vector3d& b) {
    return (a - scene.center).norm() < (b - scene.center).norm();
  };
  const auto farthest = std::max_element(points.begin(), points.end(), farther);
  const auto [coarse, spacing_m] =
      deepest_in(points, std::size_t(farthest - points.begin()), footprint_m);
  std::vector<Vector3d> near{points[coarse]};
  for (const Vector3d& p : points)
    if (p != near[0] && (p - near[0]).norm() <= spacing_m) near.push_back(p);
  const Vector3d deepest = near[deepest_in(near, 0, footprint_m).first];
  const auto first = std::find(points.begin(), points.end(), deepest);
  std::vector<Vector3d> chosen;
  for (const std::size_t i :
       sampled(points, std::size_t(first - points.begin()), count, footprint_m))
    chosen.push_back(points[i]);
  return chosen;
}

// Follows the border's normals from the exit towards `center`.
struct Descent {
  Vector3d normal;
  collision::HullExit exit;
  int steps = 0;
};
std::optional<Descent> descent_from(const PointScene& scene, const Vector3d& p) {
  constexpr int kMaxSteps = 8;
  constexpr double kMinGain_m = 1e-6;
  const hull::HullQuery& query = scene.hull->query;
  const Vector3d towards = (scene.center - p).normalized();
  const auto first = collision::exit_outward(query, p, towards, kReach_m);
  if (!first) return std::nullopt;
  for (Descent descent{towards, *first};;) {
    const double outside_m = descent.exit.distance_m + descent.exit.error_m;
    const auto border = hull::limiting_cameras(
        query, {p + outside_m * descent.normal, -descent.normal}, 0, outside_m);
    if (!border || descent.steps == kMaxSteps) return descent;
    Descent next = descent;
    for (const hull::LimitingCamera& limiting : border->cameras)
      if (const double less_m = next.exit.distance_m - kMinGain_m; less_m > 0)
        if (const auto exit = collision::exit_outward(query, p, limiting.normal_world, less_m))
          next = {limiting.normal_world, *exit, descent.steps + 1};
    if (next.steps == descent.steps) return descent;
    descent = next;
  }
}

TEST(ContactManifold, ContactsAreSampledPointsAndEndsOfTheirDescents) {
  constexpr int kContacts = 6;
  constexpr double kRounding = 1e-9;  // of a unit vector, far below the error of a normal
  int long_descents = 0;
  for (int number = 0; number < 6; ++number) {
    const PointScene scene(number);
    const auto found = collision::contact_manifold(scene.hull->query, scene.moved(kOrigin),
                                                   {scene.center, kContacts, kReach_m})
                           .contacts;
    const std::vector<Vector3d> expected = contact_points(scene, kContacts);
    ASSERT_EQ(found.size(), expected.size()) << number;
    for (std::size_t i = 0; i < found.size(); ++i) {
      const collision::Contact& c = found[i];
      EXPECT_EQ(c.on_object.p_world_m, expected[i]) << number << ' ' << i;
      const auto descent = descent_from(scene, c.on_object.p_world_m);
      ASSERT_TRUE(descent) << number << ' ' << i;
      EXPECT_NEAR(c.depth_m, descent->exit.distance_m, c.depth_error_m) << number << ' ' << i;
      EXPECT_LT((c.normal_world - descent->normal).norm(), kRounding) << number << ' ' << i;
      long_descents += descent->steps > 1;
    }
  }
  EXPECT_GT(long_descents, 10);
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

// A camera of the rig that does not see the object has the largest pixels there.
TEST(PixelFootprint, IsThatOfTheCamerasThatSeeThePoint) {
  std::vector<geometry::Camera> cameras = ring(3, 1.5, 0.6, 100, 0.9);
  cameras.push_back({cameras[0].pinhole, geometry::look_at({15, 0, 0}, {0, 20, 0})});
  const std::vector<hull::Silhouette> silhouettes =
      silhouettes_of({{{0, 0, 0}, {0, 0, 0}, 0.05}}, cameras);
  const CollisionHull seen(silhouettes, 1, {hull::Limits::seen, 2});
  const Vector3d p_m(0.01, 0.02, 0.03);
  double expected_m = 0;
  for (const geometry::Camera& camera : std::span(cameras).first(3))
    expected_m = std::max(expected_m, (camera.camera_from_world * p_m).z() / camera.pinhole.fx_px);
  EXPECT_NEAR(collision::pixel_footprint_m(seen.query, p_m), expected_m, 1e-12);
  const Vector3d unseen_m(0, 0, -30);
  EXPECT_GT(collision::pixel_footprint_m(seen.query, unseen_m), 0);
}

}  // namespace
}  // namespace fivepipe::test
