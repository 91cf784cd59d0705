#include "sim_node/spacing_pipe.h"

namespace fivepipe::sim {

namespace {

// Far more than a replay sends ahead of the frames.
constexpr std::size_t kMaxPending = 4096;
constexpr std::size_t kMaxCalls = 64;

}  // namespace

SpacingPipe::SpacingPipe(node::NodeContext& node) : node_(node), scene_(node.deployment.scene) {
  reset();
  if (config::has_spacings(scene_)) {
    requests_.emplace(node.bus.reader<bus::topics::SpacingRequest>());
    recorded_.emplace(node.bus.reader<bus::topics::ObjectSpacing>());
    spacings_.emplace(node.bus.writer<bus::topics::ObjectSpacing>());
  }
  for (const auto& [object, spacing_m] : node.spacings_m) {
    const auto change = change_to(object, spacing_m, scene_);
    if (const messages::BadMessage* bad = std::get_if<messages::BadMessage>(&change))
      node.status.drop(*bad);
    else
      add(std::get<SpacingChange>(change));
  }
}

void SpacingPipe::reset() {
  pending_.clear();
  states_.resize(scene_.objects.size());
  for (std::size_t i = 0; i < states_.size(); ++i)
    if (scene_.objects[i].spacing) {
      states_[i].spacing_m = scene_.objects[i].spacing->at_m;
      states_[i].requested = false;
    }
}

template <class Topic>
void SpacingPipe::take_from(bus::Reader<Topic>& reader, node::ReplayMonitor& replay,
                            bool is_of_replay) {
  // This node itself may have sent those that precede the replay. A replay that ends just now has
  // sent the frames that this node has taken.
  const auto handle = [&](const auto& sample) {
    if ((was_replaying_ || replay.replaying()) != is_of_replay) return;
    const auto change = change_from(*sample, scene_);
    if (const messages::BadMessage* bad = std::get_if<messages::BadMessage>(&change))
      node_.status.drop_from(reader.process(sample), *bad);
    else
      add(std::get<SpacingChange>(change));
  };
  // One call returns a part of what has arrived.
  for (std::size_t calls = 0; calls < kMaxCalls; ++calls)
    if (replay.take(reader, handle) == 0) return;
}

void SpacingPipe::add(const SpacingChange& change) {
  // Of requests, only the newest of an object counts.
  if (change.capture_stamp_ns == 0)
    std::erase_if(pending_, [&](const SpacingChange& earlier) {
      return earlier.object == change.object && earlier.capture_stamp_ns == 0;
    });
  if (pending_.size() == kMaxPending) pending_.pop_front();
  pending_.push_back(change);
}

// Without a replay, an ObjectSpacing is that of an earlier process or of this one.
void SpacingPipe::take(node::ReplayMonitor& replay) {
  if (!requests_) return;
  if (was_replaying_ && !replay.replaying()) pending_.clear();
  was_replaying_ = replay.replaying();
  take_from(*requests_, replay, false);
  take_from(*recorded_, replay, true);
}

void SpacingPipe::apply(std::int64_t capture_stamp_ns, Simulation& simulation) {
  std::erase_if(pending_, [&](const SpacingChange& change) {
    if (change.capture_stamp_ns > capture_stamp_ns) return false;
    states_[change.object].spacing_m = change.spacing_m;
    states_[change.object].requested = true;
    simulation.set_spacing(change.object, change.spacing_m);
    return true;
  });
}

void SpacingPipe::publish(std::uint64_t frame, std::int64_t capture_stamp_ns, bool replaying) {
  if (!spacings_ || replaying) return;
  for (std::size_t i = 0; i < states_.size(); ++i) {
    State& state = states_[i];
    if (!scene_.objects[i].spacing || state.published_m == state.spacing_m) continue;
    spacings_->write(spacing_message(scene_.objects[i].name, frame, capture_stamp_ns,
                                     state.spacing_m, state.requested));
    state.published_m = state.spacing_m;
  }
}

}  // namespace fivepipe::sim
