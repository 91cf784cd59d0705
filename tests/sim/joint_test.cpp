// Objects that turn on a hinge or move along a slider.
#include <gmock/gmock.h>

#include "common/config/yaml/config_error.h"
#include "sim_node/objects/joint_clearance.h"
#include "tests/support/sim_contact.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

config::SceneObject drawer() {
  config::SceneObject drawer = door();
  drawer.joint = config::Joint{.kind = config::JointKind::slider,
                               .axis = Vector3d(0, 1, 1).normalized(),
                               .lowest = -0.1,
                               .highest = 0.3,
                               .damping_1_s = 0};
  return drawer;
}

// The pose at a position has this position, and a point moves at the rate.
TEST(Jointed, PositionPoseAndRateAgree) {
  const Eigen::Isometry3d start = Eigen::Translation3d(0.3, -0.2, 1) *
                                  Eigen::Isometry3d(Eigen::AngleAxisd(0.7, Vector3d::UnitZ()));
  for (const config::SceneObject& object : {door(), drawer()}) {
    const sim::Jointed jointed{*object.joint, start};
    const double lowest = object.joint->lowest, highest = object.joint->highest;
    EXPECT_TRUE(jointed.pose(0).isApprox(start, 1e-12));
    for (const double part : {0.0, 0.3, 1.0}) {
      const double position = lowest + part * (highest - lowest);
      const Eigen::Isometry3d pose = jointed.pose(position);
      EXPECT_NEAR(jointed.position(pose), position, 1e-12);
      const Vector3d p_m(0.1, 0.2, -0.3);
      const double step = 1e-6;
      const Vector3d moved_m = jointed.pose(position + step) * p_m - pose * p_m;
      EXPECT_LT((moved_m / step - jointed.rate(pose * p_m)).norm(), 1e-5);
    }
    EXPECT_EQ(jointed.position(jointed.pose(highest + 0.1)), highest) << "held at the limits";
    EXPECT_EQ(jointed.position(jointed.pose(lowest - 0.1)), lowest) << "held at the limits";
  }
  // The nearer limit, also beyond half a turn.
  config::Joint wide = *door().joint;
  wide.lowest = 0;
  wide.highest = 170 * kDegree_rad;
  const sim::Jointed hinge{wide, start};
  EXPECT_EQ(hinge.position(hinge.pose(185 * kDegree_rad)), wide.highest);
  EXPECT_EQ(hinge.position(hinge.pose(-20 * kDegree_rad)), wide.lowest);
}

TEST(Hinge, TurnsAboutItsAxisAndStopsAtItsLimits) {
  for (const double impulse_m_s : {3.0, -3.0}) {
    config::SceneObject leaf = door();
    leaf.velocity_world_m_s = {0, impulse_m_s, 0};
    leaf.world_from_object = Eigen::Translation3d(0.3, -0.2, 1) *
                             Eigen::AngleAxisd(0.7, Vector3d::UnitZ()) *
                             Eigen::Isometry3d::Identity();
    leaf.velocity_world_m_s = leaf.world_from_object.linear() * leaf.velocity_world_m_s;
    const Vector3d hinge_m = leaf.world_from_object * leaf.joint->point_m;
    sim::RigidBodies bodies(scene_of({leaf}));
    double largest_rad = 0;
    for (int step = 0; step < 480; ++step) {
      bodies.step(kStep_s);
      const Eigen::Isometry3d pose = bodies.world_from_object(0);
      const double angle = angle_rad(leaf.world_from_object.inverse() * pose);
      EXPECT_GE(angle, -1e-12);
      EXPECT_LE(angle, 100 * kDegree_rad + 1e-12);
      EXPECT_LT((pose * leaf.joint->point_m - hinge_m).norm(), 1e-12) << "the hinge stays";
      EXPECT_LT((pose.linear() * Vector3d::UnitZ() - Vector3d::UnitZ()).norm(), 1e-12);
      largest_rad = std::max(largest_rad, angle);
      const Vector3d arm_m = pose * Vector3d(0.4, 0, 0) - hinge_m;
      const double speed_rad_s =
          arm_m.cross(bodies.velocity_m_s(0, hinge_m + arm_m)).z() / arm_m.squaredNorm();
      if (angle < 1e-9) {
        EXPECT_GE(speed_rad_s, -1e-9) << "it is stopped";
      }
      if (angle > 100 * kDegree_rad - 1e-9) {
        EXPECT_LE(speed_rad_s, 1e-9) << "it is stopped";
      }
    }
    EXPECT_NEAR(largest_rad, impulse_m_s > 0 ? 100 * kDegree_rad : 0, 1e-9);
  }
}

