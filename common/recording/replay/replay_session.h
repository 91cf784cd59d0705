// Replays a recording into a domain: selects channels, waits for readers, sends all rounds.
#pragma once
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/pipeline/bus/profile.h"
#include "common/recording/replay/replayer.h"

namespace fivepipe::replay {

struct ReplayRequest {
  std::string topics = ".*";       // regular expression of the topics to send
  std::vector<std::string> nodes;  // send the inputs of these nodes only; empty: all topics
  std::map<std::string, std::string> settings;  // changes of the recorded deployment's settings
  double start_s = 0;                           // after the recording's start
  std::optional<double> end_s;                  // after the recording's start; nullopt: to its end
  double rate = 1;                              // 1: as recorded; 0: unlimited
  bool lossless = false, loop = false;
  int frames_in_flight = 2;
  std::uint32_t domain = 0;
  bus::Network network = {};
  std::string deployment;  // whose nodes accept the messages; empty: those started without one
  bool ignore_conflicts = false;      // replay although other writers publish the same topics
  std::optional<double> wait_s = 20;  // maximum wait for readers; nullopt: do not wait
};

// Throws base::UsageError if the request names an unknown node or a time range without messages,
// recording::RecordingError if it names nodes and the recording has no deployment.
ReplayPlan plan_for(const recording::Recording& recording, const ReplayRequest& request);

struct ReplayResult {
  enum class End { complete, incomplete, stopped, refused, no_reader };
  End end = End::complete;
  std::string message;  // why the replay was refused, or which reader is missing
};

struct ReplayCallbacks {
  std::function<ReplayControl()> control;  // called at least ten times per second while sending
  std::function<bool()> interrupted;       // true ends the replay
  std::function<void(const ReplayCounts&)> on_round;  // called after each round
};

// Logs its progress every 5 s. Throws as plan_for() and Replayer do.
ReplayResult replay(const recording::Recording& recording, const ReplayRequest& request,
                    const ReplayCallbacks& callbacks);

}  // namespace fivepipe::replay
