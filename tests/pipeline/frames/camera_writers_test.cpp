#include "common/pipeline/frames/camera_writers.h"

#include <gtest/gtest.h>

namespace fivepipe::frames {
namespace {

constexpr std::size_t kLeft = 0, kRight = 1;

// Judges `count` messages. Returns how many are of the current writer.
std::size_t current(CameraWriters& writers, std::size_t camera, std::uint64_t writer,
                    std::size_t count) {
  std::size_t sum = 0;
  for (std::size_t i = 0; i < count; ++i) sum += writers.judge(camera, writer).is_current;
  return sum;
}

TEST(CameraWriters, TheFirstWriterReplacesNone) {
  CameraWriters writers;
  for (int i = 0; i < 3; ++i) {
    const auto verdict = writers.judge(kLeft, 0);
    EXPECT_TRUE(verdict.is_current);
    EXPECT_FALSE(verdict.replaced);
  }
}

TEST(CameraWriters, ANewWriterReplacesTheOldOneInAllItsCameras) {
  CameraWriters writers;
  for (const std::size_t camera : {kLeft, kRight}) writers.judge(camera, 1);
  EXPECT_EQ(writers.judge(kLeft, 2).replaced, 1u);
  EXPECT_FALSE(writers.judge(kLeft, 2).replaced) << "once";
  EXPECT_EQ(current(writers, kLeft, 1, 8), 0u) << "late messages";
  EXPECT_EQ(current(writers, kRight, 1, 8), 0u) << "late messages of another camera";
  const auto right = writers.judge(kRight, 2);
  EXPECT_TRUE(right.is_current);
  EXPECT_FALSE(right.replaced) << "it has been replaced already";
}

TEST(CameraWriters, TwoCaptureNodesAreIndependent) {
  CameraWriters writers;
  writers.judge(kLeft, 1);
  writers.judge(kRight, 2);
  EXPECT_EQ(writers.judge(kRight, 3).replaced, 2u);
  EXPECT_EQ(current(writers, kLeft, 1, 20), 20u);
}

// The new writer is that of a peer, or of a second deployment.
TEST(CameraWriters, AReplacedWriterThatIsAliveReturns) {
  CameraWriters writers;
  writers.judge(kLeft, 1);
  EXPECT_EQ(writers.judge(kLeft, 9).replaced, 1u);
  // Both go on. The true writer is dropped 8 times, as often as messages of a dead one may arrive.
  std::size_t dropped = 0;
  for (int i = 0; i < 200; ++i) {
    const auto verdict = writers.judge(kLeft, 1);
    dropped += !verdict.is_current;
    if (verdict.replaced) {
      EXPECT_EQ(verdict.replaced, 9u);
    }
    const auto of_peer = writers.judge(kLeft, 9);
    EXPECT_EQ(of_peer.is_current, i < 8) << i;
  }
  EXPECT_EQ(dropped, 8u);
}

TEST(CameraWriters, AWriterThatGoesOnReplacesASilentOne) {
  CameraWriters writers;
  writers.judge(kLeft, 1);
  writers.judge(kLeft, 9);
  EXPECT_EQ(current(writers, kLeft, 1, 9), 1u) << "alive";
  EXPECT_EQ(current(writers, kLeft, 9, 16), 0u);
  EXPECT_EQ(writers.judge(kLeft, 9).replaced, 1u);
}

// A peer may create any number of writers.
TEST(CameraWriters, ManyWritersDoNotKeepTheTrueOneOut) {
  CameraWriters writers;
  writers.judge(kLeft, 1);
  for (std::uint64_t peer = 1000; peer < 3000; ++peer) writers.judge(kLeft, peer);
  EXPECT_GE(current(writers, kLeft, 1, 20), 3u);
}

}  // namespace
}  // namespace fivepipe::frames
