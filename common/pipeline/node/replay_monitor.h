// Tracks whether a replay feeds this node. Captures of a replay are in the past.
#pragma once
#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>

#include "common/base/realtime.h"
#include "common/pipeline/bus/bus.h"
#include "common/pipeline/node/status.h"

namespace fivepipe::node {

class ReplayMonitor {
 public:
  // status: counts sessions without a name or with an impossible rate as bad_replay. discard: see
  // update().
  ReplayMonitor(bus::Bus& bus, NodeStatusReporter& status, std::function<void()> discard)
      : status_(status),
        discard_(std::move(discard)),
        sessions_(bus.reader<bus::topics::ReplaySession>()) {}

  // Polls ReplaySession. If a replay has started or restarted, calls `discard`, which must discard
  // all earlier state.
  void update() {
    bool begins = false;
    for (const auto& sample : sessions_.take()) {
      if (!sample.valid() || sample.writer_gone()) {
        if (sample->replay == session_) replaying_ = lossless_ = false;
        continue;
      }
      if (!(sample->replay[0] != '\0' && std::isfinite(sample->rate) && sample->rate >= 0)) {
        status_.drop_from(
            sessions_.process(sample),
            {"bad_replay", sample->replay,
             sample->replay[0] == '\0'
                 ? "no name"
                 : fmt::format("impossible rate {}: must be finite and at least 0", sample->rate)});
        continue;
      }
      session_ = sample->replay;
      began_ns_ = sample.arrived_ns();
      lossless_ = sample->lossless;
      replaying_ = begins = true;
    }
    if (begins) discard_();
  }
  // Takes the samples of the reader and calls handle(sample) for those that are valid and did not
  // arrive before the newest replay. The session of a replay arrives before its samples. update()
  // after the take therefore knows the replay of each taken sample: a node that was busy meanwhile
  // neither mixes the frames of two replays nor loses the first frames of one. Returns the number
  // of taken samples.
  template <class Topic, class Handle>
  std::size_t take(bus::Reader<Topic>& reader, const Handle& handle) {
    const auto samples = reader.take();
    update();
    for (const auto& sample : samples)
      if (sample.valid() && !precedes_replay(sample)) handle(sample);
    return samples.size();
  }

  bool replaying() const { return replaying_; }
  // Returns true if the sample arrived before the newest replay began. now_ns: CLOCK_REALTIME.
  // After the clock was set back, its times say nothing about the order; then returns false.
  template <class Topic>
  bool precedes_replay(const bus::Sample<Topic>& sample,
                       std::int64_t now_ns = base::now_realtime_ns()) const {
    return replaying_ && sample.arrived_ns() < began_ns_ && began_ns_ <= now_ns;
  }
  // True in a lossless replay: the node advances by frames, not by the clock.
  bool lossless() const { return lossless_; }

 private:
  NodeStatusReporter& status_;
  std::function<void()> discard_;
  bus::Reader<bus::topics::ReplaySession> sessions_;
  std::string session_;  // name of the newest one
  bool replaying_ = false, lossless_ = false;
  std::int64_t began_ns_ = 0;  // arrival of its session
};

}  // namespace fivepipe::node
