// The scene's objects without a hull: sizes and roles, and their rigid-body dynamics.
#include "sim_node/objects/object_models.h"
#include "sim_node/objects/rigid_bodies.h"
#include "tests/support/sim_scene.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

constexpr double kFriction = 0.25;  // 0.5 of each body; Bullet multiplies them

// A box-shaped mesh whose origin is far from its centre.
config::MeshShape mesh_beside_origin(const Vector3d& size_m, const Vector3d& center_m) {
  config::MeshShape shape{.file = "", .unit_m = 1, .mesh = geometry::box_mesh(size_m)};
  for (Vector3d& v : shape.mesh.vertices_m) v += center_m;
  return shape;
}

config::SceneObject dynamic(config::SceneObject object) {
  object.motion = config::Motion::dynamic;
  return object;
}

// A fixed floor with its top at z = 0, far larger than what moves on it.
config::SceneObject floor_below() { return virtual_box("floor", {0, 0, -0.5}, {20, 20, 1}); }

Eigen::Isometry3d random_pose(Random& random) {
  Eigen::Isometry3d pose = at(random_in_ball(random, 2));
  pose.linear() = random_rotation(random, 0.5, 2.5).matrix();
  return pose;
}

void run(sim::RigidBodies& bodies, double time_s) {
  for (int step = 0; step < std::lround(time_s / kStep_s); ++step) bodies.step(kStep_s);
}

TEST(ObjectModels, HaveTheSizesOfTheirMeshes) {
  const sim::ObjectModels models = sim::object_models(
      scene_of({virtual_ball({1, 2, 3}),
                virtual_box("box", kOrigin, {0.2, 0.3, 0.6}),
                {.name = "mesh", .shape = mesh_beside_origin({0.2, 0.3, 0.6}, {5, -6, 7})}}));
  ASSERT_EQ(models.objects.size(), 3u);
  EXPECT_NEAR(models.objects[0].radius_m, kBallRadius_m, 1e-12);
  for (const std::size_t box : {1u, 2u}) {
    EXPECT_NEAR(models.objects[box].radius_m, 0.35, 1e-12) << box;  // half of the diagonal
    EXPECT_EQ(models.objects[box].flatness_m, 0) << box;
  }
  double nearest_m = kBallRadius_m;
  const geometry::Mesh& ball = models.objects[0].bvh.mesh();
  for (const auto& triangle : ball.triangles) {
    Vector3d center_m = kOrigin;
    for (const std::uint32_t corner : triangle) center_m += ball.vertices_m[corner] / 3;
    nearest_m = std::min(nearest_m, center_m.norm());
  }
  EXPECT_NEAR(models.objects[0].flatness_m, kBallRadius_m - nearest_m, 1e-12);
  EXPECT_GT(models.objects[0].flatness_m, 1e-5);
}

TEST(ObjectModels, HaveTheRolesOfTheScene) {
  config::SceneObject fixed_ball = virtual_ball({0, 4, 0});
  fixed_ball.motion = config::Motion::fixed;
  const sim::ObjectModels models = sim::object_models(scene_of(
      {virtual_box("scenery", {-1, 0, 0}, {0.2, 0.2, 0.2}), virtual_ball({0, 0, 2}),
       dynamic(virtual_box("none", kOrigin, {0.2, 0.2, 0.2})), fixed_ball,
       dynamic(virtual_box("highlight", {1, 0, 0}, {0.2, 0.2, 0.2}, config::Reaction::highlight)),
       virtual_ball({0, -3, 0})}));
  EXPECT_EQ(models.reacting, (std::vector<std::size_t>{1, 3, 4, 5}));
  EXPECT_EQ(models.bouncing, (std::vector<std::size_t>{1, 5}));
  EXPECT_NEAR((models.start_bounds_m.min() - Vector3d(-1.1, -3.06, -0.1)).norm(), 0, 1e-3);
  EXPECT_NEAR((models.start_bounds_m.max() - Vector3d(1.1, 4.06, 2.06)).norm(), 0, 1e-3);
}

