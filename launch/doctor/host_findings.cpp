#include "launch/doctor/host_findings.h"

#include <fmt/format.h>

#include <algorithm>
#include <future>
#include <iterator>
#include <thread>

#include "common/base/network/multicast_probe.h"
#include "common/base/network/path_mtu.h"
#include "common/base/text_table.h"
#include "launch/supervise/hosts/host_exchange.h"
#include "launch/supervise/hosts/hosts.h"

namespace fivepipe::launch {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kPollPeriod = 20ms;

std::string text_of(const config::Host& host) {
  return fmt::format("host {} ({})", host.name, host.address);
}

bool answers_a_connection(const config::Host& host) {
  HostProbe probe(host.address);
  probe.ask();
  for (const auto until = Clock::now() + 1s; Clock::now() < until;
       std::this_thread::sleep_for(kPollPeriod))
    if (probe.take_answer() == HostProbe::Answer::answers) return true;
  return false;
}

Finding check_machine(const config::Host& host) {
  const base::PathMtu path = base::path_mtu(host.address);
  if (path.bytes == 0)
    return {Verdict::fail, text_of(host) + ": this machine has no route to its address",
            "is an interface in its network up? `ip address` lists those of this machine"};
  if (!path.answers && !answers_a_connection(host))
    return {Verdict::warn, text_of(host) + ": no answer",
            "it is off or unplugged, it has another address, or a firewall drops the request"};
  if (!path.answers)
    return {Verdict::ok, text_of(host) + ": answers; the size of packets could not be tested", ""};
  if (!path.arrives)
    return {Verdict::warn,
            fmt::format("{}: small packets arrive, packets of {} bytes do not", text_of(host),
                        path.bytes),
            "the MTU differs along the path; set the same on all interfaces and switches: "
            "ip link set INTERFACE mtu BYTES"};
  return {Verdict::ok,
          fmt::format("{}: answers; packets of {} bytes arrive (MTU)", text_of(host), path.bytes),
          ""};
}

std::string multicast_text(const config::Deployment& deployment, const std::string& host) {
  return "fivepipe doctor " + deployment.name + " " + host;
}

Finding multicast_finding(const std::string& host, bool arrives) {
  if (arrives) return {Verdict::ok, "multicast of host " + host + ": arrives", ""};
  return {Verdict::warn, "multicast of host " + host + ": does not arrive",
          "network_profile lan sends the data of the cameras by multicast: the switch drops it, or "
          "a firewall. If the switch has IGMP snooping, switch on its querier, or use "
          "network_profile lossy, which needs no multicast"};
}

// Whether both hosts know how far their clocks are apart.
bool is_compared(const HostState& own, const ComparedHost& other) {
  return other.clock && other.state.clocks.contains(own.speaker);
}

}  // namespace

std::vector<Finding> check_machines(const config::Deployment& deployment, const std::string& own) {
  // All at once: a machine without an answer takes seconds.
  std::vector<std::future<Finding>> checks;
  for (const config::Host& host : deployment.hosts)
    if (host.name != own) checks.push_back(std::async(std::launch::async, check_machine, host));
  std::vector<Finding> findings;
  for (std::future<Finding>& check : checks) findings.push_back(check.get());
  return findings;
}

std::vector<Finding> findings_about(const HostState& own, const ComparedHost& other) {
  const std::string host = base::printable(other.state.speaker.host);
  std::vector<Finding> findings;
  if (!other.clock) {
    findings.push_back({Verdict::warn, "clock of host " + host + ": not compared",
                        "its messages arrive here, but ours do not arrive there in time: check "
                        "the firewalls of both"});
  } else {
    const ClockVerdict verdict = verdict_on(*other.clock);
    findings.push_back({verdict == ClockVerdict::good      ? Verdict::ok
                        : verdict == ClockVerdict::warning ? Verdict::warn
                                                           : Verdict::fail,
                        "clock of host " + host + ": " + launch::text_of(*other.clock),
                        verdict == ClockVerdict::good
                            ? ""
                            : "synchronise the clocks, for example by chrony on each host"});
  }
  const std::vector<std::string> different = differences(own, other.state);
  if (different.empty())
    findings.push_back({Verdict::ok, "version and files of host " + host + ": the same", ""});
  for (const std::string& text : different)
    findings.push_back({Verdict::warn, base::printable(text), ""});
  return findings;
}

std::vector<Finding> compare_hosts(bus::Bus& bus, const config::Deployment& deployment,
                                   const std::string& own, std::chrono::milliseconds patience,
                                   const std::function<bool()>& is_interrupted) {
  HostExchange exchange(bus, deployment, {own, "doctor"});
  const auto newest = [&](const std::string& host) -> std::optional<ComparedHost> {
    const std::vector<ComparedHost> others = exchange.others();
    std::optional<ComparedHost> found;
    for (const ComparedHost& other : others)
      if (other.state.speaker.host == host && (!found || is_compared(exchange.own(), other)))
        found = other;
    return found;
  };
  const auto all_compared = [&] {
    return std::ranges::all_of(deployment.hosts, [&](const config::Host& host) {
      const auto other = newest(host.name);
      return host.name == own || (other && is_compared(exchange.own(), *other));
    });
  };
  const auto own_host = std::ranges::find(deployment.hosts, own, &config::Host::name);
  base::MulticastProbe multicast(
      own_host->interface.empty() ? own_host->address : own_host->interface,
      multicast_text(deployment, own));
  const auto step_until = [&](Clock::time_point end, const std::function<bool()>& is_done) {
    for (exchange.step(); !is_done() && Clock::now() < end && !is_interrupted(); exchange.step()) {
      multicast.step();
      std::this_thread::sleep_for(kPollPeriod);
    }
  };
  const auto end = Clock::now() + patience;
  step_until(end, all_compared);
  // The others end as soon as they hear that this host is done.
  if (all_compared())
    step_until(Clock::now() + HostExchange::kPeriod + HostExchange::kStartPeriod,
               [] { return false; });

  std::vector<Finding> findings;
  for (const config::Host& host : deployment.hosts) {
    if (host.name == own) continue;
    if (const auto other = newest(host.name)) {
      std::ranges::move(findings_about(exchange.own(), *other), std::back_inserter(findings));
      // `up` sends no such texts.
      if (other->state.speaker.program == "doctor" && deployment.network_profile == "lan")
        findings.push_back(multicast_finding(
            host.name, multicast.heard().contains(multicast_text(deployment, host.name))));
    } else {
      findings.push_back({Verdict::warn, "no fivepipe program answers on host " + host.name,
                          "run `fivepipe doctor` or `fivepipe up` with this deployment there at "
                          "the same time; --wait waits longer"});
    }
  }
  return findings;
}

}  // namespace fivepipe::launch
