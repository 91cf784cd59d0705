#include "benchmarks/nodes/bus_ping.h"

#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <regex>
#include <stdexcept>
#include <thread>

#include "benchmarks/nodes/free_domain.h"
#include "common/pipeline/bus/bus.h"
#include "common/pipeline/bus/profile.h"
#include "common/pipeline/messages/wire_conversions.h"
#include "launch/cli/commands.h"
#include "launch/supervise/interrupt.h"
#include "launch/supervise/process.h"

namespace fivepipe::node_bench {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kMatchTimeout = 10s, kRoundTripTimeout = 1s,
                                    kRoundDuration = 1500ms;
// ddsperf tells of whole seconds; the first is of its start.
constexpr int kDdsperfDuration_s = 3;
// Of an ObjectPixelMap and an ObjectColour beside their payload, about.
constexpr std::size_t kHeaderBytes = 128;

void stop_if_interrupted() {
  if (launch::signals_received() > 0) throw std::runtime_error("interrupted");
}

// Its medians of half a round trip [us], without the first.
std::vector<double> ddsperf_medians(std::uint32_t domain, std::size_t size_bytes,
                                    const std::string& mode) {
  const std::vector<std::string> common{"/usr/bin/env", "ddsperf",
                                        "-i",           std::to_string(domain),
                                        "-D",           std::to_string(kDdsperfDuration_s)};
  std::vector<std::string> pong = common, ping = common;
  pong.insert(pong.end(), {"pong", mode});
  ping.insert(ping.end(), {"ping", "size", std::to_string(size_bytes), mode});
  launch::ChildProcess answers(pong, {}), asks(ping, {});
  std::vector<double> medians_us;
  std::string said;
  static const std::regex stats(" 50% ([0-9.]+)us");
  while (!asks.ended() || !answers.ended()) {
    stop_if_interrupted();
    answers.read_lines();
    for (const std::string& line : asks.read_lines()) {
      std::smatch match;
      if (std::regex_search(line, match, stats)) medians_us.push_back(std::stod(match[1]));
      said += "\n  " + line;
    }
    std::this_thread::sleep_for(10ms);
  }
  for (const std::string& line : asks.read_lines(true))
    if (std::smatch match; std::regex_search(line, match, stats))
      medians_us.push_back(std::stod(match[1]));
  if (medians_us.empty())
    throw std::runtime_error("ddsperf (package cyclonedds-tools) told no round-trip times" + said);
  return medians_us;
}

void ping(std::uint32_t domain, const std::string& profile, BusTimes& times) {
  launch::ChildProcess answers(
      {launch::program_folder() / "fivepipe", "bench", "bus-echo", std::to_string(domain), profile},
      {});
  bus::Bus bus({domain, profile, "ping"});
  auto maps = bus.writer<bus::topics::ObjectPixelMap>();
  auto colours = bus.reader<bus::topics::ObjectColour>();
  for (const auto until = Clock::now() + kMatchTimeout;
       maps.readers() == 0 || colours.writers() == 0; bus.wait(10ms))
    if (stop_if_interrupted(); Clock::now() > until)
      throw std::runtime_error("the other end of the bus does not answer");
  std::vector<std::uint8_t> payload(
      times.size_bytes > kHeaderBytes ? times.size_bytes - kHeaderBytes : 0, 1);
  fivepipe_v1_ObjectPixelMap map{};
  messages::set_text(map.camera, "ping");
  messages::borrow(map.payload, payload);
  const auto end = Clock::now() + kRoundDuration;
  for (bool warm = false; Clock::now() < end; warm = true) {
    stop_if_interrupted();
    const auto start = Clock::now();
    ++map.frame;
    maps.write(map);
    std::optional<Clock::time_point>
        back;  // when it was read: what a reader does with the loan afterwards is not the bus's
    while (!back) {
      if (Clock::now() - start > kRoundTripTimeout)
        throw std::runtime_error("a message of " + std::to_string(times.size_bytes) +
                                 " bytes did not come back");
      bus.wait(10ms);
      for (const auto& sample : colours.take())
        if (sample.valid() && sample->frame == map.frame) back = Clock::now();
    }
    if (warm) times.ours_us.push_back(0.5e6 * std::chrono::duration<double>(*back - start).count());
  }
}

}  // namespace

int echo_on_bus(std::uint32_t domain, const std::string& profile) {
  launch::catch_signals();
  bus::Bus bus({domain, profile, "echo"});
  auto maps = bus.reader<bus::topics::ObjectPixelMap>();
  auto colours = bus.writer<bus::topics::ObjectColour>();
  while (launch::signals_received() == 0) {
    bus.wait(50ms);
    for (const auto& sample : maps.take()) {
      if (!sample.valid()) continue;
      fivepipe_v1_ObjectColour colour{};
      messages::set_text(colour.camera, sample->camera);
      colour.frame = sample->frame;
      colour.bgr._length = colour.bgr._maximum = sample->payload._length;
      colour.bgr._buffer = sample->payload._buffer;
      colours.write(colour);
    }
  }
  return 0;
}

std::vector<BusTimes> time_bus(const std::vector<std::size_t>& sizes_bytes, int rounds,
                               const std::string& profile) {
  // The same network settings, whoever measures.
  const std::string xml =
      bus::fitted_to_kernel(bus::profile_xml(profile), bus::kernel_rmem_max_bytes()).xml;
  setenv("CYCLONEDDS_URI", xml.c_str(), 1);
  std::vector<BusTimes> all;
  for (const std::size_t size_bytes : sizes_bytes) all.push_back({size_bytes, {}, {}, {}});
  const std::uint32_t domain = free_domain(profile);
  for (int round = 0; round < rounds; ++round)
    for (BusTimes& times : all) {
      ping(domain, profile, times);
      for (const double us : ddsperf_medians(domain, times.size_bytes, "waitset"))
        times.ddsperf_us.push_back(us);
      for (const double us : ddsperf_medians(domain, times.size_bytes, "listener"))
        times.ddsperf_listener_us.push_back(us);
    }
  return all;
}

}  // namespace fivepipe::node_bench