TEST(RigidBodies, StartAtThePosesOfTheScene) {
  Random random(5);
  const Vector3d beside_m(0.3, -0.7, 1.1);
  std::vector<config::SceneObject> objects = {
      virtual_box("box", kOrigin, {0.1, 0.2, 0.3}),
      virtual_ball(kOrigin),
      {.name = "mesh", .shape = mesh_beside_origin({0.2, 0.3, 0.6}, beside_m)},
      dynamic({.name = "mesh", .shape = mesh_beside_origin({0.2, 0.3, 0.6}, beside_m)})};
  for (config::SceneObject& object : objects) object.world_from_object = random_pose(random);
  sim::RigidBodies bodies(scene_of(objects));
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const Eigen::Isometry3d& pose = objects[i].world_from_object;
    EXPECT_LT((bodies.world_from_object(i).matrix() - pose.matrix()).norm(), 1e-12) << i;
    EXPECT_LT((bodies.center_world_m(i) - pose * (i < 2 ? kOrigin : beside_m)).norm(), 1e-12) << i;
    EXPECT_EQ(bodies.velocity_m_s(i), kOrigin) << i;
  }
}

TEST(RigidBodies, FallStraightDownAndFixedOnesStay) {
  sim::RigidBodies bodies(scene_of({virtual_ball({0.1, 0.2, 5}), floor_below()}));
  bodies.set_velocity_m_s(0, {0.5, -0.25, 0});
  run(bodies, 0.5);
  // Semi-implicit Euler, see SimulationTime.FreeFallMatchesTheClosedForm.
  const double fall_m = 0.5 * kGravity_m_s2 * 0.5 * (0.5 + kStep_s);
  EXPECT_LT((bodies.center_world_m(0) - Vector3d(0.35, 0.075, 5 - fall_m)).norm(), 1e-9);
  EXPECT_LT((bodies.velocity_m_s(0) - Vector3d(0.5, -0.25, -0.5 * kGravity_m_s2)).norm(), 1e-9);
  EXPECT_EQ(bodies.center_world_m(1), Vector3d(0, 0, -0.5));
}

TEST(RigidBodies, FrictionSlowsASlidingBox) {
  sim::RigidBodies bodies(
      scene_of({dynamic(virtual_box("box", {2, 2, 0.05}, {0.4, 0.4, 0.1})), floor_below()}));
  run(bodies, 0.1);
  bodies.set_velocity_m_s(0, {2, 0, 0});
  run(bodies, 0.5);
  EXPECT_NEAR(bodies.velocity_m_s(0).x(), 2 - kFriction * kGravity_m_s2 * 0.5, 0.05);
}

// A solid ball that slides without rotation ends up rolling at 5/7 of its speed.
TEST(RigidBodies, ASlidingBallBeginsToRoll) {
  sim::RigidBodies bodies(scene_of({virtual_ball({0, 0, kBallRadius_m}), floor_below()}));
  bodies.set_velocity_m_s(0, {1, 0, 0});
  run(bodies, 1);
  // Then the rolling resistance slows it: 1 % of the normal force, times the floor's friction of
  // 0.5.
  const double slowed_m_s = 5.0 / 7 * 0.01 * 0.5 * kGravity_m_s2;
  EXPECT_NEAR(bodies.velocity_m_s(0).x(), 5.0 / 7 - slowed_m_s, 0.01);
}

