#include "render_node/virtual_frames.h"

#include <gtest/gtest.h>

#include "tests/support/time_units.h"

namespace fivepipe::render {
namespace {

std::vector<ObjectPose> ball_at(double x_m) {
  ObjectPose pose{"ball", Eigen::Isometry3d::Identity(), {}, {}};
  pose.world_from_object.translation().x() = x_m;
  return {pose};
}
double x_of(const VirtualFrame* frame) {
  return frame->poses.at(0).world_from_object.translation().x();
}

TEST(VirtualFrames, BestIsTheSameFrameThenAnOlderThenTheOldest) {
  VirtualFrames frames;
  EXPECT_EQ(frames.best_for(5), nullptr);
  frames.add_state(4, 4, ball_at(4));
  frames.add_state(6, 6, ball_at(6));
  EXPECT_TRUE(frames.has(4));
  EXPECT_FALSE(frames.has(5));
  EXPECT_EQ(x_of(frames.best_for(6)), 6);
  EXPECT_EQ(x_of(frames.best_for(5)), 4);
  EXPECT_EQ(x_of(frames.best_for(9)), 6);
  EXPECT_EQ(x_of(frames.best_for(1)), 4);
}

TEST(VirtualFrames, CountTheStatesBetweenTwoCaptures) {
  VirtualFrames frames;
  EXPECT_EQ(frames.between(std::nullopt, 90), 0u);
  frames.add_state(4, 40, ball_at(4));
  frames.add_collision(6, 60, "block");
  EXPECT_EQ(frames.between(std::nullopt, 50), 1u);
  EXPECT_EQ(frames.between(30, 50), 1u);
  EXPECT_EQ(frames.between(std::nullopt, 40), 0u);
  EXPECT_EQ(frames.between(40, 90), 0u) << "frame 6 has no state yet";
  frames.add_state(6, 60, ball_at(6));
  EXPECT_EQ(frames.between(40, 90), 1u);
  EXPECT_EQ(frames.between(std::nullopt, 90), 2u);
}

TEST(VirtualFrames, AFrameWithoutAStateIsIncomplete) {
  VirtualFrames frames;
  frames.add_collision(7, 7, "block");
  EXPECT_FALSE(frames.has(7));
  EXPECT_EQ(frames.best_for(7), nullptr);
  frames.add_state(7, 7, ball_at(0));
  frames.add_state(8, 8, ball_at(0));
  EXPECT_TRUE(frames.best_for(7)->colliding.contains("block"));
  EXPECT_TRUE(frames.best_for(8)->colliding.empty());
}

TEST(VirtualFrames, KeepTheNewestParticlesOfEachSource) {
  VirtualFrames frames;
  frames.add_particles(7, 7, {0, {1, 2, 3}});
  frames.add_particles(7, 7, {1, {4, 5, 6}});
  frames.add_particles(7, 7, {0, {7, 8, 9}});
  EXPECT_FALSE(frames.has(7)) << "the state is missing";
  frames.add_state(7, 7, ball_at(0));
  frames.add_state(8, 8, ball_at(0));
  ASSERT_EQ(frames.best_for(7)->particles.size(), 2u);
  EXPECT_EQ(frames.best_for(7)->particles[0].source, 1u);
  EXPECT_EQ(frames.best_for(7)->particles[1].p_world_m, (std::vector<float>{7, 8, 9}));
  EXPECT_TRUE(frames.best_for(8)->particles.empty());
}

TEST(VirtualFrames, KeepTheNewestMarksOfEachObject) {
  const auto marks_at = [](std::size_t object, float x_m) {
    return CollisionMarks{.object = object, .points_world_m = {Eigen::Vector3f(x_m, 0, 0)}};
  };
  VirtualFrames frames;
  frames.add_marks(7, 7, marks_at(2, 1));
  frames.add_marks(7, 7, marks_at(3, 2));
  frames.add_marks(7, 7, marks_at(2, 3));
  EXPECT_FALSE(frames.has(7)) << "the state is missing";
  frames.add_state(7, 7, ball_at(0));
  frames.add_state(8, 8, ball_at(0));
  ASSERT_EQ(frames.best_for(7)->marks.size(), 2u);
  EXPECT_EQ(frames.best_for(7)->marks[0].object, 3u);
  EXPECT_EQ(frames.best_for(7)->marks[1].points_world_m[0].x(), 3);
  EXPECT_TRUE(frames.best_for(8)->marks.empty());
}

TEST(VirtualFrames, StayBoundedAndKeepTheNewest) {
  VirtualFrames frames;
  for (std::uint64_t frame = 0; frame < 100; ++frame)
    frames.add_state(frame, std::int64_t(frame), ball_at(double(frame)));
  EXPECT_TRUE(frames.has(99));
  EXPECT_FALSE(frames.has(83));
  frames.add_state(83, 83, ball_at(3));
  frames.add_collision(83, 83, "block");
  EXPECT_FALSE(frames.has(83));
  EXPECT_TRUE(frames.has(84));
}

// Otherwise a peer's frame numbers near 2^64 would fill the table and refuse all others.
TEST(VirtualFrames, WrongFrameNumbersDoNotKeepStatesOut) {
  VirtualFrames frames;
  std::uint64_t wrong = UINT64_MAX - 10'000;
  for (std::uint64_t frame = 1; frame < 100; ++frame) {
    for (std::size_t i = 0; i <= VirtualFrames::kMaxFrames; ++i)
      frames.add_state(++wrong, std::int64_t(frame), ball_at(-1));
    frames.add_collision(++wrong, INT64_MAX, "block");
    frames.add_marks(++wrong, INT64_MAX, {});
    frames.add_state(frame, std::int64_t(frame), ball_at(double(frame)));
    ASSERT_TRUE(frames.has(frame)) << frame;
    ASSERT_EQ(x_of(frames.best_for(frame)), double(frame));
  }
}

TEST(VirtualFrames, FollowsRestartedCapture) {
  VirtualFrames frames;
  frames.add_state(50, 10 * test::s, ball_at(50));
  frames.add_state(0, 11 * test::s, ball_at(0));
  EXPECT_EQ(x_of(frames.best_for(1)), 0);
  EXPECT_FALSE(frames.has(50));
}

}  // namespace
}  // namespace fivepipe::render
