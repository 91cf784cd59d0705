// Hosts on one machine: network namespaces that a switch joins. They end with the test.
#pragma once
#include <fcntl.h>
#include <sched.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/capture/own_network.h"
#include "tests/support/process.h"
#include "tests/support/process/shell.h"

namespace fivepipe::test {

class TestHosts {
 public:
  // Moves the calling thread, and the threads and processes that it starts from then on, into the
  // network of the switch, whose address is kObserver.
  TestHosts(int count, const std::filesystem::path& folder) {
    if (!enter_own_network({"127.0.0.1"})) {
      why_not_ = "the system allows no network namespaces (CAP_SYS_ADMIN)";
      return;
    }
    // A switch that sends multicast only to the hosts that have joined a group (IGMP snooping).
    run("ip link add switch type bridge mcast_querier 1 mcast_startup_query_interval 100");
    // A switch has no firewall: br_netfilter, a kernel module of container hosts, passes each
    // packet of a bridge through netfilter.
    run("for file in /proc/sys/net/bridge/bridge-nf-call-*; do "
        "[ ! -e $file ] || echo 0 >$file || exit 1; done");
    run("ip address add " + kObserver + "/24 dev switch");
    run("ip link set switch up");
    for (int i = 0; i < count; ++i) {
      // `unshare` becomes `sleep`, whose network and name are those of the host, for longer than
      // any test runs.
      const std::string machine = "machine" + std::to_string(i + 1);
      holders_.push_back(std::make_unique<Program>(
          std::vector<std::string>{"/usr/bin/unshare", "--uts", "--net", "sh", "-c",
                                   "hostname " + machine + " && exec sleep infinity"},
          folder / ("host" + std::to_string(i) + ".log")));
      const std::string pid = std::to_string(holders_.back()->pid()), port = port_of(i);
      wait_for_own_network(holders_.back()->pid());
      run("ip link add " + port + " type veth peer name eth0 netns " + pid);
      run("ip link set " + port + " master switch up");
      run_in(i, "ip link set lo up");
      run_in(i, "ip address add " + address(i) + "/24 dev eth0");
      run_in(i, "ip link set eth0 up");
      run_in(i, "sh -c 'grep ^net.ipv4 " FIVEPIPE_SOURCE_DIR
                "/launch/installed/05-fivepipe.conf | sysctl -q -p -'");
    }
  }

