#include "recon_node/reconstruction_pipe.h"

#include <algorithm>
#include <chrono>
#include <deque>
#include <limits>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include "common/base/realtime.h"
#include "common/config/views.h"
#include "common/hull/cpu/has_hull.h"
#include "common/pipeline/frames/tile_balancer.h"
#include "common/pipeline/messages/view_messages.h"
#include "common/pipeline/node/frame_set_reader.h"
#include "common/pipeline/node/frame_trace.h"
#include "common/pipeline/node/replay_monitor.h"
#include "recon_node/frame_inputs.h"
#include "recon_node/messages.h"
#include "recon_node/spectators.h"

namespace fivepipe::recon {
namespace {

// At most this many frame sets wait for their head poses.
constexpr std::size_t kMaxWaiting = 4;
// Of the checks for a common point of the silhouettes, once per second: a hand may leave the
// volume.
constexpr int kMinChecks = 3;
// Time in which a node that ends reconstructs the frames that are its own; less than a supervisor
// waits for its end.
constexpr std::chrono::milliseconds kMaxLeave{400};
constexpr std::chrono::seconds kSpectatorPollPeriod{1};

class ReconstructionPipe {
 public:
  ReconstructionPipe(node::NodeContext& node, config::HullBackend backend)
      : node_(node),
        viewer_(node.deployment.viewer.name),
        views_(config::hull_views(node.deployment)),
        spectators_(node.deployment),
        config_(decided(node::config_of<config::ReconConfig>(node), backend)),
        reconstructor_(config_, node.deployment.rig.volume_m),
        sets_(node.bus, node.deployment.rig, node.status, node::frame_set_options(node.deployment)),
        view_infos_(node.bus.reader<bus::topics::ViewInfo>()),
        poses_(node.bus.reader<bus::topics::HeadPose>()),
        colours_(node.bus.reader<bus::topics::ObjectColour>()),
        replay_(node.bus, node.status, [this] { reset(); }),
        traces_(node.bus, node.status, node.node.name),
        tiles_(node.bus.writer<bus::topics::HullTile>()),
        costs_(node.bus.writer<bus::topics::TileCosts>()) {}

  void run() {
    while (node::running()) step();
    leave();
  }

 private:
  void step() {
    node_.bus.wait(node::kMaxWait);
    // capture_node sends pose and colour before the maps. Taking the maps first guarantees that the
    // poses and colours of all taken maps are available.
    for (frames::FrameSet& set : sets_.take(replay_)) waiting_.push_back(std::move(set));
    take_view();
    take_colours();
    reconstruct_frames_with_pose();
  }

  // Returns how many frames can have been assigned before capture_node sees that this node ends.
  int max_frames_in_flight() const {
    const config::Node* const capture = config::first_capture_node(node_.deployment);
    const int most = capture ? std::get<config::CaptureConfig>(capture->config).max_frames_in_flight
                             : config::CaptureConfig{}.max_frames_in_flight;
    return most > 0 ? most : std::numeric_limits<int>::max();
  }

  // Reports to capture_node by the end of the writer that this node ends, and reconstructs the
  // frames that it has assigned before. With `split: frames` the others own the frames in between.
  void leave() {
    if (config_.worker_count == 1) return;
    costs_.reset();
    frames_ = frames_without_tiles_ = 0;
    const int until = config_.split == config::ReconSplit::frames ? config_.worker_count : 1;
    const auto end = std::chrono::steady_clock::now() + kMaxLeave;
    while (frames_without_tiles_ < until && frames_ < max_frames_in_flight() &&
           poses_.writers() > 0 && std::chrono::steady_clock::now() < end)
      step();
  }

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
        set_geometry(std::get<messages::ViewGeometry>(geometry));
    }
    replay_.take(poses_, [&](const auto& sample) {
      if (viewer_ != sample->viewer) return;
      if (const auto pose = messages::head_pose_from(*sample);
          const messages::BadMessage* bad = std::get_if<messages::BadMessage>(&pose))
        node_.status.drop_from(poses_.process(sample), *bad);
      else if (!inputs_.add(std::get<messages::FramePose>(pose), sample.writer()))
        node_.status.drop({"other_writer", sample->viewer, ""});
    });
  }

  void set_geometry(const messages::ViewGeometry& geometry) {
    has_view_info_ = true;
    for (config::HullView& view : views_) {
      if (view.fixed) continue;
      view.recon = geometry.recon;
      view.near_m = geometry.near_m;
      view.far_m = geometry.far_m;
    }
  }

  void reset() {
    sets_.reset();
    waiting_.clear();
    inputs_.reset();
  }

  void take_colours() {
    replay_.take(colours_, [&](const auto& sample) {
      auto colour = messages::colour_from(*sample, node_.deployment.rig);
      if (const messages::BadMessage* bad = std::get_if<messages::BadMessage>(&colour)) {
        node_.status.drop_from(colours_.process(sample), *bad);
        return;
      }
      if (const char* reason =
              inputs_.add(std::get<messages::CameraColour>(std::move(colour)), sample.writer()))
        node_.status.drop({reason, sample->camera, ""});
    });
  }

