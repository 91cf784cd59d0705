// Tracks whether a replay feeds this node. Captures of a replay are in the past.
#pragma once
#include "common/pipeline/bus/bus.h"

namespace fivepipe::node {

class ReplayMonitor {
 public:
  explicit ReplayMonitor(bus::Bus& bus) : sessions_(bus.reader<bus::topics::ReplaySession>()) {}

  // Polls ReplaySession; call it before taking inputs. Returns true if a replay has started or
  // restarted: the caller must discard all earlier state.
  bool update() {
    bool begins = false;
    for (const auto& sample : sessions_.take()) {
      replaying_ = sample.valid() && !sample.writer_gone();
      lossless_ = replaying_ && sample->lossless;
      begins |= replaying_;
    }
    return begins;
  }
  bool replaying() const { return replaying_; }
  // True in a lossless replay: the node advances by frames, not by the clock.
  bool lossless() const { return lossless_; }

 private:
  bus::Reader<bus::topics::ReplaySession> sessions_;
  bool replaying_ = false, lossless_ = false;
};

}  // namespace fivepipe::node
