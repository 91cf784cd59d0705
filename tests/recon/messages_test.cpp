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

TEST(TileMessage, WithoutEmptyCamerasHasAnEmptySequence) {
  OutgoingTile out = tile_message({"hmd", 7, 1'000, {}, 4, {}}, {});
  EXPECT_EQ(out.message().empty_cameras._length, 0u);
  EXPECT_EQ(out.message().empty_cameras._buffer, nullptr);
}

}  // namespace
}  // namespace fivepipe::recon
