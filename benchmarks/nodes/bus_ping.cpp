#include "benchmarks/nodes/bus_ping.h"

#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <optional>
#include <regex>
#include <stdexcept>
#include <thread>

#include "common/pipeline/bus/bus.h"
#include "common/pipeline/bus/profile.h"
#include "common/pipeline/messages/wire_conversions.h"
#include "launch/supervise/hosts/free_domain.h"
#include "launch/supervise/interrupt.h"
#include "launch/supervise/own_files.h"
#include "launch/supervise/process.h"

namespace fivepipe::node_bench {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kMatchTimeout = 10s, kRoundTripTimeout = 1s,
                                    kRoundDuration = 1500ms;
// ddsperf prints a line per second.
constexpr int kDdsperfDuration_s = 3;
// Approximate size of an ObjectPixelMap or an ObjectColour without its payload.
constexpr std::size_t kHeaderBytes = 128;

void stop_if_interrupted() {
  if (launch::signals_received() > 0) throw std::runtime_error("interrupted");
}

// Returns ddsperf's medians of half a round trip in us, one per second.
std::vector<double> ddsperf_medians(std::uint32_t domain, std::size_t size_bytes,
                                    const std::string& mode) {
  const std::vector<std::string> common{"/usr/bin/env", "ddsperf",
                                        "-i",           std::to_string(domain),
                                        "-D",           std::to_string(kDdsperfDuration_s)};
  std::vector<std::string> pong = common, ping = common;
  pong.insert(pong.end(), {"pong", mode});
  ping.insert(ping.end(), {"ping", "size", std::to_string(size_bytes), mode});
  launch::ChildProcess pong_process(pong, {}), ping_process(ping, {});
  std::vector<double> medians_us;
  std::string output;
  static const std::regex stats(" 50% ([0-9.]+)us");
  while (!ping_process.ended() || !pong_process.ended()) {
    stop_if_interrupted();
    pong_process.read_lines();
    for (const std::string& line : ping_process.read_lines()) {
      std::smatch match;
      if (std::regex_search(line, match, stats)) medians_us.push_back(std::stod(match[1]));
      output += "\n  " + line;
    }
    std::this_thread::sleep_for(10ms);
  }
  for (const std::string& line : ping_process.read_lines(true))
    if (std::smatch match; std::regex_search(line, match, stats))
      medians_us.push_back(std::stod(match[1]));
  if (medians_us.empty())
    throw std::runtime_error("ddsperf (package cyclonedds-tools) printed no round-trip times" +
                             output);
  return medians_us;
}

void ping(std::uint32_t domain, BusTimes& times) {
  launch::ChildProcess echo(
      {launch::program_folder() / "fivepipe_measure", "bus-echo", std::to_string(domain)}, {});
  bus::Bus bus({.domain = domain, .participant = "ping"});
  auto maps = bus.writer<bus::topics::ObjectPixelMap>();
  auto colours = bus.reader<bus::topics::ObjectColour>();
  for (const auto until = Clock::now() + kMatchTimeout;
       maps.readers() == 0 || colours.writers() == 0; bus.wait(10ms))
    if (stop_if_interrupted(); Clock::now() > until)
      throw std::runtime_error("the echo process did not join the bus within 10 s");
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
    // The time at which the answer was read. Returning the loan does not count as the bus's time.
    std::optional<Clock::time_point> received;
    while (!received) {
      if (Clock::now() - start > kRoundTripTimeout)
        throw std::runtime_error(
            fmt::format("a message of {} bytes did not return within 1 s", times.size_bytes));
      bus.wait(10ms);
      for (const auto& sample : colours.take())
        if (sample.valid() && sample->frame == map.frame) received = Clock::now();
    }
    if (warm)
      times.ours_us.push_back(0.5e6 * std::chrono::duration<double>(*received - start).count());
  }
}

}  // namespace

int echo_on_bus(std::uint32_t domain) {
  launch::catch_signals();
  bus::Bus bus({.domain = domain, .participant = "echo"});
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

std::vector<BusTimes> time_bus(const std::vector<std::size_t>& sizes_bytes, int rounds) {
  // ddsperf inherits the same network settings.
  const std::string xml =
      bus::fitted_to_kernel(bus::profile_xml({}), bus::kernel_rmem_max_bytes()).xml;
  setenv("CYCLONEDDS_URI", xml.c_str(), 1);
  std::vector<BusTimes> all;
  for (const std::size_t size_bytes : sizes_bytes) all.push_back({size_bytes, {}, {}, {}});
  const std::uint32_t domain = launch::free_domain();
  for (int round = 0; round < rounds; ++round)
    for (BusTimes& times : all) {
      ping(domain, times);
      for (const double us : ddsperf_medians(domain, times.size_bytes, "waitset"))
        times.ddsperf_us.push_back(us);
      for (const double us : ddsperf_medians(domain, times.size_bytes, "listener"))
        times.ddsperf_listener_us.push_back(us);
    }
  return all;
}

}  // namespace fivepipe::node_bench
