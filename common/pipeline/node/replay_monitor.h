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
  // update(); it must not call this monitor. bus, status and all that `discard` uses must outlive
  // the monitor.
  ReplayMonitor(bus::Bus& bus, NodeStatusReporter& status, std::function<void()> discard)
      : status_(status),
        discard_(std::move(discard)),
        sessions_(bus.reader<bus::topics::ReplaySession>()) {}
  ReplayMonitor(const ReplayMonitor&) = delete;
  ReplayMonitor& operator=(const ReplayMonitor&) = delete;

  // Polls ReplaySession. If a replay has started or restarted, calls `discard`, which must discard
  // all earlier state.
  void update() {
    bool begins = false;
    for (const auto& sample : sessions_.take()) {
      // DDS orders the sessions by name. The newest one counts.
      if (sample.valid() && is_usable(sample) && !(begins && sample.arrived_ns() < began_ns_)) {
        session_ = sample->replay;
        began_ns_ = sample.arrived_ns();
        lossless_ = sample->lossless;
        replaying_ = begins = true;
      }
      // Of a valid session, too, if its replay has ended since.
      if ((!sample.valid() || sample.writer_gone()) && sample->replay == session_)
        replaying_ = lossless_ = false;
    }
    if (begins) discard_();
  }
  // Takes the samples of the reader. Calls handle(sample) for each valid one that did not arrive
  // before the newest session. A replay writes its session before its messages, so update() after
  // the take has seen the session of each message that the replay itself sent: a node that was busy
  // meanwhile neither mixes the messages of two replays nor loses the first ones. A result that
  // another node computes from an earlier frame may still arrive after the session. Returns the
  // number of taken samples.
  template <class Topic, class Handle>
  std::size_t take(bus::Reader<Topic>& reader, const Handle& handle) {
    const auto samples = reader.take();
    update();
    for (const auto& sample : samples)
      if (sample.valid() && !precedes_replay(sample)) handle(sample);
    return samples.size();
  }

  bool replaying() const { return replaying_; }
  // Returns true if the sample arrived before the session of the newest replay, also after that
  // replay has ended. now_ns: CLOCK_REALTIME. If the clock was set back behind the session's
  // arrival, arrival times do not give the order, and it returns false.
  template <class Topic>
  bool precedes_replay(const bus::Sample<Topic>& sample,
                       std::int64_t now_ns = base::now_realtime_ns()) const {
    return sample.arrived_ns() < began_ns_ && began_ns_ <= now_ns;
  }
  // True in a lossless replay: the node advances by frames, not by the clock.
  bool lossless() const { return lossless_; }

 private:
  // Drops and counts an unusable session.
  bool is_usable(const bus::Sample<bus::topics::ReplaySession>& sample) {
    if (sample->replay[0] != '\0' && std::isfinite(sample->rate) && sample->rate >= 0) return true;
    status_.drop_from(
        sessions_.process(sample),
        {"bad_replay", sample->replay,
         sample->replay[0] == '\0'
             ? "no name"
             : fmt::format("impossible rate {}: must be finite and at least 0", sample->rate)});
    return false;
  }

  NodeStatusReporter& status_;
  std::function<void()> discard_;
  bus::Reader<bus::topics::ReplaySession> sessions_;
  std::string session_;  // name of the newest one
  bool replaying_ = false, lossless_ = false;
  std::int64_t began_ns_ = 0;  // arrival of its session; 0: none
};

}  // namespace fivepipe::node
