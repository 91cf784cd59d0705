// Views of one or two eyes and of a light: which frames are joined, and which are dropped.
#include "render_node/views/view_assembler.h"

#include <gtest/gtest.h>

#include <optional>

namespace fivepipe::render {
namespace {

const geometry::Pinhole kEyeRecon = geometry::pinhole_from_fov(4, 2, 1.0);
const Eigen::Isometry3d kLightPose = geometry::look_at({0, 0, 3}, {0, 0.1, 0});
constexpr double kEyeDistance_m = 0.06;  // between the eyes

config::HullView eye_view(const std::string& name, double x_m) {
  return {name, kEyeRecon, 0.05, 5, std::nullopt, x_m};
}
const std::vector<config::HullView> kOneEye = {eye_view("viewer", 0)};
const std::vector<config::HullView> kTwoEyes = {{"light/0", kEyeRecon, 0.05, 5, kLightPose},
                                                eye_view("viewer/left", -kEyeDistance_m / 2),
                                                eye_view("viewer/right", kEyeDistance_m / 2)};

Eigen::Isometry3d head_of(std::uint64_t frame) {
  return geometry::look_at({0.01 * double(frame % 100), -1, 0.5}, {0, 0, 0});
}

class ViewsOfAFrame : public testing::Test {
 protected:
  // The only tile of a view, without a hit.
  static ReceivedTile tile(const config::HullView& view, std::uint64_t frame) {
    ReceivedTile tile;
    tile.frame = frame;
    tile.capture_stamp_ns = 1'000'000 + std::int64_t(frame) * 33'000'000;
    tile.tiles = 1;
    tile.eye_from_world = config::eye_from_world(view, head_of(frame));
    tile.recon = view.recon;
    tile.rect = {0, 0, view.recon.width_px, view.recon.height_px};
    return tile;
  }
  // Adds the tile to the view of that name. Returns the eyes that it completes.
  std::optional<EyeFrames> add(const std::string& view, const ReceivedTile& tile) {
    AddedToView added = assembler_.add(assembler_.find(view).value(), tile);
    if (const RefusedTile* refused = std::get_if<RefusedTile>(&added)) why_ = refused->reason;
    EyeFrames* const eyes = std::get_if<EyeFrames>(&added);
    return eyes ? std::optional(std::move(*eyes)) : std::nullopt;
  }
  std::optional<EyeFrames> add(const std::string& view, std::uint64_t frame) {
    return add(view, tile(views_.at(assembler_.find(view).value()), frame));
  }

