// Tracks whether a replay feeds this node. Captures of a replay are in the past.
#pragma once
#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <string>

#include "common/pipeline/bus/bus.h"
#include "common/pipeline/node/status.h"

namespace fivepipe::node {

class ReplayMonitor {
 public:
  // status: counts sessions without a name or with an impossible rate as bad_replay.
  ReplayMonitor(bus::Bus& bus, NodeStatusReporter& status)
      : status_(status), sessions_(bus.reader<bus::topics::ReplaySession>()) {}

  // Polls ReplaySession; call it before taking inputs. Returns true if a replay has started or
  // restarted: the caller must discard all earlier state.
  bool update() {
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
    return begins;
  }
  bool replaying() const { return replaying_; }
  // Returns true if the sample arrived before the newest replay began.
  template <class Topic>
  bool precedes_replay(const bus::Sample<Topic>& sample) const {
    return replaying_ && sample.arrived_ns() < began_ns_;
  }
  // True in a lossless replay: the node advances by frames, not by the clock.
  bool lossless() const { return lossless_; }

 private:
  NodeStatusReporter& status_;
  bus::Reader<bus::topics::ReplaySession> sessions_;
  std::string session_;  // name of the newest one
  bool replaying_ = false, lossless_ = false;
  std::int64_t began_ns_ = 0;  // arrival of its session
};

}  // namespace fivepipe::node
