// Drives a real recon_node by crafted messages and compares its tiles with the exact reference.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "common/base/realtime.h"
#include "common/config/deployment.h"
#include "common/config/views.h"
#include "common/hull/cpu/has_hull.h"
#include "common/hull/oracle/reference.h"
#include "common/pipeline/frames/frame_set_assembler.h"
#include "common/pipeline/messages/camera_messages.h"
#include "common/pipeline/messages/view_messages.h"
#include "common/pipeline/node/status_names.h"
#include "tests/support/sanitizer.h"
#include "tests/support/scripted/capture.h"

namespace fivepipe::test {
namespace {

using namespace std::chrono_literals;
using TileSet = std::set<int>;
using Owners = std::vector<std::uint8_t>;

constexpr double kNear_m = 0.05, kFar_m = 3;
// Error of a depth in float: that of the hull's backends.
constexpr double kDepthError = 2e-6;

const std::string kTwoWorkers = R"(
  - {name: recon_a, program: recon_node, worker: 0, workers: 2, backend: cpu, tile_columns: 2,
     tile_rows: 2}
  - {name: recon_b, program: recon_node, worker: 1, workers: 2, backend: cpu, tile_columns: 2,
     tile_rows: 2}
)";

struct Tile {
  std::string viewer;
  int tile, tiles;
  std::uint64_t frame;
  std::int64_t capture_stamp_ns;
  Eigen::Isometry3d eye_from_world;
  geometry::Pinhole recon;
  hull::PixelRect rect, covered;
  std::vector<float> depth_m;
  std::vector<std::uint8_t> bgr;
  std::vector<std::string> empty_cameras;
};
Tile copied(const bus::Sample<bus::topics::HullTile>& sample) {
  const auto depth = messages::span_of(sample->depth_m);
  const auto bgr = messages::span_of(sample->bgr);
  Tile tile{sample->viewer,
            sample->tile,
            sample->tiles,
            sample->frame,
            sample->capture_stamp_ns,
            messages::from_wire(sample->eye_from_world).value(),
            messages::from_wire(sample->recon),
            messages::from_wire(sample->rect),
            messages::from_wire(sample->covered),
            {depth.begin(), depth.end()},
            {bgr.begin(), bgr.end()},
            {}};
  for (const auto& camera : messages::span_of(sample->empty_cameras))
    tile.empty_cameras.emplace_back(camera);
  return tile;
}

struct Costs {
  std::string viewer;
  int worker;
  std::uint64_t frame;
  std::int64_t capture_stamp_ns;
  TileSet tiles;
  std::vector<float> cost_ms;
};
Costs copied_costs(const bus::Sample<bus::topics::TileCosts>& sample) {
  const auto tiles = messages::span_of(sample->tiles);
  const auto costs = messages::span_of(sample->cost_ms);
  return {sample->viewer,
          sample->worker,
          sample->frame,
          sample->capture_stamp_ns,
          {tiles.begin(), tiles.end()},
          {costs.begin(), costs.end()}};
}

// The first element of this frame, or the end.
auto find_frame(const auto& list, std::uint64_t frame) {
  return std::find_if(list.begin(), list.end(),
                      [&](const auto& element) { return element.frame == frame; });
}

class ReconNode : public ScriptedCapture {
 protected:
  bus::Writer<bus::topics::ViewInfo> views_ = bus_.writer<bus::topics::ViewInfo>();
  bus::Writer<bus::topics::HeadPose> poses_ = bus_.writer<bus::topics::HeadPose>();
  bus::Writer<bus::topics::ObjectColour> colours_ = bus_.writer<bus::topics::ObjectColour>();
  Collected<bus::topics::HullTile, Tile> tiles_{bus_, copied};
  Collected<bus::topics::TileCosts, Costs> costs_{bus_, copied_costs};
  std::int64_t first_sent_ns_ = 0;

  // Starts recon_a of a deployment with these nodes. Unless `bare`, sends the ViewInfo and a frame,
  // and waits for its tiles, so that both sides have found each other.
  void start_with(const std::string& nodes, bool bare = false, const std::string& light = "",
                  const std::string& viewer = "") {
    const std::string path = three_cameras(
        "name: far\n" + light +
            "objects:\n  - {name: box, box: {size_m: [1, 1, 1]}, position_m: [9, 9, 9]}\n",
        nodes, viewer);
    start("recon_node", "recon_a", path);
    wait_for_readers(infos_, views_, poses_, colours_, maps_);
    if (bare) return;
    deliver(views_, messages::view_info_message(deployment_.viewer));
    first_sent_ns_ = base::now_realtime_ns();
    send_frame(0, {});
    ASSERT_TRUE(holds([&] { return !tiles_.take().empty() && !traces().empty(); })) << said();
  }