TEST(RigidBodies, ReboundHasTheRestitutionOfBothBodies) {
  // Dropped from 5 cm onto the fixed floor.
  sim::RigidBodies bodies(
      scene_of({virtual_ball({0, 0, kBallRadius_m + 0.05}, 0.8), floor_below()}));
  double down_m_s = 0, up_m_s = 0;
  for (int step = 0; step < 60; ++step) {
    bodies.step(kStep_s);
    down_m_s = std::max(down_m_s, -bodies.velocity_m_s(0).z());
    up_m_s = std::max(up_m_s, bodies.velocity_m_s(0).z());
  }
  // Bullet stops a body before it touches by up to one step, and adds that distance per step.
  EXPECT_NEAR(up_m_s / down_m_s, 0.8, 0.06);
  // Head-on, with equal masses and no gravity.
  config::Scene scene = scene_of({virtual_ball({-0.1, 0, 0}, 0.8), virtual_ball({0.1, 0, 0}, 0.5)});
  scene.gravity_m_s2 = 0;
  sim::RigidBodies balls(scene);
  balls.set_velocity_m_s(0, {1, 0, 0});
  balls.set_velocity_m_s(1, {-1, 0, 0});
  run(balls, 0.1);
  EXPECT_NEAR(balls.velocity_m_s(1).x(), 0.8 * 0.5, 0.09);
  EXPECT_NEAR(balls.velocity_m_s(0).x(), -balls.velocity_m_s(1).x(), 1e-9);
}

TEST(RigidBodies, ImpactKeepsTheMomentum) {
  config::Scene scene =
      scene_of({virtual_ball({-0.1, 0, 0}, 0, 3), virtual_ball({0.1, 0, 0}, 0, 1)});
  scene.gravity_m_s2 = 0;
  sim::RigidBodies balls(scene);
  balls.set_velocity_m_s(0, {1, 0, 0});
  run(balls, 0.2);
  EXPECT_NEAR(3 * balls.velocity_m_s(0).x() + balls.velocity_m_s(1).x(), 3, 1e-9);
  EXPECT_NEAR(balls.velocity_m_s(0).x(), 0.75, 0.06);
}

// A body is swept, as a ball of half its half extent, from the first step that exceeds it: 2 cm.
// Bullet adds the margin of a mesh, 1 mm, to its extent twice.
TEST(RigidBodies, AreSweptIfTheyMoveMoreThanTheirHalfExtentPerStep) {
  constexpr double kTop_m = 0.0025, kHalf_m = 0.02, kStart_m = kTop_m + 0.0225;
  for (const bool is_mesh : {false, true}) {
    const double swept_m = 0.5 * (kHalf_m + (is_mesh ? 0.002 : 0));
    const auto z_after_step_m = [&](double step_m) {
      config::SceneObject body = virtual_ball({0, 0, kStart_m}, 0);
      if (is_mesh)
        body.shape = mesh_beside_origin(Vector3d::Constant(2 * kHalf_m), kOrigin);
      else
        body.shape = config::SphereShape{kHalf_m};
      config::Scene scene = scene_of({body, virtual_box("plate", kOrigin, {2, 2, 2 * kTop_m})});
      scene.gravity_m_s2 = 0;
      sim::RigidBodies bodies(scene);
      bodies.set_velocity_m_s(0, {0, 0, -step_m / kStep_s});
      bodies.step(kStep_s);
      return bodies.center_world_m(0).z();
    };
    for (const double step_m : {0.0225, 0.025, 0.039, 0.041, 0.08})
      EXPECT_NEAR(z_after_step_m(step_m), kTop_m + swept_m, 1e-4) << step_m;
    for (const double step_m : {0.011, 0.015, 0.019})
      EXPECT_NEAR(z_after_step_m(step_m), kStart_m - step_m, 1e-9) << step_m;
  }
}

TEST(RigidBodies, MeshesAreOneMillimetreThicker) {
  const config::MeshShape block = mesh_beside_origin({0.2, 0.2, 0.2}, {1, 0, 0});
  const config::MeshShape ground = mesh_beside_origin({4, 4, 1}, {0, 0, 5});
  sim::RigidBodies bodies(scene_of(
      {dynamic({.name = "mesh on box", .shape = block, .world_from_object = at({-1, 0, 0.11})}),
       floor_below()}));
  run(bodies, 2);
  EXPECT_NEAR(bodies.center_world_m(0).z(), 0.101, 2e-4);
  sim::RigidBodies on_mesh(
      scene_of({dynamic(virtual_box("box", {0.3, 0.4, 0.11}, {0.2, 0.2, 0.2})),
                {.name = "ground", .shape = ground, .world_from_object = at({0, 0, -5.5})}}));
  run(on_mesh, 2);
  EXPECT_NEAR(on_mesh.center_world_m(0).z(), 0.101, 2e-4);
}

