#include "recon_node/reconstruction_pipe.h"

#include <algorithm>
#include <deque>
#include <map>
#include <optional>

#include "common/clock/realtime.h"
#include "common/messages/view_messages.h"
#include "common/node/frame_set_reader.h"
#include "common/node/frame_trace.h"
#include "common/node/replay_watch.h"
#include "common/frames/tile_shares.h"
#include "recon_node/messages.h"

namespace fivepipe {
namespace {

// Poses and colours are kept for so many frames: more than can be in flight.
constexpr std::size_t kFramesKept = 16;
// Frame sets that wait for their head pose.
constexpr std::size_t kMaxWaiting = 4;

template <class Value>
void keep_newest(std::map<std::uint64_t, Value>& by_frame) {
  while (by_frame.size() > kFramesKept) by_frame.erase(by_frame.begin());
}

class ReconstructionPipe {
 public:
  ReconstructionPipe(NodeContext& node, HullBackend backend)
      : node_(node),
        viewer_(node.deployment.viewer.name),
        config_(decided(config_of<ReconConfig>(node), backend)),
        reconstructor_(config_, node.deployment.rig.volume_m),
        sets_(node.bus, node.deployment.rig, node.status),
        view_infos_(node.bus.reader<topics::ViewInfo>()),
        poses_(node.bus.reader<topics::HeadPose>()),
        colours_(node.bus.reader<topics::ObjectColour>()),
        replay_(node.bus),
        traces_(node.bus, node.status, node.node.name),
        tiles_(node.bus.writer<topics::HullTile>()),
        costs_(node.bus.writer<topics::TileCosts>()) {}

  void run() {
    while (running()) {
      node_.bus.wait(kMaxWait);
      // capture_node sends pose and colour before the maps: taken after them, they are there.
      if (replay_.update()) start_anew();
      for (FrameSet& set : sets_.take()) waiting_.push_back(std::move(set));
      take_view();
      take_colours();
      reconstruct_those_with_a_pose();
    }
  }

 private:
  static ReconConfig decided(ReconConfig config, HullBackend backend) {
    config.backend = backend;
    return config;
  }

  void take_view() {
    for (const auto& sample : view_infos_.take()) {
      if (!sample.valid() || viewer_ != sample->viewer) continue;
      if (const auto geometry = view_geometry_from(*sample); const BadMessage* bad = std::get_if<BadMessage>(&geometry))
        node_.status.drop(bad->why);
      else
        geometry_ = std::get<ViewGeometry>(geometry);
    }
    for (const auto& sample : poses_.take()) {
      if (!sample.valid() || viewer_ != sample->viewer) continue;
      if (const auto pose = head_pose_from(*sample); const BadMessage* bad = std::get_if<BadMessage>(&pose))
        node_.status.drop(bad->why);
      else
        take(std::get<FramePose>(pose));
    }
    keep_newest(pose_of_frame_);
  }

  void start_anew() {
    sets_.start_anew();
    waiting_.clear();
    pose_of_frame_.clear();
    colours_of_frame_.clear();
    order_ = {};
  }

  void take(const FramePose& pose) {
    if (order_.starts_anew(pose.frame, pose.capture_stamp_ns)) {
      pose_of_frame_.clear();
      colours_of_frame_.clear();
    }
    pose_of_frame_[pose.frame] = pose;
  }

  void take_colours() {
    for (const auto& sample : colours_.take()) {
      if (!sample.valid()) continue;
      auto colour = colour_from(*sample, node_.deployment.rig);
      if (const BadMessage* bad = std::get_if<BadMessage>(&colour)) {
        node_.status.drop(bad->why);
        continue;
      }
      CameraColour& received = std::get<CameraColour>(colour);
      colours_of_frame_[received.frame].push_back(std::move(received));
    }
    keep_newest(colours_of_frame_);
  }

  // This node's of a frame.
  std::vector<Tile> own_tiles(const FramePose& pose, const Pinhole& view) {
    std::vector<Tile> tiles = tiles_of(view.width_px, view.height_px, config_.tile_columns, config_.tile_rows);
    if (config_.shares == 1) return tiles;  // whoever shared when it was recorded
    std::vector<std::uint8_t> owners = pose.tile_owners;
    const auto known = [&](int owner) { return owner < config_.shares; };
    if (owners.size() != tiles.size() || !std::all_of(owners.begin(), owners.end(), known)) {
      if (!owners.empty()) node_.status.drop("bad_tile_owners");
      owners = tiles_by_turns(config_.tile_columns, config_.tile_rows, config_.shares);
    }
    std::erase_if(tiles, [&](const Tile& tile) { return owners[std::size_t(tile.index)] != config_.share; });
    return tiles;
  }