  // The eye is elsewhere in every frame.
  virtual Eigen::Isometry3d eye_of(std::uint64_t frame) const {
    return geometry::look_at({0.1 * std::sin(double(frame)), -0.8, 0.05 * double(frame % 5)},
                             {0, 0, 0});
  }
  void send_pose(std::uint64_t frame, Owners owners, std::int64_t later_ns = 0) {
    send_pose(frame, std::move(owners), later_ns, eye_of(frame));
  }
  void send_pose(std::uint64_t frame, Owners owners, std::int64_t later_ns,
                 const Eigen::Isometry3d& eye_from_world) {
    fivepipe_v1_HeadPose pose{};
    messages::set_text(pose.viewer, deployment_.viewer.name);
    pose.frame = frame;
    pose.capture_stamp_ns = stamp_of(frame) + later_ns;
    pose.eye_from_world = messages::to_wire(eye_from_world);
    messages::borrow(pose.tile_owners, owners);
    deliver(poses_, pose);
  }
  // The object has one colour in every image.
  void send_colours(std::uint64_t frame, const Bgr& bgr, std::int64_t later_ns = 0) {
    std::size_t camera = 0;
    for (const hull::Silhouette& silhouette : silhouettes_of(frame)) {
      hull::ColourRegion region{
          silhouette.camera, silhouette.pixels, silhouette.pixels.bounds(), {}};
      for (std::size_t i = 0; i < region.region.area_px(); ++i)
        region.bgr.insert(region.bgr.end(), bgr.begin(), bgr.end());
      deliver(colours_, messages::colour_message(deployment_.rig.cameras[camera++].name, frame,
                                                 stamp_of(frame) + later_ns, region)
                            .message());
    }
  }
  void send_frame(std::uint64_t frame, Owners owners, std::int64_t later_ns = 0) {
    send_pose(frame, std::move(owners), later_ns);
    send_maps(frame, later_ns);
  }
  // Sends a message that the node drops, and waits until it has counted it: the node has then taken
  // all messages of this topic and of those before it in its loop (maps, poses, colours).
  void wait_until_taken() {
    fivepipe_v1_ObjectColour unknown{};
    messages::set_text(unknown.camera, "unknown");
    const std::uint64_t before = drops_of(report(), "bad_colour");
    deliver(colours_, unknown);
    ASSERT_TRUE(holds([&] { return drops_of(report(), "bad_colour") > before; })) << said();
  }

