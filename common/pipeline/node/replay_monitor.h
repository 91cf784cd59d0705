// Whether a replay feeds this node: what it gets then was captured long ago.
#pragma once
#include "common/pipeline/bus/bus.h"

namespace fivepipe::node {

class ReplayMonitor {
 public:
  explicit ReplayMonitor(bus::Bus& bus) : sessions_(bus.reader<bus::topics::ReplaySession>()) {}

  // Looks for news; to be asked before inputs are taken. True where a replay begins, or begins
  // anew: what was before has nothing to do with what comes.
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
  // Every frame is waited for: the node goes by frames alone, not by the clock.
  bool lossless() const { return lossless_; }

 private:
  bus::Reader<bus::topics::ReplaySession> sessions_;
  bool replaying_ = false, lossless_ = false;
};

}  // namespace fivepipe::node