  // Of this frame, and not of one of the same number before capture_node was started anew.
  std::vector<ColourRegion> colours_of(const FrameSet& set) {
    std::vector<ColourRegion> colours;
    for (CameraColour& colour : colours_of_frame_[set.frame])
      if (std::abs(colour.capture_stamp_ns - set.capture_stamp_ns) < FrameOrder::kRestartTakes_ns) colours.push_back(std::move(colour.colour));
    return colours;
  }

  // A pose that was overtaken by the maps is on its way, unless that of a later frame is here.
  void reconstruct_those_with_a_pose() {
    const auto has_pose = [&](const FrameSet& set) { return geometry_ && pose_of_frame_.contains(set.frame); };
    while (!waiting_.empty()) {
      const FrameSet& set = waiting_.front();
      if (has_pose(set))
        reconstruct(set, pose_of_frame_.at(set.frame));
      else if (waiting_.size() > kMaxWaiting || std::any_of(waiting_.begin(), waiting_.end(), has_pose))
        node_.status.drop(geometry_ ? "no_head_pose" : "no_view_info");
      else
        return;
      waiting_.pop_front();
    }
  }

  void reconstruct(const FrameSet& set, const FramePose& pose) {
    const View view{{geometry_->recon, pose.eye_from_world}, geometry_->near_m, geometry_->far_m};
    const TileFrame frame{viewer_, set.frame, set.capture_stamp_ns, view, config_.tile_columns * config_.tile_rows, set.empty_cameras};
    const std::vector<Tile> tiles = own_tiles(pose, view.camera.pinhole);
    FrameSteps steps;
    const InputTimes inputs{set.first_received_ns, set.last_received_ns};
    if (tiles.empty()) return traces_.handled(set.frame, set.capture_stamp_ns, inputs, std::move(steps));
    const std::vector<ColourRegion> colours = colours_of(set);
    // Colour is for who draws: nobody reads tiles, nobody gets colour.
    const bool want_colour = tiles_.readers() > 0 && !colours.empty();
    steps.begin("reconstruct");
    std::vector<ReconTile> made = reconstructor_.reconstruct(set.silhouettes, view, tiles, colours, want_colour);
    const bool is_seen = std::any_of(made.begin(), made.end(), [](const ReconTile& tile) { return !tile.covered.empty(); });
    if (is_seen && tiles_.readers() > 0 && colours.empty()) node_.status.count("frames_without_colour");
    steps.begin("write_tiles");
    if (costs_.readers() > 0) costs_.write(costs_message(frame, config_.share, made).message());
    for (ReconTile& tile : made) tiles_.write(tile_message(frame, std::move(tile)).message());
    if (replay_.replaying())
      node_.status.latency("arrival_to_tiles", 1e-9 * double(now_realtime_ns() - inputs.first_ns));
    else
      node_.status.latency("capture_to_tiles", 1e-9 * double(now_realtime_ns() - set.capture_stamp_ns));
    traces_.handled(set.frame, set.capture_stamp_ns, inputs, std::move(steps));
    colours_of_frame_.erase(colours_of_frame_.begin(), colours_of_frame_.upper_bound(set.frame));
  }

  NodeContext& node_;
  const std::string viewer_;
  const ReconConfig config_;
  Reconstructor reconstructor_;
  FrameSetReader sets_;
  Reader<topics::ViewInfo> view_infos_;
  Reader<topics::HeadPose> poses_;
  Reader<topics::ObjectColour> colours_;
  ReplayWatch replay_;
  FrameTracer traces_;
  Writer<topics::HullTile> tiles_;
  Writer<topics::TileCosts> costs_;
  std::deque<FrameSet> waiting_;  // for their poses
  std::optional<ViewGeometry> geometry_;
  FrameOrder order_;
  std::map<std::uint64_t, FramePose> pose_of_frame_;
  std::map<std::uint64_t, std::vector<CameraColour>> colours_of_frame_;
};

}  // namespace

void run_reconstruction_pipe(NodeContext& node, HullBackend backend) { ReconstructionPipe(node, backend).run(); }

}  // namespace fivepipe
