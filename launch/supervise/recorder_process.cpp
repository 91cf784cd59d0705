#include "launch/supervise/recorder_process.h"

#include <unistd.h>

#include <chrono>
#include <csignal>
#include <iostream>
#include <stdexcept>

#include "common/recording/replay/record_session.h"
#include "common/recording/replay/recorder.h"
#include "launch/supervise/interrupt.h"
#include "launch/supervise/own_files.h"

namespace fivepipe::launch {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kStartTimeout = 10s;

// After SIGTERM the recorder limits the time for which it waits for the disk, drops and counts what
// the disk has not taken, and closes the file, in less than this time.
constexpr std::chrono::milliseconds kRecorderGrace = 2s;
static_assert(replay::kIndexTime < kRecorderGrace);

std::vector<std::string> command_line(const std::vector<std::string>& arguments) {
  std::vector<std::string> words{program_folder() / "fivepipe", "record", "--name",
                                 own_recorder_name()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  return words;
}

// A recorder creates its readers first and its status writer last.
bool is_recorder_ready(bus::Bus& bus) {
  const std::string name = own_recorder_name();
  for (const bus::EndpointDescription& endpoint : bus.endpoints())
    if (endpoint.participant == name && endpoint.writes &&
        endpoint.topic == bus::topics::NodeStatus::name)
      return true;
  return false;
}

}  // namespace

RecorderProcess::RecorderProcess(bus::Bus& bus, std::vector<std::string> arguments)
    : child_(command_line(arguments), {}) {
  for (const auto until = Clock::now() + kStartTimeout;
       !is_recorder_ready(bus) && signals_received() == 0; bus.wait(20ms)) {
    if (!ended() && Clock::now() < until) continue;
    std::string output;
    for (const std::string& line : child_.read_lines(true)) output += "\n  " + line;
    throw std::runtime_error("the recorder did not start" + output);
  }
}

void RecorderProcess::forward_output() {
  for (const std::string& line : child_.read_lines(ended().has_value()))
    std::cerr << "[recorder] " << line << '\n';
}

std::optional<ProcessExit> RecorderProcess::finish() {
  child_.signal_group(SIGTERM);
  const auto until = Clock::now() + kRecorderGrace;
  while (signals_received() < 2 && Clock::now() < until && !child_.wait_for_end(20ms))
    forward_output();
  if (!ended()) {
    std::cerr
        << "the recorder did not end and is killed; `fivepipe info --recover FILE` repairs its "
           "recording\n";
    child_.signal_group(SIGKILL);
    if (!child_.wait_for_end(kKillTimeout)) {
      std::cerr << "the recorder (process " << pid() << ") waits for the disk in the kernel\n";
      child_.abandon();
    }
  }
  forward_output();
  return ended();
}

std::string own_recorder_name() {
  return std::string(replay::kRecorderName) + "_" + std::to_string(getpid());
}

}  // namespace fivepipe::launch
