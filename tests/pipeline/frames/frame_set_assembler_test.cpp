#include <gtest/gtest.h>

#include <array>

#include "common/pipeline/frames/frame_set_assembler.h"

namespace fivepipe::frames {
namespace {

config::Rig rig_of(int cameras) {
  config::Rig rig;
  for (int i = 0; i < cameras; ++i) {
    config::RigCamera camera;
    camera.name = "c" + std::to_string(i);
    camera.source = camera.published = {64, 48, 50, 50, 31.5, 23.5};
    rig.cameras.push_back(camera);
  }
  return rig;
}

CameraMap map_of(std::size_t camera, std::uint64_t frame, bool with_object = true) {
  CameraMap map{camera, frame, std::int64_t(1000 * frame + 10 * camera),
                hull::ObjectPixels(64, 48)};
  if (with_object) map.pixels.set(5, 6);
  return map;
}

std::vector<std::uint64_t> frames_of(const std::vector<FrameSet>& sets) {
  std::vector<std::uint64_t> frames;
  for (const FrameSet& set : sets) frames.push_back(set.frame);
  return frames;
}

TEST(FrameSetAssembler, CompletesInAnyCameraOrderAndReportsSkew) {
  FrameSetAssembler sets(rig_of(3));
  EXPECT_TRUE(sets.add(map_of(2, 7)).empty());
  EXPECT_TRUE(sets.add(map_of(0, 7)).empty());
  const auto complete = sets.add(map_of(1, 7));
  ASSERT_EQ(complete.size(), 1u);
  EXPECT_EQ(complete[0].silhouettes.size(), 3u);
  EXPECT_EQ(complete[0].cameras, (std::vector<std::string>{"c0", "c1", "c2"}));
  EXPECT_EQ(complete[0].capture_stamp_ns, 7000);
  EXPECT_EQ(complete[0].skew_ns, 20);
}

TEST(FrameSetAssembler, ReportsWhenTheFirstAndTheLastMapWereReceived) {
  FrameSetAssembler sets(rig_of(3));
  std::vector<FrameSet> complete;
  for (const std::size_t camera : {1, 2, 0}) {
    CameraMap map = map_of(camera, 7);
    map.received_ns = std::array{500, 300, 400}[camera];
    complete = sets.add(map);
  }
  ASSERT_EQ(complete.size(), 1u);
  EXPECT_EQ(complete[0].first_received_ns, 300);
  EXPECT_EQ(complete[0].last_received_ns, 500);
}

TEST(FrameSetAssembler, MapsOfDifferentFramesAreNeverCombined) {
  FrameSetAssembler sets(rig_of(2));
  EXPECT_TRUE(sets.add(map_of(0, 1)).empty());
  EXPECT_TRUE(sets.add(map_of(1, 2)).empty());
  EXPECT_EQ(frames_of(sets.add(map_of(0, 2))), std::vector<std::uint64_t>{2});
  EXPECT_EQ(sets.take_drops().at("incomplete_set"), 1u);
  EXPECT_TRUE(sets.add(map_of(1, 1)).empty());
  EXPECT_TRUE(sets.take_drops().empty()) << "the frame counts once";
}

TEST(FrameSetAssembler, DuplicateMapIsCountedAndDropped) {
  FrameSetAssembler sets(rig_of(2));
  sets.add(map_of(0, 1));
  sets.add(map_of(0, 1, false));
  EXPECT_EQ(sets.take_drops().at("repeated_map"), 1u);
  EXPECT_TRUE(sets.add(map_of(1, 1))[0].empty_cameras.empty());
}

TEST(FrameSetAssembler, ReportsEmptyCameras) {
  FrameSetAssembler sets(rig_of(2));
  sets.add(map_of(0, 1));
  EXPECT_EQ(sets.add(map_of(1, 1, false))[0].empty_cameras, std::vector<std::string>{"c1"});
}

CameraMap map_from(std::uint64_t writer, std::size_t camera, std::uint64_t frame) {
  CameraMap map = map_of(camera, frame);
  map.writer = writer;
  return map;
}

TEST(FrameSetAssembler, MapsOfOneFrameNumberFromDifferentRunsAreNeverCombined) {
  FrameSetAssembler sets(rig_of(2));
  EXPECT_TRUE(sets.add(map_from(1, 0, 3)).empty());
  EXPECT_TRUE(sets.add(map_from(1, 1, 4)).empty());
  EXPECT_TRUE(sets.add(map_from(2, 0, 4)).empty()) << "a restarted capture_node";
  EXPECT_EQ(sets.take_drops(), (std::map<std::string, std::uint64_t>{{"incomplete_set", 2}}));
  EXPECT_EQ(frames_of(sets.add(map_from(2, 1, 4))), std::vector<std::uint64_t>{4});
  EXPECT_TRUE(sets.take_drops().empty());
}

// As a late reader takes them: all maps of a camera, then those of the next one.
TEST(FrameSetAssembler, MapsOfTwoRunsThatAreTakenCameraByCameraAreNeverCombined) {
  FrameSetAssembler sets(rig_of(2));
  sets.add(map_from(1, 0, 4));
  ASSERT_EQ(sets.add(map_from(1, 1, 4)).size(), 1u);
  std::vector<std::uint64_t> complete;
  for (const std::size_t camera : {0, 1})
    for (const auto& [writer, frame] :
         std::vector<std::pair<std::uint64_t, std::uint64_t>>{{1, 5}, {2, 0}, {2, 1}, {2, 5}})
      for (const FrameSet& set : sets.add(map_from(writer, camera, frame)))
        complete.push_back(set.frame);
  EXPECT_EQ(complete, (std::vector<std::uint64_t>{0, 1, 5}));
  EXPECT_EQ(sets.take_drops(),
            (std::map<std::string, std::uint64_t>{{"incomplete_set", 1}, {"other_writer", 1}}));
}

TEST(FrameSetAssembler, AMapOfTheProcessBeforeDoesNotKeepTheNextOneOut) {
  FrameSetAssembler sets(rig_of(2));
  for (const std::size_t camera : {0, 1}) sets.add(map_from(1, camera, 4));
  sets.add(map_from(2, 0, 0));
  sets.add(map_from(2, 1, 0));
  sets.add(map_from(1, 1, 5));
  EXPECT_TRUE(sets.add(map_from(2, 0, 5)).empty()) << "with a map of the process before";
  EXPECT_EQ(frames_of(sets.add(map_from(2, 1, 5))), std::vector<std::uint64_t>{5});
}

// Two capture_nodes: that of camera 1 restarts and goes on with the numbers of the other one.
TEST(FrameSetAssembler, ARestartOfOneOfTwoCaptureNodesKeepsTheMapsOfTheOther) {
  FrameSetAssembler sets(rig_of(3));
  for (const std::uint64_t frame : {7, 8}) {
    sets.add(map_from(1, 0, frame));
    sets.add(map_from(2, 1, frame));
  }
  EXPECT_EQ(sets.add(map_from(2, 2, 7)).size(), 1u);
  EXPECT_TRUE(sets.add(map_from(3, 1, 8)).empty());
  EXPECT_EQ(frames_of(sets.add(map_from(3, 2, 8))), std::vector<std::uint64_t>{8});
  EXPECT_TRUE(sets.take_drops().empty());
}

// The stamps of slow or badly synchronised cameras. Only the writer shows a restart.
TEST(FrameSetAssembler, MapsOfAnyStampsAreCombined) {
  for (const std::int64_t apart_ns : {3'000'000'000, -3'000'000'000}) {
    FrameSetAssembler sets(rig_of(2));
    std::uint64_t complete = 0;
    for (std::uint64_t frame = 0; frame < 50; ++frame) {
      CameraMap first = map_of(0, frame), second = map_of(1, frame);
      second.capture_stamp_ns += apart_ns;
      EXPECT_TRUE(sets.add(first).empty());
      for (const FrameSet& set : sets.add(second)) {
        ++complete;
        EXPECT_EQ(set.skew_ns, std::abs(apart_ns + 10));
      }
    }
    EXPECT_EQ(complete, 50u);
    EXPECT_TRUE(sets.take_drops().empty());
  }
}

// With `lost_camera: drop` or `wait`.
TEST(FrameSetAssembler, NoSetIsCompleteWithoutALostCameraThatIsNeeded) {
  FrameSetAssembler sets(rig_of(3), {"c0"});
  sets.add(map_of(0, 0));
  sets.add(map_of(2, 0));
  EXPECT_EQ(sets.add(map_of(1, 0)).size(), 1u);
  for (std::uint64_t frame = 1; frame <= 100; ++frame) {
    EXPECT_TRUE(sets.add(map_of(0, frame)).empty());
    EXPECT_TRUE(sets.add(map_of(2, frame)).empty());
    EXPECT_EQ(sets.lost_cameras(), frame < FrameSetAssembler::kLostAfterFrames
                                       ? std::vector<std::string>{}
                                       : std::vector<std::string>{"c1"});
  }
  EXPECT_EQ(sets.add(map_of(1, 100)).size(), 1u);
  EXPECT_TRUE(sets.lost_cameras().empty());
  EXPECT_EQ(sets.take_drops(), (std::map<std::string, std::uint64_t>{{"incomplete_set", 99}}));
}

TEST(FrameSetAssembler, LostCameraRejoins) {
  FrameSetAssembler sets(rig_of(3), {"c0", "c1"});
  const auto add_others = [&](std::uint64_t frame) {
    sets.add(map_of(2, frame));
    return sets.add(map_of(0, frame));
  };
  sets.add(map_of(1, 0));
  EXPECT_EQ(add_others(0).size(), 1u);
  // Frames of the other cameras until this one is lost: more than the 8 that a reader holds.
  constexpr std::uint64_t kLostAfterFrames = 15;
  std::uint64_t frame = 1;
  while (add_others(frame).empty()) ASSERT_LE(++frame, 100u);
  EXPECT_EQ(frame, kLostAfterFrames);
  const auto without = add_others(frame + 1);
  ASSERT_EQ(without.size(), 1u);
  EXPECT_EQ(without[0].lost_cameras, std::vector<std::string>{"c1"});
  EXPECT_EQ(without[0].silhouettes.size(), 2u);
  EXPECT_EQ(without[0].cameras, (std::vector<std::string>{"c0", "c2"}));
  sets.add(map_of(1, frame + 2));
  const auto with = add_others(frame + 2);
  ASSERT_EQ(with.size(), 1u);
  EXPECT_EQ(with[0].silhouettes.size(), 3u);
}

// One camera alone bounds no hull.
TEST(FrameSetAssembler, NoSetOfOneCameraIsComplete) {
  FrameSetAssembler sets(rig_of(2), {"c0", "c1"});
  for (std::uint64_t frame = 0; frame < 40; ++frame)
    EXPECT_TRUE(sets.add(map_of(0, frame)).empty());
  FrameSetAssembler of_one(rig_of(1), {"c0"});
  EXPECT_EQ(of_one.add(map_of(0, 0)).size(), 1u) << "the rig has no other";
}

// A repeated map is no further frame of the others.
TEST(FrameSetAssembler, RepeatedMapsDoNotLoseACamera) {
  FrameSetAssembler sets(rig_of(2));
  for (std::uint64_t i = 0; i < 2 * FrameSetAssembler::kLostAfterFrames; ++i)
    EXPECT_TRUE(sets.add(map_of(0, 5)).empty());
  const auto complete = sets.add(map_of(1, 5));
  ASSERT_EQ(complete.size(), 1u);
  EXPECT_EQ(complete[0].silhouettes.size(), 2u);
}

// A late reader takes the maps camera by camera, and pacing skips frame numbers. Neither makes a
// camera lost.
TEST(FrameSetAssembler, SequentialReadsDoNotLoseCameras) {
  FrameSetAssembler sets(rig_of(3));
  std::vector<std::uint64_t> complete;
  for (std::size_t camera = 0; camera < 3; ++camera)
    for (const std::uint64_t frame : {0, 40, 80, 120, 160})
      for (const FrameSet& set : sets.add(map_of(camera, frame))) {
        complete.push_back(set.frame);
        EXPECT_EQ(set.silhouettes.size(), 3u);
      }
  EXPECT_EQ(complete, (std::vector<std::uint64_t>{0, 40, 80, 120, 160}));
  EXPECT_TRUE(sets.take_drops().empty());
}

TEST(FrameSetAssembler, IsBoundedWhenACameraIsSilent) {
  FrameSetAssembler sets(rig_of(2));
  std::uint64_t dropped = 0;
  for (std::uint64_t frame = 0; frame < FrameSetAssembler::kLostAfterFrames; ++frame)
    sets.add(map_of(0, frame));
  for (const auto& [reason, n] : sets.take_drops()) dropped += n;
  EXPECT_EQ(dropped, FrameSetAssembler::kLostAfterFrames - FrameSetAssembler::kMaxIncompleteSets);
}

// A set with both maps of a closed frame would be a second set of this frame.
TEST(FrameSetAssembler, MapsOfReturnedAndDisplacedFramesAreLate) {
  FrameSetAssembler sets(rig_of(2));
  sets.add(map_of(0, 20));
  ASSERT_EQ(sets.add(map_of(1, 20)).size(), 1u);
  for (const std::uint64_t closed : {20, 19}) {
    EXPECT_TRUE(sets.add(map_of(0, closed)).empty());
    EXPECT_TRUE(sets.add(map_of(1, closed)).empty());
    EXPECT_EQ(sets.take_drops(), (std::map<std::string, std::uint64_t>{{"late_map", 1}})) << closed;
  }
  const std::uint64_t displaced = 21;
  // Incomplete sets that are kept: more than the 8 samples that a reader holds.
  constexpr std::uint64_t kSets = 12;
  for (std::uint64_t i = 0; i <= kSets; ++i) {
    EXPECT_TRUE(sets.take_drops().empty()) << i;
    sets.add(map_of(0, displaced + i));
  }
  EXPECT_EQ(sets.take_drops(), (std::map<std::string, std::uint64_t>{{"incomplete_set", 1}}));
  EXPECT_TRUE(sets.add(map_of(0, displaced)).empty());
  EXPECT_TRUE(sets.add(map_of(1, displaced)).empty());
  EXPECT_TRUE(sets.take_drops().empty()) << "the frame counts once";
}

// Otherwise a peer's maps with frame numbers near 2^64 would displace all others for ever.
TEST(FrameSetAssembler, WrongFrameNumbersDoNotKeepSetsFromCompleting) {
  FrameSetAssembler sets(rig_of(2));
  for (std::uint64_t frame = 1; frame < 100; ++frame) {
    for (const std::uint64_t wrong : {UINT64_MAX - 2 * frame, UINT64_MAX - 1000 + 2 * frame}) {
      CameraMap peer = map_of(0, frame);
      peer.frame = wrong;
      EXPECT_TRUE(sets.add(peer).empty());
    }
    EXPECT_TRUE(sets.add(map_of(0, frame)).empty()) << frame;
    EXPECT_EQ(frames_of(sets.add(map_of(1, frame))), std::vector<std::uint64_t>{frame});
  }
}

// A complete set with a wrong number makes the true maps late, until kMaxContradictions of them
// contradict it, whatever its stamp.
TEST(FrameSetAssembler, RecoversFromACompleteSetWithAWrongNumber) {
  for (const std::int64_t stamp_ns : {std::int64_t(0), INT64_MIN, INT64_MAX}) {
    FrameSetAssembler sets(rig_of(1));
    CameraMap peer = map_of(0, 1);
    peer.frame = UINT64_MAX;
    peer.capture_stamp_ns = stamp_ns;
    EXPECT_EQ(sets.add(peer).size(), 1u);
    std::uint64_t frame = 2;
    while (sets.add(map_of(0, frame++)).empty())
      ASSERT_LE(frame, 2u + RestartDetector::kMaxContradictions);
    for (int i = 0; i < 10; ++i) EXPECT_EQ(sets.add(map_of(0, frame++)).size(), 1u);
  }
}

// The wrong frame comes after a true one, with an older stamp, so that the true ones agree with the
// newest frame.
TEST(FrameSetAssembler, RecoversFromALaterSetWithAWrongNumber) {
  FrameSetAssembler sets(rig_of(1));
  const auto true_map = [](std::uint64_t frame) {
    CameraMap map = map_of(0, frame);
    map.capture_stamp_ns += 1'000'000'000;
    return map;
  };
  EXPECT_EQ(sets.add(true_map(0)).size(), 1u);
  CameraMap peer = map_of(0, 1);
  peer.frame = 1'000'000;
  EXPECT_EQ(sets.add(peer).size(), 1u);
  std::uint64_t frame = 1;
  while (sets.add(true_map(frame++)).empty())
    ASSERT_LE(frame, 2u + RestartDetector::kMaxContradictions);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(sets.add(true_map(frame++)).size(), 1u);
}

// Late maps of the process before do not close the frames of the new one.
TEST(FrameSetAssembler, ALateHighFrameOfTheProcessBeforeIsDropped) {
  FrameSetAssembler sets(rig_of(1));
  EXPECT_EQ(sets.add(map_from(1, 0, 5000)).size(), 1u);
  EXPECT_EQ(sets.add(map_from(2, 0, 0)).size(), 1u);
  EXPECT_TRUE(sets.add(map_from(1, 0, 5001)).empty());
  EXPECT_EQ(sets.add(map_from(2, 0, 1)).size(), 1u);
  EXPECT_EQ(sets.take_drops(), (std::map<std::string, std::uint64_t>{{"other_writer", 1}}));
}

// No set is returned of the first process, and its numbers are higher.
TEST(FrameSetAssembler, ARestartWithoutAReturnedSetForgetsTheFramesBeforeIt) {
  FrameSetAssembler sets(rig_of(2));
  for (std::uint64_t frame = 0; frame < 14; ++frame) sets.add(map_from(1, 0, 10 * frame));
  sets.take_drops();
  EXPECT_TRUE(sets.add(map_from(2, 0, 0)).empty());
  EXPECT_EQ(frames_of(sets.add(map_from(2, 1, 0))), std::vector<std::uint64_t>{0})
      << "its number was displaced before";
}

TEST(FrameSetAssembler, FollowsRestartedCapture) {
  for (const std::uint64_t before : {3, 5000}) {
    FrameSetAssembler sets(rig_of(1));
    EXPECT_EQ(sets.add(map_from(1, 0, before)).size(), 1u);
    for (const std::uint64_t frame : {0, 1})
      EXPECT_EQ(sets.add(map_from(2, 0, frame)).size(), 1u) << before;
    EXPECT_TRUE(sets.add(map_from(1, 0, 0)).empty()) << "of the process before";
  }
}

// The maps before the restart would otherwise displace or complete sets after it, and the cameras
// would be lost that had no map of the larger frame numbers.
TEST(FrameSetAssembler, ARestartForgetsTheFramesBeforeIt) {
  FrameSetAssembler sets(rig_of(2));
  for (const std::size_t camera : {0, 1}) sets.add(map_from(1, camera, 999));
  for (std::uint64_t frame = 1000; frame < 1003; ++frame) sets.add(map_from(1, 0, frame));
  EXPECT_TRUE(sets.take_drops().empty());
  EXPECT_TRUE(sets.add(map_from(2, 0, 0)).empty());
  EXPECT_EQ(sets.take_drops(), (std::map<std::string, std::uint64_t>{{"incomplete_set", 3}}));
  EXPECT_EQ(sets.add(map_from(2, 1, 0)).size(), 1u);
  EXPECT_TRUE(sets.add(map_from(2, 1, 1002)).empty()) << "its other map was of the run before";
  EXPECT_TRUE(sets.take_drops().empty()) << "counts the maps of the run before once";
}

TEST(FrameSetAssembler, ARestartCountsFramesForLostCamerasFromItsFirstFrame) {
  FrameSetAssembler sets(rig_of(3), {"c1"});
  for (const std::size_t camera : {0, 1}) sets.add(map_from(1, camera, 5000));
  EXPECT_EQ(sets.add(map_from(1, 2, 5000)).size(), 1u);
  std::uint64_t frame = 0;
  const auto add_others = [&] {
    sets.add(map_from(2, 0, frame));
    return sets.add(map_from(2, 2, frame));
  };
  while (add_others().empty()) ASSERT_LE(++frame, 100u);
  EXPECT_EQ(frame, FrameSetAssembler::kLostAfterFrames);
}

TEST(FrameSetAssembler, AfterAResetEarlierFramesAndStampsAreNew) {
  FrameSetAssembler sets(rig_of(2));
  sets.add(map_of(0, 5000));
  EXPECT_EQ(sets.add(map_of(1, 5000)).size(), 1u);
  sets.add(map_of(0, 5001));
  sets.reset();
  EXPECT_EQ(sets.take_drops(), (std::map<std::string, std::uint64_t>{{"incomplete_set", 1}}));
  // Camera 1 is a frame behind. A restart would drop the open set.
  EXPECT_TRUE(sets.add(map_of(0, 10)).empty());
  for (std::uint64_t frame = 11; frame < 40; ++frame) {
    EXPECT_TRUE(sets.add(map_of(0, frame)).empty());
    EXPECT_EQ(sets.add(map_of(1, frame - 1)).size(), 1u);
  }
  EXPECT_TRUE(sets.take_drops().empty());
}

}  // namespace
}  // namespace fivepipe::frames
