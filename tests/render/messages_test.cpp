#include "render_node/messages.h"

#include <gtest/gtest.h>

namespace fivepipe::render {
namespace {

constexpr std::int64_t kStamp_ns = 1'700'000'000'000'000'000;

// A valid message of each kind that render_node reads.
struct Inputs {
  fivepipe_v1_HullTile tile{};
  fivepipe_v1_VirtualState state{};
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
    set_objects(1);
    set(3, kStamp_ns);
  }
  void set(std::uint64_t frame, std::int64_t stamp_ns) {
    tile.frame = state.frame = collision.frame = frame;
    tile.capture_stamp_ns = state.capture_stamp_ns = collision.capture_stamp_ns = stamp_ns;
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
  bool collision_is_valid() const {
    return std::holds_alternative<Highlight>(highlight_from(collision));
  }
};

TEST(RenderMessages, ImplausibleFramesAndStampsAreRefused) {
  Inputs inputs;
  ASSERT_TRUE(inputs.tile_is_valid() && inputs.state_is_valid() && inputs.collision_is_valid());
  const auto none_is_valid = [&](std::uint64_t frame, std::int64_t stamp_ns) {
    inputs.set(frame, stamp_ns);
    return !inputs.tile_is_valid() && !inputs.state_is_valid() && !inputs.collision_is_valid();
  };
  for (const std::int64_t stamp_ns : {INT64_MIN, std::int64_t(-1), INT64_MAX})
    EXPECT_TRUE(none_is_valid(3, stamp_ns)) << stamp_ns;
  EXPECT_TRUE(none_is_valid(UINT64_MAX, kStamp_ns));
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