TEST(Hinge, DampingSlowsTheDoor) {
  config::SceneObject leaf = door(170);
  leaf.joint->damping_1_s = 2;
  leaf.velocity_world_m_s = {0, 0.2, 0};
  sim::RigidBodies bodies(scene_of({leaf}));
  bodies.step(kStep_s);
  const double first_m_s = bodies.velocity_m_s(0).norm();
  for (int step = 0; step < 120; ++step) bodies.step(kStep_s);
  EXPECT_NEAR(bodies.velocity_m_s(0).norm(), first_m_s * std::exp(-2 * 0.5), 0.02 * first_m_s);
}

TEST(Slider, MovesAlongItsAxisAndStopsAtItsLimits) {
  config::SceneObject box = drawer();
  box.velocity_world_m_s = {1, 3, 1};
  sim::RigidBodies bodies(scene_of({box}));
  double highest_m = 0;
  for (int step = 0; step < 480; ++step) {
    bodies.step(kStep_s);
    const Eigen::Isometry3d pose = bodies.world_from_object(0);
    const double along_m = pose.translation().dot(box.joint->axis);
    EXPECT_LT((pose.translation() - along_m * box.joint->axis).norm(), 1e-12);
    EXPECT_EQ(pose.linear(), Eigen::Matrix3d(Eigen::Matrix3d::Identity()));
    EXPECT_GE(along_m, -0.1 - 1e-12);
    EXPECT_LE(along_m, 0.3 + 1e-12);
    highest_m = std::max(highest_m, along_m);
  }
  EXPECT_GT(highest_m, 0.05);
  // Gravity pulls it down to its lower limit.
  EXPECT_NEAR(bodies.world_from_object(0).translation().dot(box.joint->axis), -0.1, 1e-9);
}

TEST(Hinge, AfterAResetTheDoorIsClosed) {
  config::SceneObject leaf = door();
  leaf.velocity_world_m_s = {0, 1, 0};
  sim::Simulation simulation(scene_of({leaf}), {});
  simulation.advance_to(0);
  simulation.advance_to(0.2);
  EXPECT_GT(angle_rad(simulation.states()[0].world_from_object), 0.1);
  simulation.reset();
  EXPECT_EQ(simulation.states()[0].world_from_object.matrix(), leaf.world_from_object.matrix());
}

// A real rod reaches through the door's plane, 60 cm from the hinge, and moves along +y. The door's
// face, 2 cm from the plane of the hinge, rests on the rod's surface.
double opened_to_rad(double rod_y_m, double radius_m, double x_m) {
  // The distance of the rod's centre from the plane through the hinge is radius + 2 cm.
  const double reach_m = std::hypot(x_m, rod_y_m);
  return std::atan2(rod_y_m, x_m) + std::asin((radius_m + 0.02) / reach_m);
}

