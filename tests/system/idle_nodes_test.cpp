// Nodes without messages, and messages without readers.
#include <gtest/gtest.h>

#include "common/pipeline/messages/view_messages.h"
#include "common/pipeline/node/status_names.h"
#include "tests/support/scripted/capture.h"

namespace fivepipe::test {
namespace {

const std::string kOneBox =
    "name: far\nobjects:\n  - {name: box, box: {size_m: [1, 1, 1]}, position_m: [9, 9, 9]}\n";

using IdleNode = ScriptedCapture;

// The node sleeps until the first frame. Without readers of tiles no frame lacks its colour, and
// without readers of costs there are no costs.
TEST_F(IdleNode, AReconNodeWithoutReadersSendsTilesAlone) {
  auto views = bus_.writer<bus::topics::ViewInfo>();
  auto poses = bus_.writer<bus::topics::HeadPose>();
  start("recon_node", "recon",
        three_cameras(kOneBox,
                      "  - {name: recon, program: recon_node, backend: cpu, tile_columns: 2,\n"
                      "     tile_rows: 2}\n"));
  wait_for_readers(infos_, views, poses, maps_);
  expect_sleep();
  deliver(views, messages::view_info_message(deployment_.viewer));
  messages::FramePose pose{1, stamp_of(1), config::eye_from_world_at(deployment_.viewer, 0), {}};
  deliver(poses, messages::head_pose_message(deployment_.viewer, std::move(pose)).message());
  send_maps(1);
  ASSERT_TRUE(holds([&] { return !traces().empty(); })) << said();
  const NodeReport report = ended();
  EXPECT_EQ(report.sent.at(bus::topics::HullTile::name), 4u);
  EXPECT_EQ(report.sent.at(bus::topics::TileCosts::name), 0u);
  EXPECT_FALSE(report.counts.contains("frames_without_colour"));
}

// The node sleeps, and has no picture for the still.
TEST_F(IdleNode, ARenderNodeWithoutAFrameWritesNoStill) {
  start("render_node", "rendering",
        three_cameras(kOneBox, "  - {name: rendering, program: render_node, video: false}\n"));
  expect_sleep();
  ended();
  EXPECT_FALSE(std::filesystem::exists(out_ / "composite.png"));
}

}  // namespace
}  // namespace fivepipe::test
