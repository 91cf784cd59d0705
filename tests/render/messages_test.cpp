#include "render_node/messages.h"

#include <gtest/gtest.h>

namespace fivepipe::render {
namespace {

constexpr std::int64_t kStamp_ns = 1'700'000'000'000'000'000;

// A valid message of each kind that render_node reads.
struct Inputs {
  fivepipe_v1_HullTile tile{};
  fivepipe_v1_VirtualState state{};
  fivepipe_v1_Particles particles{};
  fivepipe_v1_CollisionResult collision{};
  std::vector<char[33]> empty_cameras{1};
  config::Rig rig;
  config::Scene scene;
  std::vector<fivepipe_v1_ObjectState> objects{1};

  Inputs() {
    tile.eye_from_world = messages::to_wire(Eigen::Isometry3d::Identity());
    rig.cameras.emplace_back().name = "left";
    messages::set_text(empty_cameras[0], "left");
    messages::borrow(tile.empty_cameras, empty_cameras);
    scene.objects.emplace_back().name = "ball";
    scene.particles.resize(2);
    scene.particles[1].name = "grains";
    messages::set_text(particles.source, "grains");
    set_objects(1);
    set(3, kStamp_ns);
  }
  void set(std::uint64_t frame, std::int64_t stamp_ns) {
    tile.frame = state.frame = collision.frame = particles.frame = frame;
    tile.capture_stamp_ns = state.capture_stamp_ns = collision.capture_stamp_ns =
        particles.capture_stamp_ns = stamp_ns;
  }
  // Copies of one object.
  void set_objects(std::size_t count) {
    objects.resize(count);
    for (fivepipe_v1_ObjectState& object : objects) {
      messages::set_text(object.object, "ball");
      object.world_from_object = messages::to_wire(Eigen::Isometry3d::Identity());
    }
    messages::borrow(state.objects, objects);
  }
  bool tile_is_valid() const { return std::holds_alternative<ReceivedTile>(tile_from(tile, rig)); }
  bool state_is_valid() const {
    return std::holds_alternative<std::vector<ObjectPose>>(poses_from(state, scene));
  }
  bool particles_are_valid() const {
    return std::holds_alternative<ReceivedParticles>(particles_from(particles, scene));
  }
  bool collision_is_valid() const {
    return std::holds_alternative<Highlight>(highlight_from(collision));
  }
};

TEST(RenderMessages, ImplausibleFramesAndStampsAreRefused) {
  Inputs inputs;
  ASSERT_TRUE(inputs.tile_is_valid() && inputs.state_is_valid() && inputs.collision_is_valid() &&
              inputs.particles_are_valid());
  const auto none_is_valid = [&](std::uint64_t frame, std::int64_t stamp_ns) {
    inputs.set(frame, stamp_ns);
    return !inputs.tile_is_valid() && !inputs.state_is_valid() && !inputs.collision_is_valid() &&
           !inputs.particles_are_valid();
  };
  for (const std::int64_t stamp_ns : {INT64_MIN, std::int64_t(-1), INT64_MAX})
    EXPECT_TRUE(none_is_valid(3, stamp_ns)) << stamp_ns;
  EXPECT_TRUE(none_is_valid(UINT64_MAX, kStamp_ns));
}

TEST(RenderMessages, ATileHasEveryFieldOfItsMessage) {
  Inputs inputs;
  fivepipe_v1_HullTile& message = inputs.tile;
  const Eigen::Isometry3d eye_from_world = geometry::look_at({0.2, -1, 0.3}, {0, 0, 0});
  const geometry::Pinhole recon = geometry::pinhole_from_fov(64, 48, 0.9);
  std::vector<float> depth_m{1, 2};
  std::vector<std::uint8_t> bgr{1, 2, 3, 4, 5, 6};
  message.tile = 5;
  message.tiles = 12;
  message.eye_from_world = messages::to_wire(eye_from_world);
  message.recon = messages::to_wire(recon);
  message.rect = messages::to_wire(hull::PixelRect{16, 12, 32, 24});
  message.covered = messages::to_wire(hull::PixelRect{17, 13, 19, 14});
  messages::borrow(message.depth_m, depth_m);
  messages::borrow(message.bgr, bgr);
  const auto received = tile_from(message, inputs.rig);
  const ReceivedTile& tile = std::get<ReceivedTile>(received);
  EXPECT_EQ(tile.frame, 3u);
  EXPECT_EQ(tile.capture_stamp_ns, kStamp_ns);
  EXPECT_EQ(tile.tile, 5u);
  EXPECT_EQ(tile.tiles, 12u);
  EXPECT_TRUE(tile.eye_from_world.isApprox(eye_from_world, 1e-12));
  EXPECT_EQ(tile.recon, recon);
  EXPECT_EQ(tile.rect, (hull::PixelRect{16, 12, 32, 24}));
  EXPECT_EQ(tile.covered, (hull::PixelRect{17, 13, 19, 14}));
  EXPECT_EQ(std::vector<float>(tile.depth_m.begin(), tile.depth_m.end()), depth_m);
  EXPECT_EQ(std::vector<std::uint8_t>(tile.bgr.begin(), tile.bgr.end()), bgr);
  EXPECT_EQ(tile.empty_cameras, std::vector<std::string>{"left"});
}

TEST(RenderMessages, APoseHasEveryFieldOfItsObject) {
  Inputs inputs;
  Eigen::Isometry3d world_from_object = Eigen::Isometry3d::Identity();
  world_from_object.translation() = Eigen::Vector3d(1, 2, 3);
  std::vector<float> vertices_m{1, 2, 3}, warmth{0.5f};
  inputs.objects[0].world_from_object = messages::to_wire(world_from_object);
  messages::borrow(inputs.objects[0].vertices_m, vertices_m);
  messages::borrow(inputs.objects[0].warmth, warmth);
  const auto received = poses_from(inputs.state, inputs.scene);
  const ObjectPose& pose = std::get<std::vector<ObjectPose>>(received).at(0);
  EXPECT_EQ(pose.object, "ball");
  EXPECT_TRUE(pose.world_from_object.isApprox(world_from_object));
  EXPECT_EQ(pose.vertices_m, vertices_m);
  EXPECT_EQ(pose.warmth, warmth);
}

TEST(RenderMessages, ParticlesHaveEveryFieldOfTheirMessage) {
  Inputs inputs;
  std::vector<float> p_m{1, 2, 3, 4, 5, 6};
  messages::borrow(inputs.particles.p_m, p_m);
  const auto received = particles_from(inputs.particles, inputs.scene);
  const ReceivedParticles& particles = std::get<ReceivedParticles>(received);
  EXPECT_EQ(particles.frame, 3u);
  EXPECT_EQ(particles.capture_stamp_ns, kStamp_ns);
  EXPECT_EQ(particles.particles.source, 1u);
  EXPECT_EQ(particles.particles.p_world_m, p_m);
}

TEST(RenderMessages, AHighlightHasTheFrameAndTheStamp) {
  const Inputs inputs;
  const auto received = highlight_from(inputs.collision);
  EXPECT_EQ(std::get<Highlight>(received).frame, 3u);
  EXPECT_EQ(std::get<Highlight>(received).capture_stamp_ns, kStamp_ns);
}

TEST(RenderMessages, ACompositedMessageHasTheTimesOfItsHull) {
  HullFrame hull;
  hull.frame = 8;
  hull.capture_stamp_ns = 1'000;
  const fivepipe_v1_FrameComposited message = composited_message("left_eye", hull, 2'000);
  EXPECT_STREQ(message.viewer, "left_eye");
  EXPECT_EQ(message.frame, 8u);
  EXPECT_EQ(message.capture_stamp_ns, 1'000);
  EXPECT_EQ(message.composited_stamp_ns, 2'000);
}

// "reason: subject: detail" of the drop.
template <class Value>
std::string drop_of(const messages::Received<Value>& received) {
  const messages::BadMessage& bad = std::get<messages::BadMessage>(received);
  return bad.reason + ": " + bad.subject + ": " + bad.detail;
}

TEST(RenderMessages, TheDropNamesTheReason) {
  Inputs inputs;
  std::vector<char[33]> empty_cameras(2);
  for (auto& camera : empty_cameras) messages::set_text(camera, "left");
  messages::borrow(inputs.tile.empty_cameras, empty_cameras);
  EXPECT_EQ(drop_of(tile_from(inputs.tile, inputs.rig)),
            "bad_tile: : more empty cameras than cameras");
  messages::set_text(inputs.particles.source, "smoke");
  EXPECT_EQ(drop_of(particles_from(inputs.particles, inputs.scene)),
            "bad_particles: smoke: not in the scene");
  inputs.rig.cameras.emplace_back().name = "right";
  messages::set_text(empty_cameras[1], "middle");
  EXPECT_EQ(drop_of(tile_from(inputs.tile, inputs.rig)), "bad_tile: middle: unknown empty camera");
  inputs.tile.eye_from_world.rotation.w = 7;
  EXPECT_EQ(drop_of(tile_from(inputs.tile, inputs.rig)),
            "bad_tile: : pose is not finite or not a rotation");
  inputs.objects[0].world_from_object.rotation.w = 7;
  EXPECT_EQ(drop_of(poses_from(inputs.state, inputs.scene)),
            "bad_state: ball: pose is not finite or not a rotation");
  inputs.set_objects(2);
  EXPECT_EQ(drop_of(poses_from(inputs.state, inputs.scene)),
            "bad_state: : more objects than the scene has");
  messages::set_text(inputs.collision.object, "ball");
  inputs.set(3, -1);
  EXPECT_TRUE(drop_of(poses_from(inputs.state, inputs.scene)).starts_with("bad_state: : "));
  EXPECT_TRUE(drop_of(highlight_from(inputs.collision)).starts_with("bad_collision: ball: "));
  inputs.tile.eye_from_world.rotation.w = 1;
  EXPECT_TRUE(drop_of(tile_from(inputs.tile, inputs.rig)).starts_with("bad_tile: : "));
}

// Otherwise a tile could list any number of names, which the status shows.
TEST(RenderMessages, ATileWithAnUnknownEmptyCameraIsRefused) {
  Inputs inputs;
  messages::set_text(inputs.empty_cameras[0], "invented");
  EXPECT_FALSE(inputs.tile_is_valid());
}

// Otherwise a state could repeat an object any number of times, and the kept states fill the
// memory.
TEST(RenderMessages, AStateWithMoreObjectsThanTheSceneIsRefused) {
  Inputs inputs;
  inputs.set_objects(1000);
  EXPECT_FALSE(inputs.state_is_valid());
  inputs.set_objects(0);
  EXPECT_TRUE(inputs.state_is_valid());
}

TEST(RenderMessages, ObjectsThatCollideOrMetTheHullAreHighlighted) {
  Inputs inputs;
  const auto collides = [&] {
    const auto received = highlight_from(inputs.collision);
    return std::get<Highlight>(received).collides;
  };
  for (const auto verdict : {fivepipe_v1_free, fivepipe_v1_undecided}) {
    inputs.collision.verdict = verdict;
    EXPECT_FALSE(collides());
  }
  inputs.collision.verdict = fivepipe_v1_colliding;
  EXPECT_TRUE(collides());
  inputs.collision.verdict = fivepipe_v1_free;
  std::vector<fivepipe_v1_FirstContact> contacts(1);
  messages::borrow(inputs.collision.first_contact, contacts);
  EXPECT_TRUE(collides());
}

}  // namespace
}  // namespace fivepipe::render