TEST(Door, OpensByTheAngleThatTheHandDemands) {
  for (const double speed_m_s : {0.2, 1.0}) {
    const double radius_m = 0.02, x_m = 0.6;
    const auto cameras = ring(8, 2.5, 0.02, 600, 1.4, {0.1, 0.1, 0});
    config::SceneObject leaf = door();
    config::Scene scene = scene_of({leaf});
    scene.history.emplace();
    sim::Simulation simulation(scene, {}, {Vector3d(-0.6, -0.6, -0.4), Vector3d(0.8, 0.8, 0.4)});
    std::vector<hull::Silhouette> silhouettes;
    double y_m = -0.1;
    for (int frame = 0; y_m < 0.25; ++frame) {
      y_m = -0.1 + frame * speed_m_s * kFrame_s;
      silhouettes =
          silhouettes_of({{{-0.4 + x_m, y_m, -0.2}, {-0.4 + x_m, y_m, 0.2}, radius_m}}, cameras);
      simulation.advance_to(frame * kFrame_s, silhouettes);
    }
    const double angle = angle_rad(simulation.states()[0].world_from_object),
                 demanded = opened_to_rad(y_m, radius_m, x_m);
    EXPECT_GE(angle, demanded - 2 * kDegree_rad) << speed_m_s << " m/s";
    if (speed_m_s < 0.5) {
      EXPECT_LE(angle, demanded + 2 * kDegree_rad);
    }
  }
}

// A rod pushes the closed door against its lower stop.
TEST(Door, PushedAgainstItsClosedSideItStays) {
  config::Scene scene = scene_of({door(20)});
  scene.history.emplace();
  sim::Simulation simulation(scene, {}, {Vector3d(-0.6, -0.6, -0.4), Vector3d(0.8, 0.8, 0.4)});
  const auto cameras = ring(8, 2.5, 0.02, 600, 1.4, {0.1, 0.1, 0});
  std::vector<hull::Silhouette> silhouettes;
  for (int frame = 0; frame < 20; ++frame) {
    // It stops where its surface is 5 mm in the door.
    const double y_m = std::max(0.1 - 0.2 * frame * kFrame_s, 0.035);
    silhouettes = silhouettes_of({{{0.2, y_m, -0.2}, {0.2, y_m, 0.2}, 0.02}}, cameras);
    simulation.advance_to(frame * kFrame_s, silhouettes);
    EXPECT_NEAR(angle_rad(simulation.states()[0].world_from_object), 0, 1e-9) << frame;
  }
}

TEST(Door, PushedFurtherAtItsStopItStays) {
  config::SceneObject leaf = door(20);
  config::Scene scene = scene_of({leaf});
  scene.history.emplace();
  sim::Simulation simulation(scene, {}, {Vector3d(-0.6, -0.6, -0.4), Vector3d(0.8, 0.8, 0.4)});
  const auto cameras = ring(8, 2.5, 0.02, 600, 1.4, {0.1, 0.1, 0});
  std::vector<hull::Silhouette> silhouettes;
  for (int frame = 0; frame < 40; ++frame) {
    const double y_m = -0.1 + 0.5 * frame * kFrame_s;
    silhouettes = silhouettes_of({{{0.2, y_m, -0.2}, {0.2, y_m, 0.2}, 0.02}}, cameras);
    simulation.advance_to(frame * kFrame_s, silhouettes);
    const double angle = angle_rad(simulation.states()[0].world_from_object);
    EXPECT_LE(angle, 20 * kDegree_rad + 1e-9);
    EXPECT_GE(angle, -1e-9);
    EXPECT_TRUE(all_finite(simulation));
    // The rod, 60 cm from the hinge, demands more than 20 degrees, and passes through the door.
    if (y_m > 0.2 && y_m < 0.35) {
      EXPECT_NEAR(angle, 20 * kDegree_rad, 2 * kDegree_rad) << y_m;
    }
  }
}

// A frame of one mesh around the door: two posts, whose box contains the door.
config::SceneObject frame(double gap_m) {
  config::SceneObject frame = virtual_box("frame", kOrigin, {1, 1, 1}, config::Reaction::none);
  config::MeshShape shape;
  for (const double side : {-1.0, 1.0}) {
    const geometry::Mesh post = geometry::box_mesh({0.1, 0.1, 1});
    const auto first = std::uint32_t(shape.mesh.vertices_m.size());
    for (const Vector3d& vertex_m : post.vertices_m)
      shape.mesh.vertices_m.push_back(vertex_m + Vector3d(side * (0.45 + gap_m), 0, 0));
    for (const auto& [a, b, c] : post.triangles)
      shape.mesh.triangles.push_back({first + a, first + b, first + c});
  }
  frame.shape = shape;
  return frame;
}

