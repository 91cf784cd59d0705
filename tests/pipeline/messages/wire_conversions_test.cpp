#include "common/pipeline/messages/wire_conversions.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <stdexcept>

#include "common/pipeline/messages/camera_messages.h"
#include "common/pipeline/messages/view_messages.h"

namespace fivepipe::messages {
namespace {

TEST(WireConversions, SetTextNeedsRoomForTheTerminator) {
  char field[6] = "other";
  set_text(field, "ab");
  EXPECT_STREQ(field, "ab");
  set_text(field, "12345");
  EXPECT_STREQ(field, "12345");
  try {
    set_text(field, "123456");
    FAIL();
  } catch (const std::length_error& error) {
    EXPECT_STREQ(error.what(), "'123456' is longer than 5 characters");
  }
  EXPECT_STREQ(field, "12345");
}

// DDS frees the memory of a message whose sequences own it.
TEST(WireConversions, ABorrowedSequenceDoesNotOwnItsMemory) {
  std::vector<std::uint8_t> storage{1, 2, 3};
  fivepipe_v1_ObjectPixelMap message{};
  message.payload._release = true;
  borrow(message.payload, storage);
  EXPECT_FALSE(message.payload._release);
  EXPECT_EQ(message.payload._maximum, 3u);
  EXPECT_EQ(span_of(message.payload).data(), storage.data());
  EXPECT_EQ(span_of(message.payload).size(), 3u);
}

// A frame number is exact as a double.
TEST(WireConversions, FramesUpTo2To53AndStampsUpTo2200ArePlausible) {
  const std::uint64_t last_frame = std::uint64_t(std::ldexp(1.0, 53));
  const std::int64_t year_2200_ns =
      std::chrono::nanoseconds(
          std::chrono::sys_days(std::chrono::year(2200) / 1 / 1).time_since_epoch())
          .count();
  EXPECT_FALSE(why_implausible(last_frame, year_2200_ns));
  EXPECT_EQ(why_implausible(last_frame + 1, year_2200_ns), "frame number above 2^53");
  EXPECT_EQ(why_implausible(last_frame, year_2200_ns + 1), "timestamp before 1970 or after 2200");
  EXPECT_EQ(why_implausible(0, -1), "timestamp before 1970 or after 2200");
}

// A rig with a fixed camera and one that the viewer carries; the first gives only colour.
config::Rig rig() {
  config::Rig rig;
  for (const char* name : {"wall", "head"}) {
    config::RigCamera camera;
    camera.name = name;
    camera.published = camera.source = {40, 30, 50, 50, 20, 15};
    rig.cameras.push_back(camera);
  }
  rig.cameras[0].gives_shape = false;
  rig.cameras[1].mount = config::Mount::viewer;
  return rig;
}

template <class T>
std::string why(const Received<T>& received) {
  const auto* bad = std::get_if<BadMessage>(&received);
  return bad ? text_of(*bad) : "";
}

TEST(CameraMessages, AMapOfACameraThatGivesOnlyColourIsRefused) {
  const hull::ObjectPixels pixels(40, 30);
  EXPECT_EQ(why(object_pixels_from(map_message("wall", 1, 2, pixels).message(), rig())),
            "bad_map: wall: the camera gives no shape");
  const auto received = object_pixels_from(map_message("head", 1, 2, pixels).message(), rig());
  ASSERT_EQ(why(received), "");
  EXPECT_EQ(std::get<frames::CameraMap>(received).camera, 1u);
}

// The rig knows the pose of a fixed camera only.
TEST(CameraMessages, TheColourOfACarriedCameraHasThePoseOfItsMessage) {
  hull::ObjectPixels pixels(40, 30);
  pixels.set(3, 4);
  const auto pose = geometry::look_at({0.3, -0.7, 0.9}, {0, 0.1, 0.2});
  const hull::ColourRegion sent{
      {rig().cameras[1].published, pose}, pixels, {3, 4, 4, 5}, {7, 8, 9}};
  OutgoingColour out = colour_message("head", 11, 12, sent);
  const auto received = colour_from(out.message(), rig());
  ASSERT_EQ(why(received), "");
  const CameraColour& colour = std::get<CameraColour>(received);
  EXPECT_EQ(colour.camera, 1u);
  EXPECT_EQ(colour.frame, 11u);
  EXPECT_EQ(colour.capture_stamp_ns, 12);
  EXPECT_TRUE(colour.colour.camera.camera_from_world.isApprox(pose, 1e-12));
  EXPECT_EQ(colour.colour.camera.pinhole, rig().cameras[1].published);
  out.header.camera_from_world.rotation.w = NAN;
  EXPECT_EQ(why(colour_from(out.message(), rig())),
            "bad_colour: head: pose is not finite or not a rotation");
}

TEST(ViewMessages, ReasonsNameTheViewer) {
  config::Viewer viewer;
  viewer.name = "eye";
  fivepipe_v1_ViewInfo info = view_info_message(viewer);
  info.recon.fx_px = 0;
  EXPECT_EQ(why(view_geometry_from(info, viewer)).substr(0, 15), "bad_view: eye: ");
  auto pose = head_pose_message(viewer, {9, 8, Eigen::Isometry3d::Identity(), {}});
  const auto received = head_pose_from(pose.message());
  ASSERT_EQ(why(received), "");
  EXPECT_EQ(std::get<FramePose>(received).frame, 9u);
  EXPECT_EQ(std::get<FramePose>(received).capture_stamp_ns, 8);
}

}  // namespace
}  // namespace fivepipe::messages