TEST(RigidBodies, FixedMeshIsHollow) {
  sim::RigidBodies bodies(scene_of({virtual_ball({5.01, 0.02, 0}, 0),
                                    {.name = "room",
                                     .shape = mesh_beside_origin({0.4, 0.4, 0.4}, {1, 0, 0}),
                                     .world_from_object = at({4, 0, 0})}}));
  run(bodies, 1);
  EXPECT_NEAR(bodies.center_world_m(0).z(), -0.2 + kBallRadius_m + 0.001, 2e-3);
  EXPECT_LT((bodies.center_world_m(0) - Vector3d(5.01, 0.02, 0)).head<2>().norm(), 0.01);
}

TEST(RigidBodies, ABodyAtRestStillReactsToAVelocity) {
  sim::RigidBodies bodies(scene_of({virtual_ball({0, 0, kBallRadius_m}), floor_below()}));
  run(bodies, 5);
  bodies.set_velocity_m_s(0, {0, 0, 2});
  run(bodies, 0.1);
  EXPECT_GT(bodies.center_world_m(0).z(), kBallRadius_m + 0.1);
}

TEST(RigidBodies, TranslationKeepsRotationAndVelocity) {
  config::SceneObject box = dynamic(virtual_box("box", kOrigin, {0.1, 0.2, 0.3}));
  Random random(6);
  box.world_from_object = random_pose(random);
  sim::RigidBodies bodies(scene_of({box}));
  bodies.set_velocity_m_s(0, {1, 2, 3});
  bodies.translate(0, {0.1, -0.2, 0.3});
  const Eigen::Isometry3d expected =
      Eigen::Translation3d(Vector3d(0.1, -0.2, 0.3)) * box.world_from_object;
  EXPECT_LT((bodies.world_from_object(0).matrix() - expected.matrix()).norm(), 1e-12);
  EXPECT_EQ(bodies.velocity_m_s(0), Vector3d(1, 2, 3));
}

TEST(RigidBodies, RespawnedBodyMovesAsAtItsStart) {
  Random random(7);
  config::SceneObject tumbling =
      dynamic({.name = "mesh", .shape = mesh_beside_origin({0.2, 0.1, 0.1}, {0.3, -0.7, 1.1})});
  tumbling.world_from_object = random_pose(random);
  tumbling.world_from_object.translation().z() += 2;
  tumbling.velocity_world_m_s = {0.1, -0.2, 0.3};
  const config::Scene scene = scene_of({tumbling, floor_below()});
  sim::RigidBodies bodies(scene), fresh(scene);
  bodies.set_velocity_m_s(0, {0.5, 0.5, 0});
  run(bodies, 2);  // it has hit the floor and rotates
  ASSERT_GT((bodies.world_from_object(0).linear() - tumbling.world_from_object.linear()).norm(),
            0.1);
  bodies.set_velocity_m_s(0, {1, 2, 3});
  bodies.respawn(0);
  EXPECT_EQ(bodies.velocity_m_s(0), tumbling.velocity_world_m_s);
  run(bodies, 0.1);
  run(fresh, 0.1);
  EXPECT_EQ(bodies.world_from_object(0).matrix(), fresh.world_from_object(0).matrix());
  EXPECT_EQ(bodies.velocity_m_s(0), fresh.velocity_m_s(0));
}