config::SceneObject with_mesh(config::SceneObject object) {
  config::MeshShape shape;
  shape.mesh = mesh_of(object);
  object.shape = shape;
  return object;
}

TEST(JointClearance, AMeshMayBeNextToAFixedObject) {
  const config::SceneObject leaf = door(), mesh_leaf = with_mesh(door());
  for (const double gap_m : {0.02, 0.001, 0.0})
    for (const config::SceneObject& object : {leaf, mesh_leaf})
      EXPECT_NO_THROW(sim::check_joint_clearance(scene_of({frame(gap_m), object}))) << gap_m;
  EXPECT_NO_THROW(sim::check_joint_clearance(scene_of({frame(-0.01)}))) << "nothing is jointed";
}

// Rounding must not look like an overlap: turned, large, and far from the origin.
TEST(JointClearance, TouchingObjectsAreAllowedInAnyPose) {
  for (const double scale : {0.1, 1.0, 10.0})
    for (int turn = 0; turn < 12; ++turn) {
      const Eigen::Isometry3d pose =
          Eigen::Translation3d(5, -3, 2) *
          Eigen::AngleAxisd(0.4 * turn, Vector3d(1, 0.3 * turn, -0.7).normalized()) *
          Eigen::Isometry3d::Identity();
      config::SceneObject leaf =
          virtual_box("leaf", kOrigin, scale * Vector3d(0.8, 0.04, 1), config::Reaction::contact);
      leaf.motion = config::Motion::dynamic;
      leaf.joint = config::Joint{.kind = config::JointKind::slider,
                                 .axis = {0, 0, 1},
                                 .lowest = 0,
                                 .highest = 1,
                                 .damping_1_s = 0};
      leaf = with_mesh(leaf);
      config::SceneObject wall =
          with_mesh(virtual_box("wall", kOrigin, scale * Vector3d(0.2, 1, 1)));
      leaf.world_from_object = pose;
      wall.world_from_object = pose * Eigen::Translation3d(scale * 0.5, 0, 0);
      EXPECT_NO_THROW(sim::check_joint_clearance(scene_of({wall, leaf}))) << scale << ' ' << turn;
    }
}

TEST(JointClearance, AnOverlapWithAMeshIsRefused) {
  config::SceneObject leaf = with_mesh(door());
  leaf.location = {12, 5};
  config::Scene scene = scene_of({frame(-0.01), leaf});
  scene.file = "scene.yaml";
  const auto text_of_refusal = [](const config::Scene& refused) -> std::string {
    try {
      sim::check_joint_clearance(refused);
    } catch (const config::ConfigError& error) {
      return error.what();
    }
    return "none";
  };
  EXPECT_EQ(text_of_refusal(scene),
            "scene.yaml:12:5: the convex hull of door overlaps frame by 0.01 m at the start and "
            "could not move: leave a clearance between them");
  scene.objects[1] = door();
  EXPECT_THAT(text_of_refusal(scene), testing::HasSubstr(": door overlaps frame by 0.01 m"));
  scene.objects[0] = virtual_ball({0.45, 0, 0}, 0);
  scene.objects[0].name = "knob";
  scene.objects[0].motion = config::Motion::fixed;
  EXPECT_THAT(text_of_refusal(scene), testing::HasSubstr(": door overlaps knob by "));
  scene.objects[0].motion = config::Motion::dynamic;
  EXPECT_EQ(text_of_refusal(scene), "none") << "the joint pushes it away";
}

}  // namespace
}  // namespace fivepipe::test
