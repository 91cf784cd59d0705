#include "render_node/views/tile_assembler.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <climits>
#include <limits>
#include <numeric>
#include <random>

namespace fivepipe::render {
namespace {

constexpr double kNear_m = 0.1, kFar_m = 4.0;
const geometry::Pinhole kRecon = geometry::pinhole_from_fov(32, 24, 1.0);

// A message with its payload: a view of 2 x 2 tiles of 16 x 12 pixels, each with hits in its
// central 8 x 4 pixels.
struct Message {
  std::vector<float> depth_m;
  std::vector<std::uint8_t> bgr;
  ReceivedTile tile;
  const ReceivedTile& get() {
    tile.depth_m = depth_m;
    tile.bgr = bgr;
    return tile;
  }
};

Message message(std::uint64_t frame, std::uint32_t index) {
  Message m;
  m.tile.frame = frame;
  m.tile.capture_stamp_ns = 1'000'000 + std::int64_t(frame) * 33'000'000;
  m.tile.tile = index;
  m.tile.tiles = 4;
  m.tile.eye_from_world = geometry::look_at({0, -1, double(frame) * 1e-3}, {0, 0, 0});
  m.tile.recon = kRecon;
  const int u = int(index % 2) * 16, v = int(index / 2) * 12;
  m.tile.rect = {u, v, u + 16, v + 12};
  m.tile.covered = {u + 4, v + 4, u + 12, v + 8};
  for (int i = 0; i < 32; ++i) {
    m.depth_m.push_back(0.5f + 0.01f * float(i) + float(index));
    for (int c = 0; c < 3; ++c) m.bgr.push_back(std::uint8_t(index * 60 + unsigned(i)));
  }
  return m;
}

TileAssembler sets() { return {kRecon, kNear_m, kFar_m}; }

// Adds a tile that must be valid. Returns the frame if the tile completes it.
std::optional<HullFrame> add(TileAssembler& sets, Message message) {
  AddedTile added = sets.add(message.get());
  if (const RefusedTile* refused = std::get_if<RefusedTile>(&added))
    ADD_FAILURE() << refused->reason;
  HullFrame* const hull = std::get_if<HullFrame>(&added);
  return hull ? std::optional(std::move(*hull)) : std::nullopt;
}
std::optional<HullFrame> add(TileAssembler& sets, std::uint64_t frame, std::uint32_t index) {
  return add(sets, message(frame, index));
}

// Adds a tile. Returns why the assembler refuses it; empty if it does not.
std::string why_refused(TileAssembler& sets, Message message) {
  const AddedTile added = sets.add(message.get());
  const RefusedTile* const refused = std::get_if<RefusedTile>(&added);
  return refused ? refused->reason : "";
}

TEST(TileAssembler, AssemblesTilesInAnyOrder) {
  std::array<std::uint32_t, 4> order = {0, 1, 2, 3};
  do {
    TileAssembler tiles = sets();
    std::optional<HullFrame> hull;
    for (std::size_t i = 0; i < 4; ++i) {
      ASSERT_FALSE(hull);
      Message m = message(7, order[i]);
      m.tile.received_ns = 50 + std::int64_t(i);
      hull = add(tiles, m);
    }
    ASSERT_TRUE(hull);
    EXPECT_EQ(hull->first_received_ns, 50);
    EXPECT_EQ(hull->last_received_ns, 53);
    EXPECT_EQ(hull->recon, kRecon);
    EXPECT_EQ(hull->frame, 7u);
    EXPECT_EQ(hull->capture_stamp_ns, message(7, 0).tile.capture_stamp_ns);
    EXPECT_TRUE(hull->eye_from_world.isApprox(message(7, 0).tile.eye_from_world));
    EXPECT_EQ(hull->covered, (hull::PixelRect{4, 4, 28, 20}));
    for (int v = 0; v < 24; ++v)
      for (int u = 0; u < 32; ++u) {
        const int index = v / 12 * 2 + u / 16, du = u % 16 - 4, dv = v % 12 - 4;
        const bool hit = du >= 0 && du < 8 && dv >= 0 && dv < 4;
        const std::size_t px = std::size_t(v) * 32 + std::size_t(u);
        ASSERT_EQ(hull->depth_m[px],
                  hit ? message(7, std::uint32_t(index)).depth_m[std::size_t(dv * 8 + du)]
                      : hull::kNoHull)
            << u << ' ' << v;
        for (std::size_t c = 0; c < 3; ++c)
          ASSERT_EQ(hull->bgr[3 * px + c], hit ? index * 60 + dv * 8 + du : 0) << u << ' ' << v;
      }
  } while (std::next_permutation(order.begin(), order.end()));
}

TEST(TileAssembler, ACompleteFrameDropsOlderOnesAndCountsThem) {
  TileAssembler tiles = sets();
  add(tiles, 1, 0);
  add(tiles, 2, 0);
  for (std::uint32_t i = 0; i < 3; ++i) add(tiles, 3, i);
  EXPECT_TRUE(add(tiles, 3, 3));
  EXPECT_EQ(tiles.counts().incomplete, 2u);
  EXPECT_EQ(tiles.open_frames(), 0u);
  EXPECT_FALSE(add(tiles, 2, 1));
  EXPECT_EQ(tiles.counts().late, 1u);
  EXPECT_FALSE(add(tiles, 3, 1));
  EXPECT_EQ(tiles.counts().duplicate, 1u);
}

TEST(TileAssembler, ByCaptureACompleteFrameKeepsOlderOnes) {
  TileAssembler tiles = sets();
  add(tiles, 1, 0);
  for (const std::uint64_t frame : {3, 2, 1})
    for (std::uint32_t i = frame == 1 ? 1 : 0; i < 4; ++i) {
      const AddedTile added = tiles.add(message(frame, i).get(), FrameOrder::capture);
      EXPECT_EQ(std::holds_alternative<HullFrame>(added), i == 3) << frame << ' ' << i;
    }
  EXPECT_EQ(tiles.counts().complete, 3u);
  EXPECT_EQ(tiles.counts().incomplete, 0u);
  for (const std::uint64_t frame : {1, 2, 3}) {
    const AddedTile again = tiles.add(message(frame, 0).get(), FrameOrder::capture);
    EXPECT_TRUE(std::holds_alternative<std::monostate>(again));
  }
  EXPECT_EQ(tiles.counts().late, 3u);
  EXPECT_EQ(tiles.open_frames(), 0u);
}

// A restarted capture_node counts from 0 again, with later stamps.
TEST(TileAssembler, ByCaptureItFollowsARestartedSource) {
  TileAssembler tiles = sets();
  const auto complete = [&](std::uint64_t frame, std::int64_t later_ns) {
    bool done = false;
    for (std::uint32_t i = 0; i < 4; ++i) {
      Message m = message(frame, i);
      m.tile.capture_stamp_ns += later_ns;
      done = std::holds_alternative<HullFrame>(tiles.add(m.get(), FrameOrder::capture));
    }
    return done;
  };
  for (const std::uint64_t frame : {0, 1, 3, 2}) EXPECT_TRUE(complete(frame, 0)) << frame;
  for (const std::uint64_t frame : {1, 0, 2}) EXPECT_TRUE(complete(frame, 1'000'000'000)) << frame;
  EXPECT_EQ(tiles.counts().restarts, 1u);
  EXPECT_EQ(tiles.counts().late, 0u);
}

TEST(TileAssembler, ANewerOpenFrameCompletesAfterAnOlderOne) {
  TileAssembler tiles = sets();
  for (std::uint32_t i = 0; i < 2; ++i) add(tiles, 5, i);
  for (std::uint32_t i = 0; i < 3; ++i) add(tiles, 4, i);
  EXPECT_TRUE(add(tiles, 4, 3));
  add(tiles, 5, 2);
  EXPECT_TRUE(add(tiles, 5, 3));
  EXPECT_EQ(tiles.counts().complete, 2u);
  EXPECT_EQ(tiles.counts().incomplete, 0u);
}

TEST(TileAssembler, OpenFramesAreBounded) {
  TileAssembler tiles = sets();
  for (std::uint64_t frame = 0; frame < 1000; ++frame) {
    EXPECT_FALSE(add(tiles, frame, 0));
    EXPECT_EQ(tiles.open_frames(), std::min<std::size_t>(frame + 1, 8));
  }
  EXPECT_EQ(tiles.counts().incomplete, 992u);
  EXPECT_FALSE(add(tiles, 991, 1));
  EXPECT_EQ(tiles.counts().late, 1u);
  EXPECT_EQ(tiles.counts().incomplete, 992u) << "the late tile displaces no frame";
}

TEST(TileAssembler, DuplicateTileOfRestartedNodeIsDropped) {
  TileAssembler tiles = sets();
  add(tiles, 1, 0);
  Message again = message(1, 0);
  again.depth_m[0] = 3.0f;
  EXPECT_FALSE(add(tiles, again));
  EXPECT_EQ(tiles.counts().duplicate, 1u);
  for (std::uint32_t i = 1; i < 3; ++i) add(tiles, 1, i);
  const auto hull = add(tiles, 1, 3);
  ASSERT_TRUE(hull);
  EXPECT_EQ(hull->depth_m[4 * 32 + 4], 0.5f);
}

TEST(TileAssembler, FollowsRestartedSource) {
  TileAssembler tiles = sets();
  for (std::uint32_t i = 0; i < 4; ++i) add(tiles, 1000, i);
  std::optional<HullFrame> hull;
  for (std::uint32_t i = 0; i < 4; ++i) {
    Message m = message(0, i);
    m.tile.capture_stamp_ns = message(1000, 0).tile.capture_stamp_ns + 5'000'000;
    hull = add(tiles, m);
  }
  EXPECT_TRUE(hull);
  EXPECT_EQ(tiles.counts().restarts, 1u);
  EXPECT_EQ(tiles.counts().late, 0u);
}

TEST(TileAssembler, AnEmptyHullCompletesAndListsItsEmptyCameras) {
  TileAssembler tiles = sets();
  std::optional<HullFrame> hull;
  for (std::uint32_t i = 0; i < 4; ++i) {
    Message m = message(1, i);
    m.tile.covered = {};
    m.depth_m.clear();
    m.bgr.clear();
    m.tile.empty_cameras = {"right", "left"};
    hull = add(tiles, m);
  }
  ASSERT_TRUE(hull);
  EXPECT_TRUE(hull->covered.empty());
  EXPECT_EQ(hull->empty_cameras, (std::vector<std::string>{"left", "right"}));
  EXPECT_EQ(std::count(hull->depth_m.begin(), hull->depth_m.end(), hull::kNoHull), 32 * 24);
}

TEST(TileAssembler, AFrameHasNoColourIfOneTileHasNone) {
  TileAssembler tiles = sets();
  std::optional<HullFrame> hull;
  for (std::uint32_t i = 0; i < 4; ++i) {
    Message m = message(1, i);
    if (i == 2) m.bgr.clear();
    hull = add(tiles, m);
  }
  ASSERT_TRUE(hull);
  EXPECT_TRUE(hull->bgr.empty());
}

// Otherwise a peer's tiles with a frame number near 2^64 would displace all others for ever.
TEST(TileAssembler, WrongFrameNumbersDoNotKeepFramesFromCompleting) {
  TileAssembler tiles = sets();
  for (std::uint64_t frame = 1; frame < 50; ++frame) {
    for (const std::uint64_t wrong : {UINT64_MAX - 2 * frame, UINT64_MAX - 1000 + 2 * frame}) {
      Message peer = message(frame, 1);
      peer.tile.frame = wrong;
      EXPECT_FALSE(add(tiles, peer));
    }
    for (std::uint32_t i = 0; i < 3; ++i) EXPECT_FALSE(add(tiles, frame, i)) << frame;
    EXPECT_TRUE(add(tiles, frame, 3)) << frame;
    EXPECT_LE(tiles.open_frames(), TileAssembler::kMaxOpenFrames);
  }
}

// A complete frame with a wrong number makes the true frames late, until kMaxLateFrames of them
// contradict it.
TEST(TileAssembler, RecoversFromACompleteFrameWithAWrongNumber) {
  TileAssembler tiles = sets();
  for (std::uint32_t i = 0; i < 4; ++i) {
    Message peer = message(1, i);
    peer.tile.frame = UINT64_MAX;
    peer.tile.capture_stamp_ns = INT64_MAX;
    EXPECT_EQ(add(tiles, peer).has_value(), i == 3);
  }
  std::uint64_t frame = 2;
  const auto completes = [&] {
    for (std::uint32_t i = 0; i < 3; ++i) add(tiles, frame, i);
    return add(tiles, frame++, 3).has_value();
  };
  std::uint32_t late_frames = 0;
  while (!completes()) ASSERT_LE(++late_frames, TileAssembler::kMaxLateFrames);
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(completes());
}

// The tiles of 16 frames in a row are late, whatever their number. A tile of a newer frame between
// them begins a new row.
TEST(TileAssembler, ResetsAfterSixteenLateFramesInARow) {
  TileAssembler tiles = sets();
  std::uint64_t complete = 1000;
  for (std::uint32_t i = 0; i < 4; ++i) add(tiles, complete, i);
  for (int row = 0; row < 2; ++row) {
    for (std::uint32_t tile = 0; tile < 16 * 4 - 1; ++tile)
      EXPECT_FALSE(add(tiles, 10 + tile / 4, tile % 4));
    if (row == 0) add(tiles, complete + 1, 0);
  }
  EXPECT_EQ(tiles.counts().late, 2 * 63u);
  EXPECT_EQ(tiles.counts().restarts, 0u);
  EXPECT_EQ(tiles.counts().incomplete, 0u);
  EXPECT_FALSE(add(tiles, 26, 0));
  EXPECT_EQ(tiles.counts().restarts, 1u);
  EXPECT_EQ(tiles.counts().late, 2 * 63u);
  EXPECT_EQ(tiles.counts().incomplete, 1u);  // the newer frame
  for (std::uint32_t i = 1; i < 4; ++i) EXPECT_EQ(add(tiles, 26, i).has_value(), i == 3);
}

TEST(TileAssembler, ResetDropsOpenFramesAndAcceptsAnyFrameNext) {
  TileAssembler tiles = sets();
  for (std::uint32_t i = 0; i < 4; ++i) add(tiles, 50, i);
  for (std::uint64_t frame = 51; frame < 62; ++frame) add(tiles, frame, 0);  // displaces 3
  EXPECT_EQ(tiles.counts().incomplete, 3u);
  tiles.reset();
  EXPECT_EQ(tiles.open_frames(), 0u);
  EXPECT_EQ(tiles.counts().incomplete, 11u);
  for (const std::uint64_t frame : {2, 51})
    for (std::uint32_t i = 0; i < 4; ++i) EXPECT_EQ(add(tiles, frame, i).has_value(), i == 3);
  EXPECT_EQ(tiles.counts().late, 0u);
  EXPECT_EQ(tiles.counts().restarts, 0u);
}

// Binaries of different compilers compute the pose with different roundings.
TEST(TileAssembler, PosesOfOneFrameMayDifferByAMicrometre) {
  const auto reason = [](double difference_m) {
    TileAssembler tiles = sets();
    add(tiles, 1, 0);
    Message m = message(1, 1);
    m.tile.eye_from_world.translation().y() -= difference_m;
    return why_refused(tiles, m);
  };
  EXPECT_EQ(reason(0.95e-6), "");
  EXPECT_EQ(reason(1.05e-6), "pose differs within the frame");
  EXPECT_EQ(reason(-1.05e-6), "pose differs within the frame");
}

TEST(TileAssembler, AViewHasAtMost4096Tiles) {
  for (const std::uint32_t count : {1u, 4096u, 4097u}) {
    TileAssembler tiles = sets();
    Message m = message(1, 0);
    m.tile.tiles = count;
    m.tile.tile = count - 1;
    EXPECT_EQ(why_refused(tiles, m), count == 1      ? "tiles leave gaps in the view"
                                     : count <= 4096 ? ""
                                                     : "bad tile number");
  }
}

TEST(TileAssembler, HitsMayFillTheirTileAndATileTheView) {
  TileAssembler tiles = sets();
  Message m = message(1, 0);
  m.tile.tiles = 1;
  m.tile.rect = m.tile.covered = {0, 0, 32, 24};
  m.depth_m.assign(32 * 24, 1.5f);
  m.bgr.clear();
  const auto hull = add(tiles, m);
  ASSERT_TRUE(hull);
  EXPECT_EQ(hull->depth_m, m.depth_m);
  EXPECT_TRUE(hull->bgr.empty());
}

TEST(TileAssembler, ARepeatedTileMustHaveTheSameRect) {
  TileAssembler tiles = sets();
  add(tiles, 1, 2);
  Message m = message(1, 2);
  m.tile.rect.u1_px -= 1;
  EXPECT_EQ(why_refused(tiles, m), "repeated tile with another rect");
  EXPECT_EQ(why_refused(tiles, message(1, 2)), "");
  EXPECT_EQ(tiles.counts().duplicate, 1u);
}

struct Refusal {
  const char* reason;
  void (*spoil)(Message&);
};
class TileAssemblerRejects : public testing::TestWithParam<Refusal> {};

// Tiles 0 to 2 of a frame have arrived. The assembler rejects the invalid tile 3 with its reason,
// and the valid tile 3 completes the frame.
TEST_P(TileAssemblerRejects, InvalidTilesWithTheirReason) {
  TileAssembler tiles = sets();
  for (std::uint32_t i = 0; i < 3; ++i) ASSERT_FALSE(add(tiles, 1, i));
  Message bad = message(1, 3);
  GetParam().spoil(bad);
  EXPECT_EQ(why_refused(tiles, bad), GetParam().reason);
  EXPECT_TRUE(add(tiles, 1, 3));
}

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
const Refusal kRefusals[] = {
    {"bad tile number", [](Message& m) { m.tile.tile = 4; }},
    {"bad tile number", [](Message& m) { m.tile.tiles = 0; }},
    {"bad tile number", [](Message& m) { m.tile.tiles = UINT32_MAX; }},
    {"number of tiles differs within the frame", [](Message& m) { m.tile.tiles = 6; }},
    {"pinhole of another view", [](Message& m) { m.tile.recon.fx_px += 1; }},
    {"pinhole of another view", [](Message& m) { m.tile.recon.width_px = INT_MAX; }},
    {"pinhole of another view",
     [](Message& m) { m.tile.recon.cx_px = std::numeric_limits<double>::quiet_NaN(); }},
    {"unusable pose",
     [](Message& m) {
       m.tile.eye_from_world.translation().x() = std::numeric_limits<double>::quiet_NaN();
     }},
    {"unusable pose", [](Message& m) { m.tile.eye_from_world.linear().col(0) *= -1; }},
    {"pose differs within the frame",
     [](Message& m) { m.tile.eye_from_world.translation().x() += 1e-3; }},
    {"capture stamp differs within the frame", [](Message& m) { m.tile.capture_stamp_ns += 1; }},
    {"rect outside the view", [](Message& m) { m.tile.rect.u1_px += 1; }},
    {"rect outside the view", [](Message& m) { m.tile.rect = {}; }},
    {"rect outside the view", [](Message& m) { m.tile.rect.u1_px = m.tile.rect.u0_px; }},
    {"rect outside the view", [](Message& m) { m.tile.rect.v1_px = m.tile.rect.v0_px; }},
    {"rect outside the view", [](Message& m) { m.tile.rect.u0_px = -1; }},
    {"rect outside the view", [](Message& m) { m.tile.rect.v0_px = -1; }},
    {"rect outside the view", [](Message& m) { m.tile.rect.v1_px += 1; }},
    {"rect outside the view",
     [](Message& m) {
       m.tile.rect = {INT_MIN, INT_MIN, INT_MAX, INT_MAX};
     }},
    {"rect overlaps another tile", [](Message& m) { m.tile.rect.u0_px -= 1; }},
    {"covered rect outside its tile", [](Message& m) { m.tile.covered.v0_px = 11; }},
    {"covered rect outside its tile", [](Message& m) { m.tile.covered.u0_px = 15; }},
    {"covered rect outside its tile", [](Message& m) { m.tile.covered.u1_px = 33; }},
    {"covered rect outside its tile", [](Message& m) { m.tile.covered.v1_px = 25; }},
    {"wrong number of depths", [](Message& m) { m.tile.covered.v1_px = m.tile.covered.v0_px; }},
    {"wrong number of depths", [](Message& m) { m.tile.covered.u1_px -= 1; }},
    {"covered rect outside its tile",
     [](Message& m) {
       m.tile.covered = {INT_MIN, 13, INT_MAX, 14};
     }},
    {"wrong number of depths", [](Message& m) { m.depth_m.pop_back(); }},
    {"wrong number of depths", [](Message& m) { m.depth_m.clear(); }},
    {"wrong number of depths",
     [](Message& m) {
       m.tile.covered = {INT_MAX, 0, INT_MIN, 1};
     }},
    {"wrong number of colours", [](Message& m) { m.bgr.pop_back(); }},
    {"depth not finite or outside near and far", [](Message& m) { m.depth_m[17] = kNaN; }},
    {"depth not finite or outside near and far",
     [](Message& m) { m.depth_m[0] = std::numeric_limits<float>::infinity(); }},
    {"depth not finite or outside near and far", [](Message& m) { m.depth_m[0] = -1; }},
    {"depth not finite or outside near and far", [](Message& m) { m.depth_m[0] = 0.05f; }},
    {"depth not finite or outside near and far", [](Message& m) { m.depth_m[0] = 4.01f; }},
};
INSTANTIATE_TEST_SUITE_P(HardCases, TileAssemblerRejects, testing::ValuesIn(kRefusals));

TEST(TileAssembler, AcceptsDepthAtNearAndFar) {
  TileAssembler tiles = sets();
  Message m = message(1, 0);
  m.depth_m.front() = float(kNear_m);
  m.depth_m.back() = float(kFar_m);
  EXPECT_EQ(why_refused(tiles, m), "");
}

TEST(TileAssembler, RejectsTilesWithGaps) {
  TileAssembler tiles = sets();
  for (std::uint32_t i = 0; i < 4; ++i) {
    Message m = message(1, i);
    if (i == 3) m.tile.rect.u1_px -= 1;
    EXPECT_EQ(why_refused(tiles, m), i == 3 ? "tiles leave gaps in the view" : "");
  }
  EXPECT_EQ(tiles.open_frames(), 0u);
}

// For tiles in random order, each tile is counted once, and the numbers of complete frames
// increase.
TEST(TileAssembler, EveryTileIsCountedOnce) {
  std::mt19937 random(5);
  TileAssembler tiles = sets();
  std::uint64_t accepted = 0, newest = 0;
  for (int i = 0; i < 4000; ++i) {
    const std::uint64_t frame = 1 + std::uint64_t(i) / 8 + random() % 4;
    const std::uint64_t refused_before = tiles.counts().late + tiles.counts().duplicate;
    const auto hull = add(tiles, frame, random() % 4);
    accepted += tiles.counts().late + tiles.counts().duplicate == refused_before;
    if (!hull) continue;
    EXPECT_GT(hull->frame, newest);
    newest = hull->frame;
  }
  EXPECT_EQ(accepted + tiles.counts().late + tiles.counts().duplicate, 4000u);
  EXPECT_GT(tiles.counts().complete, 50u);
}

}  // namespace
}  // namespace fivepipe::render