// A ball without gravity that touches the hull at its side, x = -kBallRadius_m.
struct TouchedBall {
  explicit TouchedBall(const Vector3d& ball_m_s, double friction = 0) {
    config::Scene scene = scene_of({virtual_ball(kOrigin)});
    scene.gravity_m_s2 = 0;
    scene.objects[0].velocity_world_m_s = ball_m_s;
    scene.objects[0].friction = friction;
    bodies.emplace(scene);
    manifold.points.push_back({.on_object_world_m = {-kBallRadius_m, 0, 0},
                               .normal_world = Vector3d::UnitX(),
                               .distance_m = 0,
                               .restitution = 0});
  }
  void step() { bodies->step(kStep_s, {&manifold, 1}); }
  Vector3d velocity_m_s() const { return bodies->velocity_m_s(0); }

  std::optional<sim::RigidBodies> bodies;
  sim::HullManifold manifold{0, {kOrigin, kOrigin, kOrigin}};
};

TEST(RigidBodiesInHullContact, AMovingSurfacePushes) {
  TouchedBall ball(kOrigin);
  ball.manifold.velocity.velocity_world_m_s = {0.8, 0, 0};
  ball.step();
  EXPECT_LT((ball.velocity_m_s() - Vector3d(0.8, 0, 0)).norm(), 1e-9);
  EXPECT_NEAR(ball.manifold.points[0].impulse_n_s, 0.2 * 0.8, 1e-9) << "mass times velocity";
  // A surface that withdraws does not pull.
  ball.manifold.velocity.velocity_world_m_s = {-1, 0, 0};
  ball.step();
  EXPECT_LT((ball.velocity_m_s() - Vector3d(0.8, 0, 0)).norm(), 1e-9);
  EXPECT_EQ(ball.manifold.points[0].impulse_n_s, 0);
}

TEST(RigidBodiesInHullContact, ATurningSurfacePushesWithItsVelocityThere) {
  TouchedBall ball(kOrigin);
  ball.manifold.velocity = {{-kBallRadius_m, -0.5, 0}, kOrigin, {0, 0, -1}};
  ball.step();
  EXPECT_NEAR(ball.velocity_m_s().x(), 0.5, 1e-9);
}

TEST(RigidBodiesInHullContact, FrictionCarriesAlongTheSurface) {
  for (const double friction : {0.0, 0.5}) {
    TouchedBall ball({-1, 0, 0}, friction);
    ball.manifold.velocity.velocity_world_m_s = {0, 10, 0};
    ball.step();
    // Coulomb: the impulse along the surface is the coefficient times the normal one.
    EXPECT_NEAR(ball.velocity_m_s().y(), friction * 1, 1e-6) << friction;
  }
}

TEST(RigidBodiesInHullContact, ReboundHasTheGivenRestitution) {
  TouchedBall ball({-1, 0.3, 0});
  ball.manifold.points[0].restitution = 0.6;
  ball.step();
  EXPECT_LT((ball.velocity_m_s() - Vector3d(0.6, 0.3, 0)).norm(), 1e-9);
  TouchedBall slow({-0.9 * sim::kMinBounce_m_s, 0, 0});
  slow.manifold.points[0].restitution = 0.6;
  slow.step();
  EXPECT_LT(slow.velocity_m_s().norm(), 1e-9);
}

TEST(RigidBodiesInHullContact, APenetrationGivesNoVelocity) {
  TouchedBall ball(kOrigin);
  ball.manifold.points[0].distance_m = -0.01;
  ball.step();
  EXPECT_LT(ball.velocity_m_s().norm(), 1e-12);
  EXPECT_LT(ball.bodies->center_world_m(0).norm(), 1e-12);
}

TEST(RigidBodiesInHullContact, ADistantSurfaceOnlyStopsWhatWouldReachIt) {
  TouchedBall ball({-1, 0, 0});
  ball.manifold.points[0].distance_m = 0.5 * kStep_s;
  ball.step();
  EXPECT_NEAR(ball.velocity_m_s().x(), -0.5, 1e-9) << "it reaches the surface at the step's end";
  TouchedBall far({-1, 0, 0});
  far.manifold.points[0].distance_m = 2 * kStep_s;
  far.step();
  EXPECT_NEAR(far.velocity_m_s().x(), -1, 1e-9);
}

}  // namespace
}  // namespace fivepipe::test
