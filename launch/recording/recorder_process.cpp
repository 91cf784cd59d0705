#include "launch/recording/recorder_process.h"

#include <csignal>
#include <chrono>
#include <iostream>
#include <stdexcept>
#include <thread>

#include "launch/commands.h"

namespace fivepipe {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto longest_start = 10s;
// What waits for the disk when it is told to end.
constexpr auto longest_end = 30s;
constexpr const char* recorder_name = "recorder";

std::vector<std::string> command_line(const std::vector<std::string>& arguments) {
  std::vector<std::string> words{program_folder() / "fivepipe", "record", "--name", recorder_name};
  words.insert(words.end(), arguments.begin(), arguments.end());
  return words;
}

// It makes its readers first, and its status last.
bool listens(Bus& bus) {
  for (const EndpointDescription& endpoint : bus.endpoints())
    if (endpoint.participant == recorder_name && endpoint.writes && endpoint.topic == topics::NodeStatus::name) return true;
  return false;
}

}  // namespace

RecorderProcess::RecorderProcess(Bus& bus, std::vector<std::string> arguments) : child_(command_line(arguments), {}) {
  for (const auto until = Clock::now() + longest_start; !listens(bus); bus.wait(20ms)) {
    if (!ended() && Clock::now() < until) continue;
    std::string said;
    for (const std::string& line : child_.read_lines(true)) said += "\n  " + line;
    throw std::runtime_error("the recorder did not start" + said);
  }
}

void RecorderProcess::pass_on_output() {
  for (const std::string& line : child_.read_lines(ended())) std::cerr << "[recorder] " << line << '\n';
}

int RecorderProcess::finish() {
  child_.signal_group(SIGTERM);
  const auto until = Clock::now() + longest_end;
  while (!ended() && Clock::now() < until) {
    pass_on_output();
    std::this_thread::sleep_for(20ms);
  }
  pass_on_output();
  const auto exit = child_.ended();
  return exit && !exit->by_signal ? exit->number : 1;
}

}  // namespace fivepipe