  std::vector<config::HullView> views_ = kTwoEyes;
  ViewAssembler assembler_{views_};
  std::string why_;  // the last tile was refused
};

TEST_F(ViewsOfAFrame, AreKnownByTheirNames) {
  EXPECT_EQ(assembler_.find("light/0"), 0u);
  EXPECT_EQ(assembler_.find("viewer/left"), 1u);
  EXPECT_EQ(assembler_.find("viewer/right"), 2u);
  EXPECT_EQ(assembler_.find("viewer"), std::nullopt);
}

TEST_F(ViewsOfAFrame, OneEyeWaitsForNoOther) {
  assembler_ = ViewAssembler(views_ = kOneEye);
  for (const std::uint64_t frame : {7, 8}) {
    const auto eyes = add("viewer", frame);
    ASSERT_TRUE(eyes);
    ASSERT_EQ(eyes->size(), 1u);
    EXPECT_EQ(eyes->front().frame, frame);
    EXPECT_FALSE(assembler_.lacks_light_of(eyes->front()));
  }
  EXPECT_EQ(assembler_.counts().complete, 2u);
  EXPECT_EQ(assembler_.counts().missing_eye, 0u);
}

TEST_F(ViewsOfAFrame, BothEyesAreJoinedInEitherOrderLeftFirst) {
  for (const std::uint64_t frame : {7, 8}) {
    const bool left_first = frame == 7;
    EXPECT_FALSE(add(left_first ? "viewer/left" : "viewer/right", frame));
    const auto eyes = add(left_first ? "viewer/right" : "viewer/left", frame);
    ASSERT_TRUE(eyes);
    ASSERT_EQ(eyes->size(), 2u);
    for (const int eye : {0, 1}) {
      const HullFrame& hull = (*eyes)[std::size_t(eye)];
      EXPECT_EQ(hull.frame, frame);
      EXPECT_NEAR(hull.eye_from_world.translation().x() - head_of(frame).translation().x(),
                  eye == 0 ? kEyeDistance_m / 2 : -kEyeDistance_m / 2, 1e-12);
    }
  }
  EXPECT_EQ(assembler_.counts().missing_eye, 0u);
}

TEST_F(ViewsOfAFrame, AFrameWithoutOneEyeIsDroppedForANewerOneAndCounted) {
  EXPECT_FALSE(add("viewer/left", 7));
  EXPECT_FALSE(add("viewer/right", 8));
  EXPECT_FALSE(add("viewer/left", 9));
  EXPECT_EQ(assembler_.counts().missing_eye, 0u) << "the other eyes may still arrive";
  EXPECT_TRUE(add("viewer/right", 9));
  EXPECT_EQ(assembler_.counts().missing_eye, 2u);
  EXPECT_FALSE(add("viewer/right", 7)) << "late";
  EXPECT_EQ(assembler_.counts().late, 1u);
  EXPECT_FALSE(add("viewer/left", 10));
  EXPECT_TRUE(add("viewer/right", 10));
  EXPECT_EQ(assembler_.counts().missing_eye, 2u);
}

TEST_F(ViewsOfAFrame, ByCaptureACompleteFrameKeepsOlderOnes) {
  const auto add_by_capture = [&](std::size_t view, std::uint64_t frame) {
    return std::holds_alternative<EyeFrames>(
        assembler_.add(view, tile(views_.at(view), frame), FrameOrder::capture));
  };
  EXPECT_FALSE(add_by_capture(1, 7));
  EXPECT_FALSE(add_by_capture(1, 8));
  EXPECT_TRUE(add_by_capture(2, 8));
  EXPECT_TRUE(add_by_capture(2, 7));
  EXPECT_EQ(assembler_.counts().missing_eye, 0u);
}

// A newer frame of one eye does not drop an older one whose other eye is on its way.
TEST_F(ViewsOfAFrame, OlderFramesWaitWhileNoNewerOneIsComplete) {
  for (const std::uint64_t frame : {7, 8, 9}) EXPECT_FALSE(add("viewer/left", frame));
  for (const std::uint64_t frame : {7, 8, 9}) EXPECT_TRUE(add("viewer/right", frame)) << frame;
  EXPECT_EQ(assembler_.counts().missing_eye, 0u);
}

// A node that was busy takes the tiles of as many frames at once as its reader holds, eye by eye.
TEST_F(ViewsOfAFrame, EightFramesThatArriveByEyeAreAllJoined) {
  for (std::uint64_t frame = 1; frame <= 8; ++frame) EXPECT_FALSE(add("viewer/left", frame));
  for (std::uint64_t frame = 1; frame <= 8; ++frame)
    EXPECT_TRUE(add("viewer/right", frame)) << frame;
  EXPECT_EQ(assembler_.counts().missing_eye, 0u);
}

TEST_F(ViewsOfAFrame, FramesBeyondTheMaximumThatWaitForAnEyeAreDropped) {
  const std::uint64_t max = TileAssembler::kMaxOpenFrames;
  for (std::uint64_t frame = 1; frame <= max + 3; ++frame) add("viewer/left", frame);
  EXPECT_EQ(assembler_.counts().missing_eye, 3u);
  EXPECT_FALSE(add("viewer/right", 3));
  EXPECT_TRUE(add("viewer/right", 4));
}

// A restarted capture_node sends frames with the numbers of earlier ones.
TEST_F(ViewsOfAFrame, EyesOfDifferentCapturesAreNotJoined) {
  EXPECT_FALSE(add("viewer/left", 7));
  ReceivedTile later = tile(kTwoEyes[2], 7);
  later.capture_stamp_ns += 5'000'000'000;
  EXPECT_FALSE(add("viewer/right", later));
}

// A recon_node with another deployment.
TEST_F(ViewsOfAFrame, EyesOfAnotherDistanceAreRefused) {
  add("viewer/left", 7);
  ReceivedTile wider = tile(kTwoEyes[2], 7);
  wider.eye_from_world.translation().x() -= 1e-4;
  EXPECT_FALSE(add("viewer/right", wider));
  EXPECT_EQ(why_, "eyes of another distance");
  add("viewer/left", 8);
  EXPECT_TRUE(add("viewer/right", 8));
}

TEST_F(ViewsOfAFrame, TheLightsViewIsThatOfTheSameFrame) {
  EXPECT_FALSE(add("light/0", 7));
  add("viewer/left", 7);
  const HullFrame seven = add("viewer/right", 7).value().front();
  add("viewer/left", 8);
  const HullFrame eight = add("viewer/right", 8).value().front();
  ASSERT_TRUE(assembler_.light_of(seven));
  EXPECT_TRUE(assembler_.light_of(seven)->eye_from_world.isApprox(kLightPose));
  EXPECT_FALSE(assembler_.lacks_light_of(seven));
  EXPECT_FALSE(assembler_.light_of(eight));
  EXPECT_TRUE(assembler_.lacks_light_of(eight));
  HullFrame other_capture = seven;
  other_capture.capture_stamp_ns += 1;
  EXPECT_TRUE(assembler_.lacks_light_of(other_capture));
  EXPECT_FALSE(add("light/0", 8));
  EXPECT_FALSE(assembler_.lacks_light_of(eight));
  ReceivedTile moved = tile(kTwoEyes[0], 9);
  moved.eye_from_world = head_of(9);
  add("light/0", moved);
  EXPECT_EQ(why_, "pose of another light");
}

TEST_F(ViewsOfAFrame, AResetForgetsAllOfThem) {
  add("light/0", 700);
  add("viewer/left", 700);
  const HullFrame before = add("viewer/right", 700).value().front();
  add("viewer/left", 701);
  assembler_.reset();
  EXPECT_TRUE(assembler_.lacks_light_of(before));
  EXPECT_EQ(assembler_.counts().missing_eye, 1u);
  EXPECT_FALSE(add("viewer/left", 1));
  EXPECT_TRUE(add("viewer/right", 1)) << "any frame number may be next";
  EXPECT_FALSE(add("viewer/right", 701)) << "its left eye is forgotten";
}

}  // namespace
}  // namespace fivepipe::render
