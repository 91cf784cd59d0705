// Prints the messages of a topic to stdout: the work of `fivepipe echo`.
#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "common/pipeline/bus/profile.h"
#include "launch/inspect/message_formatter.h"

namespace fivepipe::launch {

struct EchoRequest {
  std::string topic;           // as resolve_topic() accepts it
  std::filesystem::path file;  // a recording; empty: the bus
  std::uint64_t count = 0;     // stop after so many messages; 0: no limit
  double start_s = 0;          // after the recording's start
  std::optional<double> end_s;
  TextOptions text;
  std::uint32_t domain = 0;
  bus::Network network = {};
};

// Returns the exit code: 0 if all messages were printed, 1 if the recording is damaged, 130 if
// `interrupted` returned true first. From the bus, drops and counts messages if the output is too
// slow. Throws UsageError for an unknown topic or field, std::system_error if stdout fails, and as
// Recording does.
int echo(const EchoRequest& request, const std::function<bool()>& interrupted);

}  // namespace fivepipe::launch
