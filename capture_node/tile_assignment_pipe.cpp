#include "capture_node/tile_assignment_pipe.h"

#include <utility>

#include "common/pipeline/messages/wire_conversions.h"

namespace fivepipe::capture {
namespace {

// Returns the configuration that all reconstruction nodes have; nullptr if there is none.
const config::ReconConfig* recon_of(const config::Deployment& deployment) {
  for (const config::Node& node : deployment.nodes)
    if (const auto* recon = std::get_if<config::ReconConfig>(&node.config)) return recon;
  return nullptr;
}

std::vector<std::string> nodes_by_worker(const config::Deployment& deployment) {
  const config::ReconConfig* any = recon_of(deployment);
  std::vector<std::string> names(any ? std::size_t(any->worker_count) : 0);
  for (const config::Node& node : deployment.nodes)
    if (const auto* recon = std::get_if<config::ReconConfig>(&node.config))
      names.at(std::size_t(recon->worker_index)) = node.name;
  return names;
}

}  // namespace

TileAssignment::TileAssignment(node::NodeContext& node)
    : node_(node),
      viewer_(node.deployment.viewer.name),
      tile_costs_(node.bus.reader<bus::topics::TileCosts>()),
      nodes_(nodes_by_worker(node.deployment)),
      presence_(int(nodes_.size())) {
  if (const config::ReconConfig* recon = recon_of(node.deployment)) balancer_.emplace(*recon);
}

void TileAssignment::update(const std::function<bool(std::uint64_t)>& has_published_lately) {
  take_answers(has_published_lately);
  // With --every-frame, a frame takes as long as it needs.
  if (!node_.every_frame) presence_.update(frames::WorkerPresence::Clock::now());
  for (std::size_t worker = 0; worker < nodes_.size(); ++worker) {
    if (nodes_[worker].empty()) continue;
    const int w = int(worker);
    node_.status.diagnostic(nodes_[worker], !presence_.is_missing(w) ? ""
                                            : presence_.has_left(w)
                                                ? "has ended or is out of reach; it gets no tiles"
                                                : "gives no answer; the other reconstruction nodes "
                                                  "take its tiles");
  }
}

void TileAssignment::take_answers(const std::function<bool(std::uint64_t)>& has_published_lately) {
  const auto now = frames::WorkerPresence::Clock::now();
  for (const auto& sample : tile_costs_.take()) {
    if (!balancer_ || viewer_ != sample->viewer) continue;
    if (sample.valid() && has_published_lately(sample->frame)) {
      if (balancer_->add(sample->frame, sample->worker, messages::span_of(sample->tiles),
                         messages::span_of(sample->cost_ms)))
        presence_.answered(sample->frame, sample->worker, now);
      else
        node_.status.drop_from(tile_costs_.process(sample), {"bad_tile_costs", "", ""});
    }
    // A node that ends deletes its writer before it handles its last frames.
    if (sample.writer_gone()) presence_.left(sample->worker);
  }
}

std::vector<std::uint8_t> TileAssignment::owners_of(std::uint64_t frame) {
  if (!balancer_) return {};
  std::vector<std::uint8_t> owners = balancer_->next(presence_.present());
  presence_.published(frame, owners);
  return owners;
}

std::optional<std::uint64_t> TileAssignment::take_lost() { return presence_.take_lost(); }

}  // namespace fivepipe::capture
