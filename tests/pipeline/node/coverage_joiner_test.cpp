#include "common/pipeline/node/coverage_joiner.h"

#include <gtest/gtest.h>

namespace fivepipe::node {
namespace {

using Outlines = std::vector<hull::CoverageOutline>;
using Names = std::vector<std::string>;

hull::CoverageOutline outline(std::uint8_t coverage) {
  hull::CoverageOutline of{hull::ObjectPixels(4, 4), {coverage}};
  of.pixels.set(1, 1);
  return of;
}
const hull::CoverageOutline kNone{hull::ObjectPixels(4, 4), {}};

// Two cameras. Writer 10 p + k is of process p.
class CoverageJoinerTest : public testing::Test {
 protected:
  CoverageJoinerTest() {
    for (const char* name : {"c0", "c1"}) {
      config::RigCamera camera;
      camera.name = name;
      rig_.cameras.push_back(camera);
    }
  }
  void add(std::uint64_t writer, std::size_t camera, std::uint64_t frame, std::uint8_t coverage,
           std::int64_t stamp_ns = 5) {
    joiner_.add(writer, {camera, frame, stamp_ns, outline(coverage)});
  }
  // Joins the set of both cameras, whose maps are of these writers and have the stamp 5.
  Outlines joined(std::uint64_t frame, std::uint64_t of_c0 = 11, std::uint64_t of_c1 = 11) {
    frames::FrameSet set{};
    set.frame = frame;
    set.cameras = {"c0", "c1"};
    set.sources = {{5, of_c0}, {5, of_c1}};
    for (int i = 0; i < 2; ++i) set.silhouettes.push_back({{}, hull::ObjectPixels(4, 4)});
    missing_ = joiner_.join(set, [](std::uint64_t a, std::uint64_t b) { return a / 10 == b / 10; });
    return set.outlines;
  }

  config::Rig rig_;
  CoverageJoiner joiner_{rig_};
  Names missing_;
};

TEST_F(CoverageJoinerTest, JoinsWhatOneProcessSendsByDifferentWriters) {
  add(12, 0, 7, 100);
  add(12, 1, 7, 200);
  EXPECT_EQ(joined(7), (Outlines{outline(100), outline(200)}));
  EXPECT_EQ(missing_, Names());
  EXPECT_EQ(joined(7), Outlines());  // each coverage once
  EXPECT_EQ(missing_, (Names{"c0", "c1"}));
}

TEST_F(CoverageJoinerTest, CoverageOfAnotherProcessFrameOrImageIsMissing) {
  add(22, 0, 7, 1);     // process
  add(12, 0, 8, 2);     // frame
  add(12, 1, 7, 3, 6);  // image
  EXPECT_EQ(joined(7), Outlines());
  add(22, 0, 9, 4);
  add(12, 1, 9, 5);
  EXPECT_EQ(joined(9), (Outlines{kNone, outline(5)}));
  EXPECT_EQ(missing_, Names{"c0"});
}

// A stranger that copies frame and stamp does not replace the camera's own coverage.
TEST_F(CoverageJoinerTest, KeepsTheCoverageOfTwoWriters) {
  for (const bool stranger_first : {false, true}) {
    const std::uint64_t frame = stranger_first ? 2 : 1;
    add(stranger_first ? 22 : 12, 0, frame, stranger_first ? 1 : 2);
    add(stranger_first ? 12 : 22, 0, frame, stranger_first ? 2 : 1);
    EXPECT_EQ(joined(frame), (Outlines{outline(2), kNone}));
  }
  for (const std::uint64_t writer : {12, 22, 32}) add(writer, 0, 3, std::uint8_t(writer));
  EXPECT_EQ(joined(3), Outlines()) << "the oldest of three is displaced";
  for (const std::uint8_t coverage : {4, 5, 6}) add(12, 0, 4, coverage);
  EXPECT_EQ(joined(4), (Outlines{outline(6), kNone})) << "the newest of a writer counts";
}

TEST_F(CoverageJoinerTest, ForgetsOldAndDisplacedFrames) {
  add(12, 0, 1, 1);
  add(12, 0, 2, 2);
  joined(2);
  EXPECT_EQ(joined(1), Outlines()) << "smaller than a joined frame";
  const std::uint64_t kept = frames::FrameSetAssembler::kMaxIncompleteSets;
  for (std::uint64_t frame = 10; frame <= 10 + kept; ++frame) add(12, 0, frame, 3);
  EXPECT_EQ(joined(10), Outlines());
  EXPECT_EQ(joined(11), (Outlines{outline(3), kNone}));
  joiner_.reset();
  EXPECT_EQ(joined(12), Outlines());
}

}  // namespace
}  // namespace fivepipe::node