  // DDS may deliver the trace and the costs of a frame before its tiles, so this waits for the
  // tiles that the costs name.
  bool has_handled(std::uint64_t frame) {
    return holds([&] {
      tiles_.take();
      costs_.take();
      if (find_frame(traces(), frame) == traces().end()) return false;
      const auto costs = find_frame(costs_.all(), frame);
      return costs != costs_.all().end() && tiles_of(frame).size() >= costs->tiles.size();
    });
  }
  std::vector<Tile> tiles_of(std::uint64_t frame) const {
    std::vector<Tile> tiles;
    for (const Tile& tile : tiles_.all())
      if (tile.frame == frame) tiles.push_back(tile);
    return tiles;
  }
  static TileSet indices(const std::vector<Tile>& tiles) {
    TileSet indices;
    for (const Tile& tile : tiles) EXPECT_TRUE(indices.insert(tile.tile).second) << tile.tile;
    return indices;
  }
  // Sends the frame and returns the tiles that the node makes of it.
  TileSet made_of(std::uint64_t frame, const Owners& owners) {
    send_frame(frame, owners);
    EXPECT_TRUE(has_handled(frame)) << said();
    return indices(tiles_of(frame));
  }
  // The colour that all hits of the frame's tiles have; nullopt if the tiles have no colour.
  std::optional<Bgr> colour_of(std::uint64_t frame) const {
    std::optional<Bgr> colour;
    int hits = 0, coloured = 0;
    for (const Tile& tile : tiles_of(frame)) {
      hits += int(tile.depth_m.size());
      if (tile.bgr.empty()) continue;
      EXPECT_EQ(tile.bgr.size(), 3 * tile.depth_m.size());
      coloured += int(tile.depth_m.size());
      for (std::size_t i = 0; i < tile.depth_m.size(); ++i) {
        if (tile.depth_m[i] == hull::kNoHull) continue;
        const Bgr bgr{tile.bgr[3 * i], tile.bgr[3 * i + 1], tile.bgr[3 * i + 2]};
        if (!colour) colour = bgr;
        EXPECT_EQ(bgr, *colour);
      }
    }
    EXPECT_GT(hits, 0);
    EXPECT_TRUE(coloured == 0 || coloured == hits);
    return colour;
  }
  // Compares a tile with the exact reference, and its header with the frame's.
  void expect_exact(const Tile& tile, std::int64_t later_ns = 0) const {
    expect_exact(tile, later_ns, silhouettes_of(tile.frame));
  }
  void expect_exact(const Tile& tile, std::int64_t later_ns,
                    const std::vector<hull::Silhouette>& silhouettes) const {
    expect_exact(tile, later_ns, silhouettes, deployment_.viewer, eye_of(tile.frame));
  }
  // viewer: has the sizes and the clip planes of the deployment's.
  void expect_exact(const Tile& tile, std::int64_t later_ns,
                    const std::vector<hull::Silhouette>& silhouettes, const config::Viewer& viewer,
                    const Eigen::Isometry3d& eye_from_world) const {
    const geometry::Pinhole recon = config::recon_pinhole(viewer);
    EXPECT_EQ(tile.viewer, viewer.name);
    EXPECT_EQ(tile.tiles, 4);
    EXPECT_EQ(tile.capture_stamp_ns, stamp_of(tile.frame) + later_ns);
    // The wire has a quaternion.
    EXPECT_TRUE(tile.eye_from_world.isApprox(eye_from_world, 1e-12)) << tile.frame;
    EXPECT_EQ(tile.recon, recon);
    const int u0 = tile.tile % 2 * 12, v0 = tile.tile / 2 * 9;
    EXPECT_EQ(tile.rect, (hull::PixelRect{u0, v0, u0 + 12, v0 + 9}));
    const hull::View view{{recon, tile.eye_from_world}, kNear_m, kFar_m};
    for (int v = v0; v < v0 + 9; ++v)
      for (int u = u0; u < u0 + 12; ++u) {
        const hull::PixelRect& c = tile.covered;
        const bool is_covered = u >= c.u0_px && u < c.u1_px && v >= c.v0_px && v < c.v1_px;
        const double depth_m =
            is_covered
                ? double(tile.depth_m.at(std::size_t((v - c.v0_px) * c.width_px() + (u - c.u0_px))))
                : 0;
        const double expected_m =
            hull::reference_depth_m(silhouettes, view, u, v, deployment_.hull_rule).value_or(0);
        EXPECT_NEAR(depth_m, expected_m, kDepthError * expected_m)
            << "frame " << tile.frame << " at " << u << ' ' << v;
      }
  }
};

TEST_F(ReconNode, ReconstructsTheTilesThatTheHeadPoseAssigns) {
  start_with(kTwoWorkers);
  EXPECT_EQ(made_of(1, {1, 0, 0, 1}), (TileSet{1, 2}));
  EXPECT_EQ(made_of(2, {0, 0, 0, 0}), (TileSet{0, 1, 2, 3}));
  EXPECT_EQ(made_of(3, {1, 1, 1, 1}), TileSet{});
  EXPECT_EQ(made_of(4, {1, 1, 1, 0}), TileSet{3});
  EXPECT_EQ(made_of(5, {}), (TileSet{0, 3}));  // round-robin
  EXPECT_EQ(drops_of(report(), "bad_tile_owners"), 0u);
  EXPECT_EQ(made_of(6, {0, 0, 0}), (TileSet{0, 3}));
  EXPECT_EQ(made_of(7, {0, 0, 0, 2}), (TileSet{0, 3}));
  for (const Tile& tile : tiles_.all()) expect_exact(tile);
  ASSERT_TRUE(holds([&] { return costs_.take().size() >= 8; }));
  std::uint64_t frame = 0;
  for (const Costs& costs : costs_.all()) {
    EXPECT_EQ(costs.frame, frame);
    EXPECT_EQ(costs.capture_stamp_ns, stamp_of(frame));
    EXPECT_EQ(costs.viewer, "viewer");
    EXPECT_EQ(costs.worker, 0);
    EXPECT_EQ(costs.tiles, indices(tiles_of(frame)));
    EXPECT_EQ(costs.cost_ms.size(), costs.tiles.size());
    for (const float ms : costs.cost_ms) EXPECT_GE(ms, 0);
    ++frame;
  }
  const NodeReport report = ended();
  EXPECT_EQ(report.drops, (std::map<std::string, std::uint64_t>{{"bad_tile_owners", 2}}));
  EXPECT_EQ(report.counts.at(node::kFrameSetsComplete), 8u);
  EXPECT_EQ(report.frame, 7u);
}

// capture_node sees the end of its TileCosts and gives its tiles to others, but has sent frames
// before.
TEST_F(ReconNode, OneThatEndsReconstructsTheFramesThatItOwns) {
  start_with(kTwoWorkers);
  program_->signal(SIGTERM);
  ASSERT_TRUE(holds([&] { return costs_.writers() == 0; })) << said();
  send_frame(1, {0, 1, 1, 0});
  ASSERT_TRUE(holds([&] { return (tiles_.take(), tiles_of(1).size() == 2); })) << said();
  const auto start = std::chrono::steady_clock::now();
  send_frame(2, {1, 1, 1, 1});
  EXPECT_EQ(wait_for_end(), 0) << said();
  EXPECT_LT(std::chrono::steady_clock::now() - start, 450ms * kSlowdown);
  EXPECT_EQ(report().counts.at(node::kFrameSetsComplete), 3u);
}

TEST_F(ReconNode, OneThatEndsReconstructsItsWholeFramesToo) {
  std::string nodes = kTwoWorkers;
  for (const char* worker : {"worker: 0,", "worker: 1,"})
    nodes = replaced(nodes, worker, std::string("split: frames, ") + worker);
  start_with(nodes);
  program_->signal(SIGTERM);
  ASSERT_TRUE(holds([&] { return costs_.writers() == 0; })) << said();
  const Owners owner_of_frame{0, 0, 1, 0, 1, 1};  // from frame 1 on
  for (std::uint64_t frame = 1; frame < owner_of_frame.size(); ++frame)
    send_frame(frame, Owners(4, owner_of_frame[frame]));
  EXPECT_TRUE(holds([&] { return (tiles_.take(), tiles_of(3).size() == 4); })) << said();
  EXPECT_EQ(wait_for_end(), 0) << said();
}

TEST_F(ReconNode, OneThatEndsWithoutFramesDoesNotWaitForThem) {
  start_with(kTwoWorkers);
  const auto start = std::chrono::steady_clock::now();
  ended();
  EXPECT_LT(std::chrono::steady_clock::now() - start, 1s * kSlowdown);
}

// Camera `front` sees only a part of the ball.
struct ReconNodeBesideTheBall : ReconNode {
  std::vector<hull::Capsule> ball_of(std::uint64_t) const override {
    return {{{0.33, 0, 0}, {0.33, 0.05, 0}, 0.09}};
  }
  Eigen::Isometry3d eye_of(std::uint64_t) const override {
    return geometry::look_at({0.3, -0.8, 0}, {0.3, 0, 0});
  }
};

TEST_F(ReconNodeBesideTheBall, UsesTheHullRuleOfTheDeployment) {
  start_with(kTwoWorkers, false, "", "hull: {limits: seen, min_seen: 2}\n");
  EXPECT_EQ(made_of(1, {0, 0, 0, 0}), (TileSet{0, 1, 2, 3}));
  const std::vector<hull::Silhouette> silhouettes = silhouettes_of(1);
  const hull::View view{{config::recon_pinhole(deployment_.viewer), eye_of(1)}, kNear_m, kFar_m};
  int more = 0;
  for (int v = 0; v < 18; ++v)
    for (int u = 0; u < 24; ++u)
      more += hull::reference_depth_m(silhouettes, view, u, v, deployment_.hull_rule) !=
              hull::reference_depth_m(silhouettes, view, u, v);
  EXPECT_GT(more, 5);
  for (const Tile& tile : tiles_of(1)) expect_exact(tile);
}

// A spectator that reads tiles gets those of its own view, along its own path, also if it joins
// during the run. Nothing is reconstructed for one that is not there.
TEST_F(ReconNode, ReconstructsForSpectatorsThatAreThere) {
  const auto spectator = [](const std::string& name) {
    return "  - {name: " + name +
           ", program: render_node, viewer: {near_m: 0.05, far_m: 3, recon_size_px: [24, 18], "
           "path: [{t_s: 0, eye_m: [0.6, -0.6, 0.1], target_m: [0, 0, 0]}, "
           "{t_s: 2, eye_m: [0.7, -0.3, 0.2], target_m: [0, 0, 0]}]}}\n";
  };
  start_with(kTwoWorkers + spectator("audience") + spectator("absent"));
  EXPECT_EQ(made_of(1, {0, 0, 0, 0}), (TileSet{0, 1, 2, 3}));
  std::optional<bus::Bus> audience;
  audience.emplace(bus::BusOptions{domain_, "loopback", "audience", kScriptedDeployment});
  std::optional tiles(audience->reader<bus::topics::HullTile>());
  const auto of_spectator = [&](std::uint64_t frame) {
    std::vector<Tile> found;
    for (const Tile& tile : tiles_of(frame))
      if (tile.viewer != "viewer") found.push_back(tile);
    return found;
  };
  // Sends frames with colours until one has tiles of a spectator, or, with `want` false, none.
  std::uint64_t frame = 1;
  const auto frame_with = [&](bool want) {
    return holds([&] {
      ++frame;
      send_colours(frame, {10, 100, 200});
      send_frame(frame, {0, 0, 0, 1});
      EXPECT_TRUE(has_handled(frame));
      bus_.wait(std::chrono::milliseconds(20));
      tiles_.take();
      return want != of_spectator(frame).empty();
    });
  };
  ASSERT_TRUE(frame_with(true)) << said();
  const config::Viewer& viewer = *config::spectator_of(*config::find_node(deployment_, "audience"));
  const auto are_all_there = [&] { return (tiles_.take(), of_spectator(frame).size() == 3); };
  EXPECT_TRUE(holds(are_all_there));
  const std::vector<Tile> found = of_spectator(frame);
  EXPECT_EQ(indices(found), (TileSet{0, 1, 2}));
  for (const Tile& tile : found) {
    expect_exact(tile, 0, silhouettes_of(frame), viewer,
                 config::eye_from_world_at(viewer, double(frame) / deployment_.frame_rate_hz));
    EXPECT_EQ(tile.bgr.size(), 3 * tile.depth_m.size());
  }
  EXPECT_GT(std::ranges::count_if(found, [](const Tile& tile) { return !tile.bgr.empty(); }), 0);
  tiles.reset();
  audience.reset();
  EXPECT_TRUE(frame_with(false)) << said();
  for (const Tile& tile : tiles_.all()) EXPECT_NE(tile.viewer, "absent");
  // Costs are those of the viewer's tiles.
  for (const Costs& costs : costs_.all()) EXPECT_EQ(costs.viewer, "viewer");
  EXPECT_TRUE(ended().drops.empty());
}

// The owner of a viewer's tile also makes the light's tile with the same index, without colour.
TEST_F(ReconNode, ReconstructsTheTilesOfALightThatCastsShadows) {
  start_with(kTwoWorkers, false,
             "light_m: [0.5, -0.5, 1.5]\nshadows: {target_m: [0, 0, 0], fov_deg: 40, hull_size_px: "
             "[30, 20]}\n");
  send_colours(1, {10, 100, 200});
  send_frame(1, {1, 0, 0, 1});
  ASSERT_TRUE(has_handled(1) && holds([&] {
                tiles_.take();
                return tiles_of(1).size() == 4;
              }))
      << said();
  const config::HullView light = *config::light_view(deployment_.scene);
  const hull::View view{{light.recon, *light.fixed}, light.near_m, light.far_m};
  const std::vector<hull::Silhouette> silhouettes = silhouettes_of(1);
  std::map<std::string, TileSet> by_view;
  int hits = 0;
  for (const Tile& tile : tiles_of(1)) {
    by_view[tile.viewer].insert(std::uint16_t(tile.tile));
    if (tile.viewer != config::kLightView) continue;
    EXPECT_TRUE(tile.bgr.empty());
    EXPECT_EQ(tile.recon, light.recon);
    EXPECT_TRUE(tile.eye_from_world.isApprox(*light.fixed, 1e-12));
    const hull::PixelRect& c = tile.covered;
    for (int v = c.v0_px, i = 0; v < c.v1_px; ++v)
      for (int u = c.u0_px; u < c.u1_px; ++u, ++i) {
        const double expected_m = hull::reference_depth_m(silhouettes, view, u, v).value_or(0);
        EXPECT_NEAR(double(tile.depth_m[std::size_t(i)]), expected_m, kDepthError * expected_m);
        hits += expected_m > 0;
      }
  }
  EXPECT_GT(hits, 0);
  EXPECT_EQ(by_view["viewer"], (TileSet{1, 2}));
  EXPECT_EQ(by_view[config::kLightView], (TileSet{1, 2}));
  EXPECT_EQ(made_of(2, {1, 1, 1, 1}), TileSet{});
}

// The owner of a tile makes it in the light's view and in that of each eye, with the colours that
// the eye sees. One message has the costs of all.
TEST_F(ReconNode, ReconstructsTheTilesOfBothEyes) {
  start_with(kTwoWorkers, false,
             "light_m: [0.5, -0.5, 1.5]\nshadows: {target_m: [0, 0, 0], fov_deg: 40}\n",
             "  stereo: {eye_distance_m: 0.2}\n");
  send_colours(1, {10, 100, 200});
  send_frame(1, {1, 0, 0, 1});
  ASSERT_TRUE(has_handled(1) && holds([&] {
                tiles_.take();
                return tiles_of(1).size() == 6;
              }))
      << said();
  const std::vector<hull::Silhouette> silhouettes = silhouettes_of(1);
  std::map<std::string, TileSet> by_view;
  std::map<std::string, int> hits;
  for (const Tile& tile : tiles_of(1)) {
    by_view[tile.viewer].insert(tile.tile);
    if (tile.viewer == config::kLightView) continue;
    // The eyes are 10 cm to the left and to the right of the head.
    const double x_m = tile.viewer == "viewer/left" ? -0.1 : 0.1;
    const Eigen::Isometry3d eye = Eigen::Translation3d(-x_m, 0, 0) * eye_of(1);
    EXPECT_TRUE(tile.eye_from_world.isApprox(eye, 1e-12)) << tile.viewer;
    const hull::View view{{config::recon_pinhole(deployment_.viewer), eye}, kNear_m, kFar_m};
    const hull::PixelRect& c = tile.covered;
    for (int v = tile.rect.v0_px; v < tile.rect.v1_px; ++v)
      for (int u = tile.rect.u0_px; u < tile.rect.u1_px; ++u) {
        const bool is_covered = u >= c.u0_px && v >= c.v0_px && u < c.u1_px && v < c.v1_px;
        const std::size_t i =
            is_covered ? std::size_t((v - c.v0_px) * c.width_px() + u - c.u0_px) : 0;
        const double expected_m = hull::reference_depth_m(silhouettes, view, u, v).value_or(0);
        EXPECT_NEAR(is_covered ? double(tile.depth_m.at(i)) : 0, expected_m,
                    kDepthError * expected_m)
            << tile.viewer << " at " << u << ' ' << v;
        hits[tile.viewer] += expected_m > 0;
      }
    EXPECT_EQ(tile.bgr.size(), 3 * tile.depth_m.size()) << "each eye has colour";
  }
  const TileSet own{1, 2};
  EXPECT_EQ(by_view, (std::map<std::string, TileSet>{
                         {config::kLightView, own}, {"viewer/left", own}, {"viewer/right", own}}));
  EXPECT_GT(hits["viewer/left"], 5);
  EXPECT_GT(hits["viewer/right"], 5);
  ASSERT_TRUE(holds([&] {
    costs_.take();
    return find_frame(costs_.all(), 1) != costs_.all().end();
  }));
  EXPECT_EQ(find_frame(costs_.all(), 1)->viewer, "viewer") << "capture_node balances by this name";
  EXPECT_EQ(find_frame(costs_.all(), 1)->tiles, own);
}

class ReconNodeAlone : public ReconNode, public testing::WithParamInterface<const char*> {};
INSTANTIATE_TEST_SUITE_P(Backends, ReconNodeAlone, testing::Values("cpu", "gl", "auto"),
                         [](const auto& of) { return std::string(of.param); });

TEST_P(ReconNodeAlone, ReconstructsEveryTileWhateverTheRecordedOwners) {
  const std::string backend = GetParam();
  start_with("  - {name: recon_a, program: recon_node, backend: " + backend +
             ", tile_columns: 2, tile_rows: 2}\n");
  EXPECT_EQ(made_of(1, {1, 0, 1, 7}), (TileSet{0, 1, 2, 3}));
  for (const Tile& tile : tiles_.all()) expect_exact(tile);
  const NodeReport report = ended();
  EXPECT_EQ(drops_of(report, "bad_tile_owners"), 0u);
  EXPECT_EQ(report.gl_renderer.empty(), backend != "gl") << "auto is cpu";
}

// DDS reports the end of a writer as a sample without data.
TEST_F(ReconNode, TheEndOfAWriterIsNoMessage) {
  start_with(kTwoWorkers, true);
  {
    auto views = bus_.writer<bus::topics::ViewInfo>();
    auto poses = bus_.writer<bus::topics::HeadPose>();
    auto colours = bus_.writer<bus::topics::ObjectColour>();
    wait_for_readers(views, poses, colours);
    std::swap(views, views_);
    std::swap(poses, poses_);
    std::swap(colours, colours_);
    deliver(views_, messages::view_info_message(deployment_.viewer));
    send_colours(1, {10, 100, 200});
    send_pose(1, {0, 0, 0, 0});
    std::swap(views, views_);
    std::swap(poses, poses_);
    std::swap(colours, colours_);
  }
  wait_until_taken();
  EXPECT_TRUE(reports_again(2));
  send_maps(1);
  ASSERT_TRUE(has_handled(1)) << said();
  EXPECT_EQ(colour_of(1), (Bgr{10, 100, 200}));
  for (const auto& [reason, count] : ended().drops)
    EXPECT_TRUE(reason.starts_with("bad_colour: unknown")) << reason << ' ' << count;
}

// The colours of each frame arrive before the maps of the frame before it.
TEST_F(ReconNode, ColoursTheHullByTheImagesOfTheSameFrame) {
  start_with(kTwoWorkers);
  send_colours(1, {10, 100, 200});
  for (std::uint64_t frame = 1; frame <= 5; ++frame) {
    send_colours(frame + 1, {std::uint8_t(10 * (frame + 1)), 100, 200});
    made_of(frame, {0, 0, 0, 0});
    EXPECT_EQ(colour_of(frame), (Bgr{std::uint8_t(10 * frame), 100, 200})) << frame;
  }
  const auto without = [&] {
    return report().counts.contains("frames_without_colour")
               ? report().counts.at("frames_without_colour")
               : 0;
  };
  EXPECT_TRUE(holds([&] { return without() == 1; }));  // frame 0
  // A frame without colours; one whose colours were captured long before its maps; one with two of
  // each camera.
  made_of(7, {0, 0, 0, 0});
  EXPECT_EQ(colour_of(7), std::nullopt);
  send_colours(8, {20, 30, 40}, -200'000'000);
  made_of(8, {0, 0, 0, 0});
  EXPECT_EQ(colour_of(8), (Bgr{20, 30, 40}));
  send_colours(9, {1, 2, 3}, -300'000'000);
  send_colours(9, {50, 60, 70}, 199'000'000);
  made_of(9, {0, 0, 0, 0});
  EXPECT_EQ(colour_of(9), (Bgr{50, 60, 70}));
  // Tiles without a hit need no colour.
  made_of(10, {1, 1, 1, 1});
  // The colours of frame 6, which was not reconstructed, are forgotten and repeat nothing.
  send_colours(6, {1, 2, 3});
  wait_until_taken();
  const NodeReport report = ended();
  EXPECT_EQ(report.counts.at("frames_without_colour"), 2u);
  // The colours of frame 9 that a second message of the same camera replaced, and the message of
  // wait_until_taken().
  EXPECT_FALSE(report.drops.empty());
  for (const auto& [reason, count] : report.drops)
    EXPECT_TRUE((reason.starts_with("repeated_colour: ") || reason.starts_with("bad_colour: ")) &&
                count == 1)
        << reason << ' ' << count;
}

// Messages of different topics may overtake each other.
TEST_F(ReconNode, AFrameWaitsForItsPoseUntilALaterOneHasOne) {
  start_with(kTwoWorkers, true);
  for (std::uint64_t frame = 1; frame <= 5; ++frame) send_frame(frame, {0, 0, 0, 0});
  // Four frames wait for the view; the first is dropped.
  ASSERT_TRUE(holds([&] { return report().drops.contains("no_view_info"); })) << said();
  EXPECT_TRUE(traces().empty());
  deliver(views_, messages::view_info_message(deployment_.viewer));
  ASSERT_TRUE(has_handled(5)) << said();
  EXPECT_EQ(traces().size(), 4u);
  send_maps(6);
  send_maps(7);
  wait_until_taken();
  EXPECT_EQ(traces().size(), 4u);
  send_pose(6, {0, 0, 0, 0});
  ASSERT_TRUE(has_handled(6)) << said();
  // Frame 7 still waits, and frame 8 has a pose.
  send_frame(8, {0, 0, 0, 0});
  ASSERT_TRUE(has_handled(8)) << said();
  EXPECT_TRUE(tiles_of(7).empty());
  for (const std::uint64_t frame : {2, 3, 4, 5, 6, 8}) EXPECT_EQ(tiles_of(frame).size(), 4u);
  for (const Tile& tile : tiles_.all()) expect_exact(tile);
  // More than four frames wait.
  for (std::uint64_t frame = 9; frame <= 14; ++frame) send_maps(frame);
  ASSERT_TRUE(holds([&] { return drops_of(report(), "no_head_pose") == 3; })) << said();
  for (std::uint64_t frame = 11; frame <= 14; ++frame) send_pose(frame, {0, 0, 0, 0});
  ASSERT_TRUE(has_handled(14)) << said();
  EXPECT_EQ(tiles_of(11).size(), 4u);
  const NodeReport report = ended();
  EXPECT_EQ(report.drops.at("no_view_info"), 1u);
  EXPECT_EQ(report.drops.at("no_head_pose"), 3u);
  EXPECT_EQ(drops_of(report, "incomplete_set") + drops_of(report, "late_map"), 0u);
}

TEST_F(ReconNode, DropsInvalidMessagesAndIgnoresOtherViewers) {
  start_with(kTwoWorkers);
  fivepipe_v1_ViewInfo view = messages::view_info_message(deployment_.viewer);
  view.near_m = 0;
  deliver(views_, view);
  messages::set_text(view.viewer, "another");
  deliver(views_, view);
  fivepipe_v1_HeadPose pose{};
  messages::set_text(pose.viewer, "viewer");
  pose.frame = 1;
  deliver(poses_, pose);  // the quaternion is 0
  messages::set_text(pose.viewer, "another");
  deliver(poses_, pose);
  messages::OutgoingMap map =
      messages::map_message("front", 1, stamp_of(1), silhouettes_of(1)[0].pixels);
  map.payload.pop_back();
  deliver(maps_, map.message());
  // Another calibration of one camera, until the right one arrives.
  fivepipe_v1_CameraInfo info = messages::camera_info_message(deployment_.rig.cameras[1]);
  info.pinhole.fx_px += 1;
  deliver(infos_, info);
  send_frame(1, {0, 0, 0, 0});
  ASSERT_TRUE(holds([&] { return report().diagnostics.contains("camera side"); })) << said();
  info.pinhole.fx_px -= 1;
  deliver(infos_, info);
  ASSERT_TRUE(holds([&] { return !report().diagnostics.contains("camera side"); })) << said();
  EXPECT_EQ(made_of(2, {0, 0, 0, 0}).size(), 4u);
  for (const Tile& tile : tiles_.all()) expect_exact(tile);
  const NodeReport report = ended();
  EXPECT_EQ(report.drops, (std::map<std::string, std::uint64_t>{
                              {"bad_view: viewer: not 0 < near < far", 1},
                              {"bad_head_pose: viewer: not finite or not a rotation", 1},
                              {"bad_map: front: payload truncated or undecodable", 1},
                              {"bad_map: side: published camera model differs from the rig", 1},
                              {"incomplete_set", 1}}));
}

TEST_F(ReconNode, NamesTheCamerasThatEmptyTheHull) {
  start_with(kTwoWorkers);
  send_pose(1, {0, 0, 0, 0});
  for (const config::RigCamera& camera : deployment_.rig.cameras)
    deliver(maps_, messages::map_message(camera.name, 1, stamp_of(1),
                                         camera.name == "side" ? hull::ObjectPixels(40, 30)
                                                               : silhouettes_of(1)[0].pixels)
                       .message());
  ASSERT_TRUE(has_handled(1)) << said();
  ASSERT_EQ(tiles_of(1).size(), 4u);
  for (const Tile& tile : tiles_of(1)) {
    EXPECT_EQ(tile.empty_cameras, std::vector<std::string>{"side"});
    EXPECT_EQ(tile.covered, hull::PixelRect{});
    EXPECT_TRUE(tile.depth_m.empty());
  }
  ASSERT_TRUE(holds([&] { return report().empty_cameras.contains("side"); })) << said();
  EXPECT_EQ(report().diagnostics.at("hull"), "empty: no object pixel in camera side");
  made_of(2, {0, 0, 0, 0});
  for (const Tile& tile : tiles_of(2)) EXPECT_TRUE(tile.empty_cameras.empty());
  const NodeReport report = ended();
  EXPECT_EQ(report.empty_cameras, (std::map<std::string, std::uint64_t>{{"side", 1}}));
  EXPECT_FALSE(report.diagnostics.contains("hull"));
  // An empty hull has no colour to miss: frames 0 and 2.
  EXPECT_EQ(report.counts.at("frames_without_colour"), 2u);
}

// The ball is elsewhere for each camera, as if their poses were exchanged.
TEST_F(ReconNode, SaysThatSilhouettesHaveNoCommonPoint) {
  start_with(kTwoWorkers);
  hull::ObjectPixels top(40, 30), bottom(40, 30);
  for (int v = 0; v < 4; ++v) {
    top.set_run(15, 25, v);
    bottom.set_run(15, 25, 29 - v);
  }
  std::uint64_t frame = 0;
  EXPECT_TRUE(holds([&] {
    send_pose(++frame, {0, 0, 0, 0});
    for (const config::RigCamera& camera : deployment_.rig.cameras)
      deliver(maps_, messages::map_message(camera.name, frame, stamp_of(frame),
                                           camera.name == "side" ? bottom : top)
                         .message());
    std::this_thread::sleep_for(100ms);
    const auto& diagnostics = report().diagnostics;
    return diagnostics.contains("silhouettes") &&
           diagnostics.at("silhouettes") == hull::kNoCommonPoint;
  })) << said();
  EXPECT_GE(frame, 10u) << "not after the first check";
  EXPECT_TRUE(holds([&] {
    send_frame(++frame, {});
    std::this_thread::sleep_for(100ms);
    return !report().diagnostics.contains("silhouettes");
  })) << said();
}

// Camera `side` sends nothing. Its capture_node decides whether frames go on without it.
struct ReconNodeWithASilentCamera : ReconNode {
  static constexpr std::uint64_t kFrames = frames::FrameSetAssembler::kLostAfterFrames + 1;
  void send_frames(const std::string& lost_camera) {
    start_with(kTwoWorkers + "  - {name: capture, program: capture_node, sources: synthetic, " +
               "lost_camera: " + lost_camera + "}\n");
    for (std::uint64_t frame = 1; frame <= kFrames; ++frame) {
      send_pose(frame, {0, 0, 0, 0});
      send_maps(frame, 0, "side");
      if (frame % 5 == 0) wait_until_taken();  // a reader holds 8
    }
    wait_until_taken();
  }
};

TEST_F(ReconNodeWithASilentCamera, GoesOnIfItsCaptureNodeDoes) {
  send_frames("continue");
  ASSERT_TRUE(has_handled(kFrames)) << said();
  std::vector<hull::Silhouette> others = silhouettes_of(kFrames);
  others.erase(others.begin() + 1);
  ASSERT_EQ(tiles_of(kFrames).size(), 4u);
  for (const Tile& tile : tiles_of(kFrames)) expect_exact(tile, 0, others);
  EXPECT_TRUE(holds([&] {
    return report().diagnostics.contains("lost cameras") &&
           report().diagnostics.at("lost cameras") == "side; the hull uses only the other cameras";
  })) << said();
}

TEST_F(ReconNodeWithASilentCamera, DropsItsFramesIfItsCaptureNodeDoes) {
  send_frames("drop");
  EXPECT_TRUE(holds([&] { return report().diagnostics.contains("lost cameras"); })) << said();
  tiles_.take();
  for (std::uint64_t frame = 1; frame <= kFrames; ++frame)
    EXPECT_TRUE(tiles_of(frame).empty()) << frame;
}

// A restarted capture_node has other writers, and counts from 0 again.
TEST_F(ReconNode, ARestartedCaptureReplacesThePosesOfItsPredecessor) {
  start_with(kTwoWorkers);
  constexpr std::int64_t kLater_ns = 5'000'000'000;
  for (const std::uint64_t frame : {20, 21, 22})
    send_pose(frame, {0, 0, 0, 0}, 0, geometry::look_at({0, -0.5, 0.5}, {0, 0, 0}));
  send_frame(19, {0, 0, 0, 0});
  ASSERT_TRUE(has_handled(19)) << said();
  poses_ = bus_.writer<bus::topics::HeadPose>();
  colours_ = bus_.writer<bus::topics::ObjectColour>();
  maps_ = bus_.writer<bus::topics::ObjectPixelMap>();
  wait_for_readers(poses_, colours_, maps_);
  send_frame(1, {0, 0, 0, 0}, kLater_ns);
  ASSERT_TRUE(has_handled(1)) << said();
  send_maps(21, kLater_ns);
  wait_until_taken();
  send_pose(21, {0, 0, 0, 0}, kLater_ns);
  ASSERT_TRUE(has_handled(21)) << said();
  ASSERT_EQ(tiles_of(21).size(), 4u);
  for (const std::uint64_t frame : {1, 21})
    for (const Tile& tile : tiles_of(frame)) expect_exact(tile, kLater_ns);
}

// What the node has received before the replay belongs to other frames of the same numbers.
TEST_F(ReconNode, AReplayDiscardsTheMessagesBeforeIt) {
  start_with(kTwoWorkers);
  const Eigen::Isometry3d before = geometry::look_at({0, -0.5, 0.5}, {0, 0, 0});
  made_of(100, {0, 0, 0, 0});
  send_pose(112, {0, 0, 0, 0}, 0, before);
  send_maps(110);  // waits for its pose
  send_colours(112, {9, 9, 9});
  deliver(
      maps_,
      messages::map_message("front", 111, stamp_of(111), silhouettes_of(111)[0].pixels).message());
  wait_until_taken();
  begin_replay(false);
  // Colours may arrive before the first pose of the replay.
  send_colours(1, {70, 80, 90}, 10'000'000'000);
  wait_until_taken();
  send_frame(1, {0, 0, 0, 0}, 10'000'000'000);
  ASSERT_TRUE(has_handled(1)) << said();
  EXPECT_EQ(colour_of(1), (Bgr{70, 80, 90}));
  begin_replay(false);
  send_pose(110, {0, 0, 0, 0});
  send_maps(112);
  wait_until_taken();
  send_pose(112, {0, 0, 0, 0});
  ASSERT_TRUE(has_handled(112)) << said();
  EXPECT_TRUE(tiles_of(110).empty());
  EXPECT_EQ(tiles_of(112).size(), 4u);
  EXPECT_EQ(colour_of(112), std::nullopt);
  for (const Tile& tile : tiles_of(112)) expect_exact(tile);
  EXPECT_EQ(drops_of(ended(), "late_map"), 0u);
}

// A busy node finds messages from before a replay together with the replay's own.
TEST_F(ReconNode, AReplayDiscardsThePosesAndColoursOnTheBus) {
  start_with(kTwoWorkers);
  begin_replay(true);
  at_once([&] {
    send_pose(1, {0, 0, 0, 0}, 0, geometry::look_at({0, -0.5, 0.5}, {0, 0, 0}));
    send_colours(1, {9, 9, 9});
    begin_replay(true);
    send_maps(1);
  });
  EXPECT_TRUE(reports_again()) << said();  // the frame waits for its pose
  send_pose(1, {0, 0, 0, 0});
  ASSERT_TRUE(has_handled(1)) << said();
  EXPECT_EQ(tiles_of(1).size(), 4u);
  for (const Tile& tile : tiles_of(1)) expect_exact(tile);
  EXPECT_EQ(colour_of(1), std::nullopt);
}

TEST_F(ReconNode, ReportsTheTimesOfEachFrame) {
  start_with(kTwoWorkers);
  const std::int64_t first_start_ns = start_ns_;
  start_ns_ = base::now_realtime_ns() - 40'000'000;  // the capture of frame 1 was 7 ms ago
  const std::int64_t sent_ns = base::now_realtime_ns();
  made_of(1, {0, 1, 1, 1});
  const auto took_ns = base::now_realtime_ns();
  made_of(2, {1, 1, 1, 1});
  ASSERT_EQ(traces().size(), 3u);
  const TracedFrame& trace = traces()[1];
  EXPECT_EQ(trace.node, "recon_a");
  EXPECT_EQ(trace.capture_stamp_ns, stamp_of(1));
  ASSERT_EQ(trace.steps.size(), 2u);
  EXPECT_EQ(trace.steps[0].name, "reconstruct");
  EXPECT_EQ(trace.steps[1].name, "write_tiles");
  const std::vector<std::int64_t> times{sent_ns,
                                        trace.first_input_ns,
                                        trace.last_input_ns,
                                        trace.steps[0].start_ns,
                                        trace.steps[0].end_ns,
                                        trace.steps[1].start_ns,
                                        trace.steps[1].end_ns,
                                        took_ns};
  EXPECT_TRUE(std::is_sorted(times.begin(), times.end())) << testing::PrintToString(times);
  EXPECT_TRUE(traces()[2].steps.empty());
  EXPECT_EQ(traces()[2].capture_stamp_ns, stamp_of(2));
  EXPECT_GE(traces()[2].last_input_ns, traces()[2].first_input_ns);
  EXPECT_GE(traces()[2].first_input_ns, took_ns);
  ASSERT_TRUE(holds([&] {
    return report().latencies.contains("capture_to_tiles") &&
           report().latencies.at("capture_to_tiles").count == 2;
  })) << said();  // frames 0 and 1
  const auto& latencies = report().latencies;
  EXPECT_GE(latencies.at("capture_to_tiles").max_ms,
            1e-6 * double(first_sent_ns_ - first_start_ns));
  EXPECT_LE(latencies.at("capture_to_tiles").max_ms, 1e-6 * double(took_ns - first_start_ns));
  EXPECT_FALSE(latencies.contains("arrival_to_tiles"));
  EXPECT_EQ(latencies.at("reconstruct").count, 2u);
  EXPECT_EQ(latencies.at("write_tiles").count, 2u);
  begin_replay(false);
  made_of(3, {0, 0, 0, 0});
  const NodeReport report = ended();
  EXPECT_EQ(report.latencies.at("capture_to_tiles").count, 2u);
  ASSERT_EQ(report.latencies.at("arrival_to_tiles").count, 1u);
  // From the first map to the end of the last tile, which follows the start of write_tiles.
  const TracedFrame& replayed = traces().back();
  const double latest_ms = report.latencies.at("arrival_to_tiles").max_ms;
  EXPECT_GE(latest_ms, 1e-6 * double(replayed.steps[1].start_ns - replayed.first_input_ns) - 0.01);
  EXPECT_LE(latest_ms, 1e-6 * double(replayed.steps[1].end_ns - replayed.first_input_ns) + 0.01);
}

}  // namespace
}  // namespace fivepipe::test
