#include "recon_node/messages.h"

#include <gtest/gtest.h>

namespace fivepipe::recon {
namespace {

// Cyclone DDS frees a sequence with `_release` set, together with the message.
TEST(TileMessage, KeepsItsSequences) {
  const TileFrame frame{"hmd", 7, 1'000, {}, 4, {"left", "right"}};
  ReconTile tile;
  tile.depth_m = {1.0f, 2.0f};
  tile.bgr = {1, 2, 3};
  OutgoingTile out = tile_message(frame, tile);
  const fivepipe_v1_HullTile& message = out.message();
  EXPECT_FALSE(message.depth_m._release);
  EXPECT_FALSE(message.bgr._release);
  EXPECT_FALSE(message.empty_cameras._release);
  ASSERT_EQ(message.empty_cameras._length, 2u);
  EXPECT_STREQ(message.empty_cameras._buffer[0], "left");
  EXPECT_STREQ(message.empty_cameras._buffer[1], "right");
  EXPECT_EQ(message.depth_m._buffer, out.depth_m.data());
  EXPECT_EQ(message.bgr._length, 3u);
}

const hull::View kView{
    {geometry::pinhole_from_fov(64, 48, 0.8), geometry::look_at({0.1, -1, 0.3}, {0, 0, 0})},
    0.05,
    3};

TEST(TileMessage, HasEveryFieldOfTheTileAndItsFrame) {
  const TileFrame frame{"hmd", 7, 1'000, kView, 12, {}};
  OutgoingTile out = tile_message(
      frame, {{5, {16, 12, 32, 24}}, {17, 13, 19, 14}, {1.0f, 2.0f}, {1, 2, 3, 4, 5, 6}, 0.5});
  const fivepipe_v1_HullTile& message = out.message();
  EXPECT_STREQ(message.viewer, "hmd");
  EXPECT_EQ(message.tile, 5);
  EXPECT_EQ(message.tiles, 12);
  EXPECT_EQ(message.frame, 7u);
  EXPECT_EQ(message.capture_stamp_ns, 1'000);
  EXPECT_TRUE(
      messages::from_wire(message.eye_from_world)->isApprox(kView.camera.camera_from_world, 1e-12));
  EXPECT_EQ(messages::from_wire(message.recon), kView.camera.pinhole);
  EXPECT_EQ(messages::from_wire(message.rect), (hull::PixelRect{16, 12, 32, 24}));
  EXPECT_EQ(messages::from_wire(message.covered), (hull::PixelRect{17, 13, 19, 14}));
  const auto depth_m = messages::span_of(message.depth_m);
  EXPECT_EQ(std::vector<float>(depth_m.begin(), depth_m.end()), (std::vector<float>{1, 2}));
  const auto bgr = messages::span_of(message.bgr);
  EXPECT_EQ(std::vector<int>(bgr.begin(), bgr.end()), (std::vector<int>{1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(message.empty_cameras._maximum, 0u);
}

TEST(CostsMessage, HasTheCostOfEachTileInMilliseconds) {
  const TileFrame frame{"hmd", 7, 1'000, kView, 12, {}};
  const std::vector<ReconTile> tiles{{{3, {}}, {}, {}, {}, 0.25}, {{9, {}}, {}, {}, {}, 2.0}};
  OutgoingCosts out = costs_message(frame, 2, tiles);
  const fivepipe_v1_TileCosts& message = out.message();
  EXPECT_STREQ(message.viewer, "hmd");
  EXPECT_EQ(message.worker, 2);
  EXPECT_EQ(message.frame, 7u);
  EXPECT_EQ(message.capture_stamp_ns, 1'000);
  const auto indices = messages::span_of(message.tiles);
  EXPECT_EQ(std::vector<int>(indices.begin(), indices.end()), (std::vector<int>{3, 9}));
  const auto cost_ms = messages::span_of(message.cost_ms);
  EXPECT_EQ(std::vector<float>(cost_ms.begin(), cost_ms.end()), (std::vector<float>{250, 2000}));
}

TEST(TileMessage, WithoutEmptyCamerasHasAnEmptySequence) {
  OutgoingTile out = tile_message({"hmd", 7, 1'000, {}, 4, {}}, {});
  EXPECT_EQ(out.message().empty_cameras._length, 0u);
  EXPECT_EQ(out.message().empty_cameras._buffer, nullptr);
}

}  // namespace
}  // namespace fivepipe::recon
