#include "benchmarks/nodes/security/message_cost.h"

#include <fmt/format.h>

#include <chrono>
#include <iostream>
#include <map>
#include <stdexcept>
#include <thread>

#include "common/base/realtime.h"
#include "common/base/timing.h"
#include "common/pipeline/bus/bus.h"
#include "common/pipeline/messages/wire_conversions.h"
#include "launch/supervise/process.h"

namespace fivepipe::security_bench {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using security::Role;

constexpr auto kPeriod = std::chrono::microseconds(16'667);  // 60 Hz
constexpr auto kStartTimeout = 15s, kMessageTimeout = 3s;
// Messages before the measurement, which fill caches and the buffers of DDS.
constexpr int kWarmUp = 20;

bus::BusOptions options_of(std::uint32_t domain, const std::string& keys, Role role) {
  bus::BusOptions options{.domain = domain};
  if (!keys.empty())
    options.network.security = security::Credentials{
        {std::filesystem::path(keys) / name_of(role), role}, "fivepipe bench security", {}, 0};
  return options;
}

int send(std::uint32_t domain, const std::string& keys, std::size_t size_bytes, int messages) {
  bus::Bus bus(options_of(domain, keys, Role::replay));
  auto writer = bus.writer<bus::topics::ObjectColour>();
  for (const auto until = Clock::now() + kStartTimeout; writer.readers() == 0; bus.wait(10ms))
    if (Clock::now() > until) throw std::runtime_error("the receiver did not join the bus");
  std::vector<std::uint8_t> pixels(size_bytes, 1);
  fivepipe_v1_ObjectColour message{};
  messages::set_text(message.camera, "bench");
  messages::borrow(message.bgr, pixels);
  double cpu_before_s = 0;
  auto next = Clock::now();
  for (int i = 0; i < kWarmUp + messages; ++i, next += kPeriod) {
    std::this_thread::sleep_until(next);
    if (i == kWarmUp) cpu_before_s = base::process_cpu_s();
    message.frame = std::uint64_t(i);
    message.capture_stamp_ns = base::now_realtime_ns();
    writer.write(message);
  }
  writer.wait_for_delivery(kMessageTimeout);
  std::cout << "cpu_s " << base::process_cpu_s() - cpu_before_s << std::endl;
  return 0;
}

int receive(std::uint32_t domain, const std::string& keys, int messages) {
  bus::Bus bus(options_of(domain, keys, Role::observer));
  auto reader = bus.reader<bus::topics::ObjectColour>();
  std::vector<double> latency_ms;
  double cpu_before_s = 0;
  bool is_last = false;
  auto until = Clock::now() + kStartTimeout;
  while (!is_last && Clock::now() < until) {
    bus.wait(50ms);
    for (const auto& sample : reader.take()) {
      if (!sample.valid()) continue;
      const std::int64_t now_ns = base::now_realtime_ns();
      until = Clock::now() + kMessageTimeout;
      if (sample->frame < kWarmUp) {
        cpu_before_s = base::process_cpu_s();
        continue;
      }
      latency_ms.push_back(1e-6 * double(now_ns - sample->capture_stamp_ns));
      is_last = sample->frame + 1 == std::uint64_t(kWarmUp + messages);
    }
  }
  std::cout << "cpu_s " << base::process_cpu_s() - cpu_before_s << '\n';
  for (const double ms : latency_ms) std::cout << "latency_ms " << ms << '\n';
  std::cout << std::flush;
  return 0;
}

// Waits for the process and returns the values that it has printed, by name.
std::map<std::string, std::vector<double>> output_of(launch::ChildProcess& process) {
  std::string text;
  std::map<std::string, std::vector<double>> values;
  const auto read = [&](bool flush) {
    for (const std::string& line : process.read_lines(flush)) {
      text += "\n  " + line;
      const std::size_t blank = line.find(' ');
      const std::string name = line.substr(0, blank);
      if (name == "cpu_s" || name == "latency_ms")
        values[name].push_back(std::stod(line.substr(blank)));
    }
  };
  while (!process.wait_for_end(10ms)) read(false);
  read(true);
  if (const auto end = process.ended(); end->by_signal || end->number != 0 || values.empty())
    throw std::runtime_error("a process of the benchmark failed: " + to_string(*end) + text);
  return values;
}

}  // namespace

Cost measure(std::uint32_t domain, const std::filesystem::path& keys, std::size_t size_bytes,
             int messages) {
  const std::string program = std::filesystem::read_symlink("/proc/self/exe");
  const std::vector<std::string> common{std::to_string(domain), keys, std::to_string(size_bytes),
                                        std::to_string(messages)};
  const auto started = [&](const char* mode) {
    std::vector<std::string> words{program, mode};
    words.insert(words.end(), common.begin(), common.end());
    return std::make_unique<launch::ChildProcess>(words, std::vector<int>());
  };
  const auto receiver = started("receive"), sender = started("send");
  const auto sent = output_of(*sender), received = output_of(*receiver);
  Cost cost;
  cost.sent = messages;
  cost.sender_cpu_s = sent.at("cpu_s").front();
  cost.receiver_cpu_s = received.at("cpu_s").front();
  if (received.contains("latency_ms")) cost.latency_ms = received.at("latency_ms");
  return cost;
}

int run_process(const std::vector<std::string>& words) {
  const auto domain = std::uint32_t(std::stoul(words.at(1)));
  const std::string& keys = words.at(2);
  const std::size_t size_bytes = std::stoul(words.at(3));
  const int messages = std::stoi(words.at(4));
  return words.front() == "send" ? send(domain, keys, size_bytes, messages)
                                 : receive(domain, keys, messages);
}

}  // namespace fivepipe::security_bench
