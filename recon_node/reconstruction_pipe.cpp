#include "recon_node/reconstruction_pipe.h"

#include <algorithm>
#include <deque>
#include <optional>

#include "common/base/realtime.h"
#include "common/config/views.h"
#include "common/pipeline/frames/tile_balancer.h"
#include "common/pipeline/messages/view_messages.h"
#include "common/pipeline/node/frame_set_reader.h"
#include "common/pipeline/node/frame_trace.h"
#include "common/pipeline/node/replay_monitor.h"
#include "recon_node/frame_inputs.h"
#include "recon_node/messages.h"

namespace fivepipe::recon {
namespace {

// At most this many frame sets wait for their head poses.
constexpr std::size_t kMaxWaiting = 4;

class ReconstructionPipe {
 public:
  ReconstructionPipe(node::NodeContext& node, config::HullBackend backend)
      : node_(node),
        viewer_(node.deployment.viewer.name),
        light_(config::light_view(node.deployment.scene)),
        config_(decided(node::config_of<config::ReconConfig>(node), backend)),
        reconstructor_(config_, node.deployment.rig.volume_m),
        sets_(node.bus, node.deployment.rig, node.status),
        view_infos_(node.bus.reader<bus::topics::ViewInfo>()),
        poses_(node.bus.reader<bus::topics::HeadPose>()),
        colours_(node.bus.reader<bus::topics::ObjectColour>()),
        replay_(node.bus),
        traces_(node.bus, node.status, node.node.name),
        tiles_(node.bus.writer<bus::topics::HullTile>()),
        costs_(node.bus.writer<bus::topics::TileCosts>()) {}

  void run() {
    while (node::running()) {
      node_.bus.wait(node::kMaxWait);
      // capture_node sends pose and colour before the maps. Taking the maps first guarantees that
      // the poses and colours of all taken maps are available.
      if (replay_.update()) reset();
      for (frames::FrameSet& set : sets_.take()) waiting_.push_back(std::move(set));
      take_view();
      take_colours();
      reconstruct_frames_with_pose();
    }
  }

 private:
  static config::ReconConfig decided(config::ReconConfig config, config::HullBackend backend) {
    config.backend = backend;
    return config;
  }

  void take_view() {
    for (const auto& sample : view_infos_.take()) {
      if (!sample.valid() || viewer_ != sample->viewer) continue;
      if (const auto geometry = messages::view_geometry_from(*sample, node_.deployment.viewer);
          const messages::BadMessage* bad = std::get_if<messages::BadMessage>(&geometry))
        node_.status.drop_from(view_infos_.process(sample), *bad);
      else
        geometry_ = std::get<messages::ViewGeometry>(geometry);
    }
    for (const auto& sample : poses_.take()) {
      if (!sample.valid() || viewer_ != sample->viewer) continue;
      if (const auto pose = messages::head_pose_from(*sample);
          const messages::BadMessage* bad = std::get_if<messages::BadMessage>(&pose))
        node_.status.drop_from(poses_.process(sample), *bad);
      else
        inputs_.add(std::get<messages::FramePose>(pose));
    }
  }

  void reset() {
    sets_.reset();
    waiting_.clear();
    inputs_.reset();
  }

  void take_colours() {
    for (const auto& sample : colours_.take()) {
      if (!sample.valid()) continue;
      auto colour = messages::colour_from(*sample, node_.deployment.rig);
      if (const messages::BadMessage* bad = std::get_if<messages::BadMessage>(&colour)) {
        node_.status.drop_from(colours_.process(sample), *bad);
        continue;
      }
      if (!inputs_.add(std::get<messages::CameraColour>(std::move(colour))))
        node_.status.drop({"repeated_colour", sample->camera, ""});
    }
  }

  // Returns the tiles of a frame that this node reconstructs.
  std::vector<Tile> own_tiles(const messages::FramePose& pose, const geometry::Pinhole& view) {
    std::vector<Tile> tiles =
        tiles_of(view.width_px, view.height_px, config_.tile_columns, config_.tile_rows);
    // A single node reconstructs every tile, also in the replay of a recording of several nodes.
    if (config_.worker_count == 1) return tiles;
    std::vector<std::uint8_t> owners = pose.tile_owners;
    const auto known = [&](int owner) { return owner < config_.worker_count; };
    if (owners.size() != tiles.size() || !std::all_of(owners.begin(), owners.end(), known)) {
      if (!owners.empty()) node_.status.drop("bad_tile_owners");
      owners =
          frames::round_robin_tiles(config_.tile_columns, config_.tile_rows, config_.worker_count);
    }
    std::erase_if(tiles, [&](const Tile& tile) {
      return owners[std::size_t(tile.index)] != config_.worker_index;
    });
    return tiles;
  }

  // Reconstructs the waiting frames in order. A frame waits for its pose, because messages of
  // different topics may overtake each other. Drops it if the pose of a later frame has arrived or
  // more than kMaxWaiting frames wait.
  void reconstruct_frames_with_pose() {
    const auto has_pose = [&](const frames::FrameSet& set) {
      return geometry_ && inputs_.pose_of(set.frame);
    };
    while (!waiting_.empty()) {
      const frames::FrameSet& set = waiting_.front();
      if (has_pose(set))
        reconstruct(set, *inputs_.pose_of(set.frame));
      else if (waiting_.size() > kMaxWaiting ||
               std::any_of(waiting_.begin(), waiting_.end(), has_pose))
        node_.status.drop(geometry_ ? "no_head_pose" : "no_view_info");
      else
        return;
      waiting_.pop_front();
    }
  }