  // Returns the owner of each tile. Tiles with the same index have the same owner in every view.
  std::vector<std::uint8_t> owners_of(const messages::FramePose& pose) {
    const std::size_t tiles = std::size_t(config_.tile_columns * config_.tile_rows);
    // A single node reconstructs every tile, also in the replay of a recording of several nodes.
    if (config_.worker_count == 1)
      return std::vector<std::uint8_t>(tiles, std::uint8_t(config_.worker_index));
    const std::vector<std::uint8_t>& owners = pose.tile_owners;
    const auto known = [&](int owner) { return owner < config_.worker_count; };
    if (owners.size() == tiles && std::all_of(owners.begin(), owners.end(), known)) return owners;
    if (!owners.empty()) node_.status.drop("bad_tile_owners");
    return frames::round_robin_tiles(config_.tile_columns, config_.tile_rows,
                                     frames::all_workers(config_.worker_count));
  }

  // Returns the tiles of a view that this node reconstructs.
  std::vector<Tile> own_tiles(const geometry::Pinhole& view,
                              const std::vector<std::uint8_t>& owners) const {
    std::vector<Tile> tiles =
        tiles_of(view.width_px, view.height_px, config_.tile_columns, config_.tile_rows);
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
      return has_view_info_ && inputs_.pose_of(set.frame);
    };
    while (!waiting_.empty()) {
      const frames::FrameSet& set = waiting_.front();
      if (has_pose(set))
        reconstruct(set, *inputs_.pose_of(set.frame));
      else if (waiting_.size() > kMaxWaiting ||
               std::any_of(waiting_.begin(), waiting_.end(), has_pose))
        node_.status.drop(has_view_info_ ? "no_head_pose" : "no_view_info");
      else
        return;
      waiting_.pop_front();
    }
  }

  // Returns the tiles of each view that this node reconstructs. A light needs no colour.
  std::vector<Reconstructor::ViewTiles> own_views(const messages::FramePose& pose,
                                                  const std::vector<std::uint8_t>& owners) const {
    std::vector<Reconstructor::ViewTiles> own;
    for (const config::HullView& view : views_)
      own.push_back({{{view.recon, config::eye_from_world(view, pose.eye_from_world)},
                      view.near_m,
                      view.far_m},
                     own_tiles(view.recon, owners),
                     !view.fixed});
    return own;
  }

  // Returns true if an eye sees the hull.
  bool is_seen(const std::vector<std::vector<ReconTile>>& made) const {
    for (std::size_t i = 0; i < views_.size(); ++i)
      if (!views_[i].fixed &&
          std::any_of(made[i].begin(), made[i].end(),
                      [](const ReconTile& tile) { return !tile.covered.empty(); }))
        return true;
    return false;
  }

  void reconstruct(const frames::FrameSet& set, const messages::FramePose& pose) {
    const std::vector<std::uint8_t> owners = owners_of(pose);
    std::vector<Reconstructor::ViewTiles> views = own_views(pose, owners);
    node::FrameSteps steps;
    const node::InputTimes times{set.first_received_ns, set.last_received_ns};
    if (views.front().tiles.empty()) {
      answer(set, views.back().view, {});
      traces_.handled(set.frame, set.capture_stamp_ns, times, std::move(steps));
      return check_common_point(set);
    }
    const std::vector<hull::ColourRegion> colours = inputs_.take_colours(set.frame);
    // Only readers of tiles need colour; skip it if there are none.
    for (Reconstructor::ViewTiles& view : views)
      view.want_colour &= tiles_.readers() > 0 && !colours.empty();
    steps.begin("reconstruct");
    std::vector<std::vector<ReconTile>> made =
        reconstructor_.reconstruct({set.silhouettes, set.outlines, colours}, views);
    // The tiles with one index in all views have one owner, so their costs add up.
    for (std::size_t view = 0; view + 1 < made.size(); ++view)
      for (std::size_t i = 0; i < made.back().size(); ++i)
        made.back()[i].cost_s += made[view][i].cost_s;
    if (is_seen(made) && tiles_.readers() > 0 && colours.empty())
      node_.status.count("frames_without_colour");
    steps.begin("write_tiles");
    answer(set, views.back().view, made.back());
    for (std::size_t i = 0; i < views.size(); ++i)
      write_tiles(set, views_[i].name, views[i].view, std::move(made[i]));
    if (replay_.replaying())
      node_.status.latency("arrival_to_tiles",
                           1e-9 * double(base::now_realtime_ns() - times.first_ns));
    else
      node_.status.latency_since_capture("capture_to_tiles", set.capture_stamp_ns,
                                         base::now_realtime_ns());
    reconstruct_for_spectators(set, owners, colours, steps);
    traces_.handled(set.frame, set.capture_stamp_ns, times, std::move(steps));
    inputs_.drop_colours_up_to(set.frame);
    check_common_point(set);
  }

  // After the viewer's tiles, so that spectators do not add to the viewer's latency. Their cost
  // does not count for the balance of the tiles.
  void reconstruct_for_spectators(const frames::FrameSet& set,
                                  const std::vector<std::uint8_t>& owners,
                                  std::span<const hull::ColourRegion> colours,
                                  node::FrameSteps& steps) {
    find_spectators();
    const std::vector<PosedView> posed = spectators_.views_at(set.frame);
    if (posed.empty()) return;
    steps.begin("spectators");
    std::vector<Reconstructor::ViewTiles> views;
    for (const PosedView& view : posed)
      views.push_back({{{view.of.recon, view.eye_from_world}, view.of.near_m, view.of.far_m},
                       own_tiles(view.of.recon, owners),
                       !colours.empty()});
    std::vector<std::vector<ReconTile>> made =
        reconstructor_.reconstruct_further({set.silhouettes, set.outlines, colours}, views);
    for (std::size_t i = 0; i < views.size(); ++i)
      write_tiles(set, posed[i].of.name, views[i].view, std::move(made[i]));
  }

  // At once if the number of readers of tiles has changed, else once per kSpectatorPollPeriod.
  void find_spectators() {
    const auto now = std::chrono::steady_clock::now();
    const int readers = tiles_.readers();
    if (spectators_.empty() || (readers == readers_ && now < next_spectator_poll_)) return;
    readers_ = readers;
    next_spectator_poll_ = now + kSpectatorPollPeriod;
    std::set<std::string> nodes;
    for (const bus::EndpointDescription& endpoint : node_.bus.endpoints())
      if (!endpoint.writes && endpoint.topic == bus::topics::HullTile::name &&
          endpoint.deployment == node_.deployment.name)
        nodes.insert(endpoint.participant);
    spectators_.set_readers(nodes);
  }

  void write_tiles(const frames::FrameSet& set, const std::string& name, const hull::View& view,
                   std::vector<ReconTile> tiles) {
    const TileFrame frame = frame_of(set, name, view);
    for (ReconTile& tile : tiles) tiles_.write(tile_message(frame, std::move(tile)).message());
  }

  // Reports to capture_node that this node is there, and what its tiles of the frame have cost.
  void answer(const frames::FrameSet& set, const hull::View& view,
              std::span<const ReconTile> tiles) {
    ++frames_;
    frames_without_tiles_ = tiles.empty() ? frames_without_tiles_ + 1 : 0;
    if (costs_ && costs_->readers() > 0)
      costs_->write(
          costs_message(frame_of(set, viewer_, view), config_.worker_index, tiles).message());
  }

  // Poses that do not fit leave a picture without objects and without any other message.
  void check_common_point(const frames::FrameSet& set) {
    const auto now = std::chrono::steady_clock::now();
    const hull::HullRule& rule = node_.deployment.hull_rule;
    if (config_.worker_index != 0 || rule.limits != hull::Limits::all || now < next_check_) return;
    next_check_ = now + std::chrono::seconds(1);
    bool is_common = true;
    if (set.empty_cameras.empty() && !set.silhouettes.empty()) {
      checked_.assign(set.silhouettes, rule);
      is_common = hull::has_hull(checked_, set.silhouettes);
    }
    checks_without_ = is_common ? 0 : checks_without_ + 1;
    node_.status.diagnostic("silhouettes",
                            checks_without_ >= kMinChecks ? hull::kNoCommonPoint : "");
  }

  TileFrame frame_of(const frames::FrameSet& set, const std::string& name,
                     const hull::View& view) const {
    return {name,
            set.frame,
            set.capture_stamp_ns,
            view,
            config_.tile_columns * config_.tile_rows,
            set.empty_cameras};
  }

  node::NodeContext& node_;
  const std::string viewer_;
  std::vector<config::HullView> views_;  // eyes have the geometry of the last ViewInfo
  Spectators spectators_;
  int readers_ = 0;  // of tiles, at the last poll for spectators
  std::chrono::steady_clock::time_point next_spectator_poll_{};
  bool has_view_info_ = false;
  const config::ReconConfig config_;
  Reconstructor reconstructor_;
  node::FrameSetReader sets_;
  bus::Reader<bus::topics::ViewInfo> view_infos_;
  bus::Reader<bus::topics::HeadPose> poses_;
  bus::Reader<bus::topics::ObjectColour> colours_;
  node::ReplayMonitor replay_;
  node::FrameTracer traces_;
  bus::Writer<bus::topics::HullTile> tiles_;
  std::optional<bus::Writer<bus::topics::TileCosts>> costs_;  // until the node leaves
  int frames_ = 0, frames_without_tiles_ = 0;  // answered; the latter: the newest ones in a row
  base::WorkerPool check_pool_{1};
  hull::CpuHull checked_{check_pool_};
  std::chrono::steady_clock::time_point next_check_;
  int checks_without_ = 0;                // one after the other
  std::deque<frames::FrameSet> waiting_;  // frame sets that wait for their poses
  FrameInputs inputs_;
};

}  // namespace

void run_reconstruction_pipe(node::NodeContext& node, config::HullBackend backend) {
  ReconstructionPipe(node, backend).run();
}

}  // namespace fivepipe::recon
