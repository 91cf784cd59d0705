#include "launch/supervise/recorder_process.h"

#include <unistd.h>

#include <chrono>
#include <csignal>
#include <iostream>
#include <stdexcept>
#include <thread>

#include "common/recording/replay/recorder.h"
#include "launch/supervise/interrupt.h"
#include "launch/supervise/program_folder.h"

namespace fivepipe::launch {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kStartTimeout = 10s;

// Time to write the buffered messages to the disk. It is short after Ctrl-C and zero after a second
// one; the file remains readable up to its last chunk.
std::chrono::milliseconds grace(int signals) {
  return signals == 0 ? 30s : signals == 1 ? 1500ms : 0ms;
}

// Unique, because the domain may have another recorder.
std::string own_recorder_name() {
  return std::string(replay::kRecorderName) + "_" + std::to_string(getpid());
}

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
  for (const std::string& line : child_.read_lines(ended()))
    std::cerr << "[recorder] " << line << '\n';
}

int RecorderProcess::finish() {
  child_.signal_group(SIGTERM);
  int signals = signals_received();
  auto until = Clock::now() + grace(signals);
  while (!ended() && Clock::now() < until) {
    forward_output();
    std::this_thread::sleep_for(20ms);
    if (signals_received() != signals) until = Clock::now() + grace(signals = signals_received());
  }
  if (!ended()) {
    std::cerr
        << "the recorder did not end and is killed; `fivepipe info --recover FILE` repairs its "
           "recording\n";
    child_.signal_group(SIGKILL);
    while (!ended()) std::this_thread::sleep_for(1ms);
  }
  forward_output();
  const auto exit = child_.ended();
  return exit && !exit->by_signal ? exit->number : 1;
}

}  // namespace fivepipe::launch