  // A view, and the tiles of it that this node reconstructs.
  struct OwnView {
    TileFrame frame;
    std::vector<Tile> tiles;
  };
  // The light's view comes before the viewer's, whose last tile completes the frame.
  std::vector<OwnView> own_views(const frames::FrameSet& set, const messages::FramePose& pose) {
    const auto frame_of = [&](const std::string& name, const hull::View& view) {
      return TileFrame{name,
                       set.frame,
                       set.capture_stamp_ns,
                       view,
                       config_.tile_columns * config_.tile_rows,
                       set.empty_cameras};
    };
    const hull::View view{
        {geometry_->recon, pose.eye_from_world}, geometry_->near_m, geometry_->far_m};
    const std::vector<Tile> tiles = own_tiles(pose, view.camera.pinhole);
    std::vector<OwnView> views;
    if (light_) {
      const hull::View from_light{{light_->recon, *light_->fixed}, light_->near_m, light_->far_m};
      std::vector<Tile> light_tiles = tiles_of(light_->recon.width_px, light_->recon.height_px,
                                               config_.tile_columns, config_.tile_rows);
      // A tile of the light's view has the owner of the viewer's tile with the same index.
      std::erase_if(light_tiles, [&](const Tile& tile) {
        return std::none_of(tiles.begin(), tiles.end(),
                            [&](const Tile& own) { return own.index == tile.index; });
      });
      views.push_back({frame_of(light_->name, from_light), std::move(light_tiles)});
    }
    views.push_back({frame_of(viewer_, view), tiles});
    return views;
  }

  void reconstruct(const frames::FrameSet& set, const messages::FramePose& pose) {
    const std::vector<OwnView> views = own_views(set, pose);
    node::FrameSteps steps;
    const node::InputTimes times{set.first_received_ns, set.last_received_ns};
    if (views.back().tiles.empty())
      return traces_.handled(set.frame, set.capture_stamp_ns, times, std::move(steps));
    const std::vector<hull::ColourRegion> colours =
        inputs_.take_colours(set.frame, set.capture_stamp_ns);
    // Only readers of tiles need colour; skip it if there are none. A light needs none.
    const bool want_colour = tiles_.readers() > 0 && !colours.empty();
    std::vector<Reconstructor::ViewTiles> requests;
    for (const OwnView& of : views)
      requests.push_back({of.frame.view, of.tiles, want_colour && &of == &views.back()});
    steps.begin("reconstruct");
    std::vector<std::vector<ReconTile>> made =
        reconstructor_.reconstruct(set.silhouettes, requests, colours);
    // The owner of a tile makes it in every view.
    for (std::size_t i = 0; light_ && i < made.back().size(); ++i)
      made.back()[i].cost_s += made.front()[i].cost_s;
    const bool is_seen = std::any_of(made.back().begin(), made.back().end(),
                                     [](const ReconTile& tile) { return !tile.covered.empty(); });
    if (is_seen && tiles_.readers() > 0 && colours.empty())
      node_.status.count("frames_without_colour");
    steps.begin("write_tiles");
    if (costs_.readers() > 0)
      costs_.write(costs_message(views.back().frame, config_.worker_index, made.back()).message());
    for (std::size_t i = 0; i < views.size(); ++i)
      for (ReconTile& tile : made[i])
        tiles_.write(tile_message(views[i].frame, std::move(tile)).message());
    if (replay_.replaying())
      node_.status.latency("arrival_to_tiles",
                           1e-9 * double(base::now_realtime_ns() - times.first_ns));
    else
      node_.status.latency("capture_to_tiles",
                           1e-9 * double(base::now_realtime_ns() - set.capture_stamp_ns));
    traces_.handled(set.frame, set.capture_stamp_ns, times, std::move(steps));
    inputs_.drop_colours_up_to(set.frame);
  }

  node::NodeContext& node_;
  const std::string viewer_;
  const std::optional<config::HullView> light_;  // present if the scene has shadows
  const config::ReconConfig config_;
  Reconstructor reconstructor_;
  node::FrameSetReader sets_;
  bus::Reader<bus::topics::ViewInfo> view_infos_;
  bus::Reader<bus::topics::HeadPose> poses_;
  bus::Reader<bus::topics::ObjectColour> colours_;
  node::ReplayMonitor replay_;
  node::FrameTracer traces_;
  bus::Writer<bus::topics::HullTile> tiles_;
  bus::Writer<bus::topics::TileCosts> costs_;
  std::deque<frames::FrameSet> waiting_;  // frame sets that wait for their poses
  std::optional<messages::ViewGeometry> geometry_;
  FrameInputs inputs_;
};

}  // namespace

void run_reconstruction_pipe(node::NodeContext& node, config::HullBackend backend) {
  ReconstructionPipe(node, backend).run();
}

}  // namespace fivepipe::recon