  // Empty if the hosts exist.
  const std::string& why_not() const { return why_not_; }
  static std::string address(int host) { return "10.77.0." + std::to_string(host + 1); }
  static inline const std::string kObserver = "10.77.0.254";
  // The words of a program that runs on the host.
  std::vector<std::string> in(int host, std::vector<std::string> words) const {
    words.insert(words.begin(),
                 {"/usr/bin/nsenter", "--target",
                  std::to_string(holders_.at(std::size_t(host))->pid()), "--uts", "--net"});
    return words;
  }
  // Moves the calling thread, and the threads and processes that it starts from then on, into the
  // network of the host. Returns false if that fails.
  bool enter(int host) const {
    const std::string network =
        "/proc/" + std::to_string(holders_.at(std::size_t(host))->pid()) + "/ns/net";
    const int network_fd = open(network.c_str(), O_RDONLY | O_CLOEXEC);
    const bool is_entered = network_fd >= 0 && setns(network_fd, CLONE_NEWNET) == 0;
    if (network_fd >= 0) close(network_fd);
    return is_entered;
  }
  // Gives the host a further address.
  void add_address(int host, const std::string& further) {
    run_in(host, "ip address add " + further + "/24 dev eth0");
  }
  // As if the network adapter of the host was unplugged.
  void remove_interface(int host) { run("ip link delete " + port_of(host)); }
  // From now on, the host loses one of `packets` packets that it receives, at random.
  void lose_one_in(int packets, int host) {
    run_in(host, "nft add table ip losses");
    run_in(host, "nft 'add chain ip losses received { type filter hook input priority 0; }'");
    run_in(host, "nft add rule ip losses received iif eth0 numgen random mod " +
                     std::to_string(packets) + " == 0 counter drop");
  }
  // From now on, no multicast reaches the host.
  void drop_multicast(int host) {
    run_in(host, "nft add table ip multicast");
    run_in(host, "nft 'add chain ip multicast received { type filter hook input priority 0; }'");
    run_in(host, "nft add rule ip multicast received ip daddr 224.0.0.0/4 drop");
  }
  // From now on, the host receives no UDP packets to this port, as behind a firewall.
  void drop_udp(int host, int port) {
    add_to_firewall(host, "udp dport " + std::to_string(port) + " drop");
  }
  // From now on, the host loses those to this port that routers may fragment.
  void drop_fragmentable(int host, int port) {
    add_to_firewall(host,
                    "ip frag-off and 0x4000 == 0 udp dport " + std::to_string(port) + " drop");
  }
  // From now on, the host's firewall refuses what it receives, and says so.
  void refuse_all(int host) {
    add_to_firewall(host, "ip protocol { tcp, udp } reject with icmp type host-prohibited");
  }
  // From now on, each program of the host may send ICMP echo requests.
  void allow_echo(int host) {
    run_in(host, "sh -c 'echo 0 2147483647 >/proc/sys/net/ipv4/ping_group_range'");
  }
  // The packets that the host has lost.
  int lost(int host) const {
    const std::string text =
        output_of("nsenter --target " + std::to_string(holders_.at(std::size_t(host))->pid()) +
                  " --net nft list table ip losses");
    const std::size_t at = text.find("counter packets ");
    return at == std::string::npos ? 0 : std::atoi(text.c_str() + at + 16);
  }
  // From now on, the host sends, and receives, at most this rate, such as "1gbit". The burst is
  // more than such a link sends between two ticks of a kernel with 250 Hz; with less, tbf does not
  // reach the rate.
  void limit_rate(int host, const std::string& rate) {
    const std::string limit = " root tbf rate " + rate + " burst 1mb latency 50ms";
    run_in(host, "tc qdisc replace dev eth0" + limit);
    run("tc qdisc replace dev " + port_of(host) + limit);
  }
  struct Traffic {
    std::int64_t sent_bytes = 0, received_bytes = 0;  // with the headers of Ethernet
  };
  // What the host's interface has carried since it exists.
  Traffic traffic(int host) const {
    const nlohmann::json link =
        nlohmann::json::parse(output_of("ip -s -j link show " + port_of(host)))[0]["stats64"];
    return {link["rx"]["bytes"], link["tx"]["bytes"]};
  }
  // The largest IP packets of the host's interface.
  void set_mtu(int host, int bytes) {
    run_in(host, "ip link set eth0 mtu " + std::to_string(bytes));
  }
  // As in a network with jumbo frames: of all hosts and of the switch.
  void set_mtu_of_all(int bytes) {
    for (std::size_t host = 0; host < holders_.size(); ++host) {
      run("ip link set " + port_of(int(host)) + " mtu " + std::to_string(bytes));
      set_mtu(int(host), bytes);
    }
    run("ip link set switch mtu " + std::to_string(bytes));
  }
  void set_link(int host, bool is_up) {
    run("ip link set " + port_of(host) + (is_up ? " up" : " down"));
  }

 private:
  void add_to_firewall(int host, const std::string& rule) {
    run_in(host, "nft add table ip firewall");
    run_in(host, "nft 'add chain ip firewall received { type filter hook input priority 0; }'");
    run_in(host, "nft 'add rule ip firewall received " + rule + "'");
  }
  static std::string output_of(const std::string& command) {
    return shell(command + " 2>/dev/null").text;
  }
  static std::string port_of(int host) { return "port" + std::to_string(host); }
  void run(const std::string& command) {
    if (why_not_.empty() && std::system((command + " >/dev/null 2>&1").c_str()) != 0)
      why_not_ = "failed: " + command;
  }
  void run_in(int host, const std::string& command) {
    run("nsenter --target " + std::to_string(holders_[std::size_t(host)]->pid()) + " --net " +
        command);
  }
  static void wait_for_own_network(pid_t pid) {
    const auto network = [](const std::string& process) {
      std::error_code error;
      return std::filesystem::read_symlink("/proc/" + process + "/ns/net", error);
    };
    for (int i = 0; i < 1000; ++i) {
      const auto theirs = network(std::to_string(pid));
      if (!theirs.empty() && theirs != network("thread-self")) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }

  std::string why_not_;
  std::vector<std::unique_ptr<Program>> holders_;
};

}  // namespace fivepipe::test
