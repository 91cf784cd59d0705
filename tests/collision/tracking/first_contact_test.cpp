// First contact between two frames.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "common/collision/tracking/first_contact.h"
#include "tests/support/collision/scene.h"
#include "tests/support/not_finite.h"

namespace fivepipe::test {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kFrame_s = 1.0 / 60, kPixel_m = 0.0015;

// A frame with its hull and components.
struct Frame {
  base::WorkerPool pool{1};
  hull::CpuHull hull;
  hull::HullQuery query;
  std::vector<collision::HullComponent> components;
  Frame(const std::vector<hull::Capsule>& object, const std::vector<geometry::Camera>& cameras,
        const Eigen::AlignedBox3d& within, double cell_m = kPixel_m)
      : hull(pool, silhouettes_of(object, cameras)),
        query(hull),
        components(collision::hull_components(query, {within, cell_m, 1})) {}
};

std::vector<geometry::Camera> lab_cameras() { return ring(4, 1.2, 0.6, 320, 320 * kPixel_m); }

// A capsule that flies at 5 m/s from -x to x. It passes the plate at x = 0 after the fraction
// `before` of the frame.
struct Throw {
  double radius_m, before, offset_y_m, offset_z_m;
  Vector3d move_m;                                 // per frame
  std::vector<hull::Capsule> at(double t) const {  // t in frames
    const Vector3d p = Vector3d(0, offset_y_m, offset_z_m) + (t - before) * move_m;
    return {{p, p + Vector3d(0, 0.004, 0.002), radius_m}};
  }
};

Eigen::AlignedBox3d around(const std::vector<hull::Capsule>& object) {
  Eigen::AlignedBox3d box;
  for (const hull::Capsule& c : object)
    for (const Vector3d& p : {c.a_world_m, c.b_world_m})
      box.extend(p - Vector3d::Constant(0.03)), box.extend(p + Vector3d::Constant(0.03));
  return box;
}

std::optional<collision::FirstContact> thrown(const Throw& t, const collision::Bvh& plate,
                                              const std::vector<geometry::Camera>& cameras) {
  const Frame before(t.at(0), cameras, around(t.at(0))), after(t.at(1), cameras, around(t.at(1)));
  EXPECT_EQ(before.components.size(), 1u);
  EXPECT_EQ(after.components.size(), 1u);
  if (before.components.size() != 1 || after.components.size() != 1) return std::nullopt;
  return collision::first_contact({&before.query, 1.0, before.components[0]},
                                  {&after.query, 1.0 + kFrame_s, after.components[0]},
                                  {&plate, Isometry3d::Identity(), Isometry3d::Identity()},
                                  {.step_m = kPixel_m});
}

Throw random_throw(Random& random) {
  const Vector3d move_m =
      5 * kFrame_s * (Vector3d::UnitX() + random_in_ball(random, 0.3)).normalized();
  return {uniform(random, 1.5, 6) * kPixel_m, uniform(random, 0.35, 0.65), 0, 0,
          move_m};  // 3 to 12 px in diameter
}

int throws() { return std::getenv("FIVEPIPE_LONG") ? 1000 : 60; }

// A plate of 5 mm across the path; the capsule is outside of it in both frames.
TEST(FirstContact, ThinFastComponentDoesNotTunnelThroughAPlate) {
  const std::vector<geometry::Camera> cameras = lab_cameras();
  const collision::Bvh plate(geometry::box_mesh({0.005, 0.3, 0.3}));
  Random random(1);
  std::vector<double> errors_s;
  int missed = 0;
  for (int i = 0; i < throws(); ++i) {
    const Throw t = random_throw(random);
    const auto contact = thrown(t, plate, cameras);
    missed += !contact;
    if (!contact) continue;
    // Time at which the capsule's surface reaches the plate's face.
    const Vector3d p = t.at(0)[0].a_world_m;
    const double truth_s = 1 + kFrame_s * (-0.0025 - t.radius_m - p.x()) / t.move_m.x();
    errors_s.push_back(std::abs(contact->time_s - truth_s));
    EXPECT_LT(std::abs(contact->p_world_m.x()), 0.0026);
    EXPECT_FALSE(contact->coarse);
  }
  std::sort(errors_s.begin(), errors_s.end());
  EXPECT_EQ(missed, 0);
  std::printf("%d throws, %d missed; p95 of the time error %.2f ms (frame %.1f ms)\n", throws(),
              missed, 1e3 * errors_s[errors_s.size() * 95 / 100], 1e3 * kFrame_s);
  EXPECT_LT(errors_s[errors_s.size() * 95 / 100], 0.1 * kFrame_s);
}

// Passes the plate's edge at a distance of at least three pixels.
TEST(FirstContact, NearMissIsNotReported) {
  const std::vector<geometry::Camera> cameras = lab_cameras();
  Random random(2);
  int reported = 0;
  for (int i = 0; i < throws(); ++i) {
    Throw t = random_throw(random);
    const double beside_m = uniform(random, 3, 12) * kPixel_m;
    // The plate's edge is beside_m from the capsule's largest y while it passes the plate.
    double max_y = 0;
    for (double s = 0; s <= 1; s += 0.01)
      if (const Vector3d p = t.at(s)[0].b_world_m;
          std::abs(p.x()) < 0.0025 + t.radius_m + 0.1 * std::abs(t.move_m.x()))
        max_y = std::max({max_y, p.y(), t.at(s)[0].a_world_m.y()});
    geometry::Mesh plate = geometry::box_mesh({0.005, 0.2, 0.3});
    for (Vector3d& v : plate.vertices_m) v.y() += 0.1 + max_y + t.radius_m + beside_m;
    reported += thrown(t, collision::Bvh(plate), cameras).has_value();
  }
  std::printf("%d near misses, %d reported\n", throws(), reported);
  EXPECT_LE(reported, throws() / 100);
}

TEST(FirstContact, ComponentInFrontOfThePlateHasNoContact) {
  const std::vector<geometry::Camera> cameras = lab_cameras();
  const collision::Bvh plate(geometry::box_mesh({0.005, 0.3, 0.3}));
  Throw t{0.01, 1.3, 0, 0, Vector3d(0.08, 0, 0)};
  EXPECT_FALSE(thrown(t, plate, cameras));
  t.before = 0.9;  // reaches the plate just before the later frame
  EXPECT_TRUE(thrown(t, plate, cameras));
}

TEST(FirstContact, MovingPlateMeetsAStaticComponent) {
  const std::vector<geometry::Camera> cameras = lab_cameras();
  const std::vector<hull::Capsule> object = {ball(kOrigin, 0.01)};
  const Frame frame(object, cameras, around(object));
  const collision::Bvh plate(geometry::box_mesh({0.005, 0.3, 0.3}));
  const auto contact = collision::first_contact({&frame.query, 0, frame.components[0]},
                                                {&frame.query, 1, frame.components[0]},
                                                {&plate, at({-0.1, 0, 0}), at({0.1, 0, 0})});
  ASSERT_TRUE(contact);
  EXPECT_NEAR(contact->time_s, (0.1 - 0.0125) / 0.2, 0.02);
  EXPECT_LT(contact->time_error_s, 1e-3);
}

// A ball and a plate both rotate by a quarter turn about the world's origin. Their distance is the
// same in both frames, but in between the ball, which moves on the chord, crosses the plate.
TEST(FirstContact, RotatingComponentUsesItsArcLength) {
  const std::vector<geometry::Camera> cameras = ring(4, 1.5, 0.6, 400, 1.2);
  const std::vector<hull::Capsule> before = {ball({0.3, 0, 0}, 0.02)},
                                   after = {ball({0, 0.3, 0}, 0.02)};
  const Frame first(before, cameras, around(before), 0.004),
      second(after, cameras, around(after), 0.004);
  geometry::Mesh plate = geometry::box_mesh({0.005, 0.4, 0.4});
  for (Vector3d& v : plate.vertices_m) v.x() += 0.25;
  const collision::Bvh tree(plate);
  Isometry3d turned = Isometry3d::Identity();
  turned.linear() = Eigen::AngleAxisd(std::numbers::pi / 2, Vector3d::UnitZ()).toRotationMatrix();
  const auto contact = collision::first_contact(
      {&first.query, 0, first.components[0]}, {&second.query, 1, second.components[0]},
      {&tree, Isometry3d::Identity(), turned},
      {.rotation_world_rad = Vector3d(0, 0, std::numbers::pi / 2)});
  ASSERT_TRUE(contact);
  EXPECT_GT(contact->time_s, 0);
  EXPECT_LT(contact->time_s, 0.5);
}

TEST(FirstContact, ReportsInitialContactAndCoarseSteps) {
  const std::vector<geometry::Camera> cameras = lab_cameras();
  const std::vector<hull::Capsule> object = {ball(kOrigin, 0.01)};
  const Frame frame(object, cameras, around(object));
  const collision::Bvh plate(geometry::box_mesh({0.005, 0.3, 0.3}));
  const auto initial = collision::first_contact({&frame.query, 3, frame.components[0]},
                                                {&frame.query, 4, frame.components[0]},
                                                {&plate, at({0.005, 0, 0}), at({0.1, 0, 0})});
  ASSERT_TRUE(initial);
  EXPECT_EQ(initial->time_s, 3);
  EXPECT_EQ(initial->time_error_s, 0);
  const auto coarse = collision::first_contact(
      {&frame.query, 0, frame.components[0]}, {&frame.query, 1, frame.components[0]},
      {&plate, at({-0.1, 0, 0}), at({0, 0, 0})}, {.max_steps = 4});
  ASSERT_TRUE(coarse);
  EXPECT_TRUE(coarse->coarse);
}

TEST(FirstContact, IgnoresOtherComponents) {
  const std::vector<geometry::Camera> cameras = lab_cameras();
  const Vector3d other(0, 0.1, 0);
  const std::vector<hull::Capsule> before = {ball({-0.06, 0, 0}, 0.008), ball(other, 0.02)},
                                   after = {ball({0.02, 0, 0}, 0.008), ball(other, 0.02)};
  const Eigen::AlignedBox3d space(Vector3d(-0.2, -0.2, -0.2), Vector3d(0.2, 0.2, 0.2));
  const Frame first(before, cameras, space, 0.003), second(after, cameras, space, 0.003);
  geometry::Mesh small = geometry::box_mesh({0.005, 0.03, 0.03});
  for (Vector3d& v : small.vertices_m)
    v += other + Vector3d(-0.05, 0, 0);  // where the other ball would be if it had moved
  const auto component_near = [](const Frame& f, double y) {
    return *std::find_if(f.components.begin(), f.components.end(),
                         [&](const collision::HullComponent& p) {
                           return std::abs(p.centroid_world_m.y() - y) < 0.02;
                         });
  };
  const collision::Bvh tree(small);
  EXPECT_FALSE(collision::first_contact({&first.query, 0, component_near(first, 0)},
                                        {&second.query, 1, component_near(second, 0)},
                                        {&tree, Isometry3d::Identity(), Isometry3d::Identity()}));
}

// A component with the box [-0.02, 0.02]^3 in a hull that is the ball around it. The path length is
// that of its farthest corner and decides the number of steps; six bisections follow.
TEST(FirstContact, TimeErrorIsTheStepOfTheWholePathHalvedSixTimes) {
  const std::vector<geometry::Camera> cameras = lab_cameras();
  const std::vector<hull::Capsule> object = {ball(kOrigin, 0.01)};
  const Frame frame(object, cameras, around(object));
  const collision::Bvh plate(geometry::box_mesh({0.005, 0.3, 0.3}));
  const Eigen::AlignedBox3d box(Vector3d::Constant(-0.02), Vector3d::Constant(0.02));
  const auto snapshot = [&](double time_s, const Vector3d& center) {
    collision::HullComponent component;
    component.centroid_world_m = center;
    component.box_world_m = box;
    return collision::HullSnapshot{&frame.query, time_s, component};
  };
  const double radius_m = 0.02 * std::sqrt(3.0);
  const auto steps_of = [&](const collision::FirstContact& contact) {
    return std::lround(2 / (64 * contact.time_error_s));  // between the times 5 s and 7 s
  };
  Isometry3d turned = at({0.1, 0, 0});
  turned.linear() = Eigen::AngleAxisd(0.5, Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  const Vector3d turn(0.2, -0.3, 0.1);
  struct Case {
    Isometry3d from, to;
    Vector3d turn_rad;
    double step_m, path_m;
  };
  for (const Case& c :
       {Case{at({-0.1, 0, 0}), at({0.1, 0, 0}), kOrigin, 0.0015, 0.2},
        Case{at({-0.1, 0, 0}), at({0.1, 0, 0}), kOrigin, 0.003, 0.2},
        Case{at({-0.1, 0, 0}), at({0.1, 0, 0}), turn, 0.0015, 0.2 + turn.norm() * radius_m},
        Case{at({-0.1, 0, 0}), turned, kOrigin, 0.0015, 0.2 + 0.5 * (0.1 + radius_m)},
        Case{at({-0.15, 0, 0}), turned, turn, 0.0015,
             0.25 + 0.5 * (0.15 + radius_m) + turn.norm() * radius_m}}) {
    const auto contact =
        collision::first_contact(snapshot(5, kOrigin), snapshot(7, kOrigin), {&plate, c.from, c.to},
                                 {.step_m = c.step_m, .rotation_world_rad = c.turn_rad});
    ASSERT_TRUE(contact);
    EXPECT_EQ(steps_of(*contact), std::ceil(c.path_m / c.step_m)) << c.path_m;
    EXPECT_FALSE(contact->coarse);
    EXPECT_GT(contact->time_s, 5);
    EXPECT_LT(contact->time_s, 7);
    EXPECT_LE(contact->p_world_m.norm(), 0.02);  // of the resting ball
    EXPECT_LT(contact->triangle, 12u);
  }
  // By default steps of 1.5 mm, and at most 512.
  for (const auto& [path_m, steps] : {std::pair{0.2, 134}, {0.767, 512}, {0.769, 512}}) {
    const auto contact =
        collision::first_contact(snapshot(5, kOrigin), snapshot(7, kOrigin),
                                 {&plate, at({-0.1, 0, 0}), at({path_m - 0.1, 0, 0})});
    ASSERT_TRUE(contact);
    EXPECT_EQ(steps_of(*contact), steps);
    EXPECT_EQ(contact->coarse, path_m > 0.768) << path_m;
  }
  // As many steps as allowed, and one fewer.
  for (const auto& [max_steps, coarse] : {std::pair{134, false}, {133, true}, {4, true}}) {
    const auto contact = collision::first_contact(snapshot(5, kOrigin), snapshot(7, kOrigin),
                                                  {&plate, at({-0.1, 0, 0}), at({0.1, 0, 0})},
                                                  {.step_m = 0.0015, .max_steps = max_steps});
    ASSERT_TRUE(contact);
    EXPECT_EQ(contact->coarse, coarse) << max_steps;
    EXPECT_EQ(steps_of(*contact), max_steps);
  }
}

// The ball turns about its component's centroid, 0.1 m beside it, by a quarter turn, and the
// centroid moves by 0.04 m. A small box waits where the ball is at a fraction of the interval.
TEST(FirstContact, FollowsTheComponentsRotationAndTranslation) {
  const std::vector<geometry::Camera> cameras = ring(6, 1.2, 0.7, 400, 0.6);
  const Vector3d turn(0, 0, std::numbers::pi / 2), move(0, 0, 0.04);
  const auto place = [&](double t) -> Vector3d {
    return t * move + 0.1 * Vector3d(std::cos(t * turn.z()), std::sin(t * turn.z()), 0);
  };
  const std::vector<hull::Capsule> first = {ball(place(0), 0.01)}, second = {ball(place(1), 0.01)};
  const Frame before(first, cameras, around(first)), after(second, cameras, around(second));
  const auto component = [&](const Frame& frame, double t) {
    collision::HullComponent c = frame.components[0];
    c.centroid_world_m = t * move;
    return c;
  };
  for (const double t : {0.3, 0.45, 0.55, 0.8}) {
    geometry::Mesh box = geometry::box_mesh({0.004, 0.004, 0.004});
    for (Vector3d& v : box.vertices_m) v += place(t);
    const collision::Bvh tree(box);
    const auto contact = collision::first_contact(
        {&before.query, 0, component(before, 0)}, {&after.query, 1, component(after, 1)},
        {&tree, Isometry3d::Identity(), Isometry3d::Identity()}, {.rotation_world_rad = turn});
    ASSERT_TRUE(contact) << t;
    // The ball's surface is there earlier, by its radius over the path of 0.16 m; the hull is up to
    // two pixels larger.
    EXPECT_NEAR(contact->time_s, t - 0.012 / 0.162, 0.025) << t;
    EXPECT_LT((contact->p_world_m - place(t)).norm(), 0.0045) << t;
  }
}

TEST(FirstContact, RejectsEachInvalidNumber) {
  const std::vector<geometry::Camera> cameras = lab_cameras();
  const std::vector<hull::Capsule> object = {ball(kOrigin, 0.01)};
  const Frame frame(object, cameras, around(object));
  const collision::Bvh plate(geometry::box_mesh({0.005, 0.3, 0.3}));
  const collision::HullSnapshot now{&frame.query, 1, frame.components[0]},
      later{&frame.query, 2, frame.components[0]};
  const collision::MovingObject resting{&plate, at({0.5, 0, 0}), at({0.5, 0, 0})};
  EXPECT_NO_THROW(collision::first_contact(now, later, resting));
  EXPECT_NO_THROW(collision::first_contact(now, later, resting, {.max_steps = 1}));
  EXPECT_THROW(collision::first_contact(now, now, resting), std::invalid_argument);
  EXPECT_THROW(collision::first_contact(now, later, resting, {.max_steps = 0}),
               std::invalid_argument);
  EXPECT_THROW(collision::first_contact(now, later, resting, {.step_m = kInfinity}),
               std::invalid_argument);
  EXPECT_THROW(collision::first_contact(now, later, resting, {.step_m = 0.9e-6}),
               std::invalid_argument);
  EXPECT_THROW(
      collision::first_contact(now, later, {&plate, at({0.5, 0, 0}), at({0, kInfinity, 0})}),
      std::invalid_argument);
  for (const bool is_later : {false, true}) {
    const auto with = [&](const auto& change) {
      collision::HullSnapshot snapshots[] = {now, later};
      change(snapshots[is_later]);
      EXPECT_THROW(collision::first_contact(snapshots[0], snapshots[1], resting),
                   std::invalid_argument);
    };
    with([&](collision::HullSnapshot& s) { s.time_s = is_later ? kInfinity : -kInfinity; });
    with([](collision::HullSnapshot& s) { s.component.centroid_world_m.y() = kInfinity; });
    with([](collision::HullSnapshot& s) { s.component.box_world_m.setEmpty(); });
  }
}

TEST(FirstContact, RejectsInvalidArguments) {
  const std::vector<geometry::Camera> cameras = lab_cameras();
  const std::vector<hull::Capsule> object = {ball(kOrigin, 0.01)};
  const Frame frame(object, cameras, around(object));
  const collision::Bvh plate(geometry::box_mesh({0.005, 0.3, 0.3}));
  const collision::HullSnapshot now{&frame.query, 1, frame.components[0]},
      later{&frame.query, 2, frame.components[0]};
  const collision::MovingObject resting{&plate, Isometry3d::Identity(), Isometry3d::Identity()};
  EXPECT_THROW(collision::first_contact(later, now, resting), std::invalid_argument);
  EXPECT_THROW(collision::first_contact(now, later, resting, {.step_m = 0}), std::invalid_argument);
  EXPECT_THROW(
      collision::first_contact(
          now, later, resting,
          {.rotation_world_rad = Vector3d::Constant(std::numeric_limits<double>::quiet_NaN())}),
      std::invalid_argument);
  EXPECT_THROW(
      collision::first_contact(
          now, later,
          {&plate, at({0, 0, std::numeric_limits<double>::infinity()}), Isometry3d::Identity()}),
      std::invalid_argument);
}

}  // namespace
}  // namespace fivepipe::test
