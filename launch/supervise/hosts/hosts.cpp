#include "launch/supervise/hosts/hosts.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <set>

#include "common/base/machine.h"

namespace fivepipe::launch {
namespace {

constexpr std::uint16_t kUnusedPort = 9;  // "discard", which current systems do not offer

}  // namespace

std::vector<config::Node> nodes_of_host(const config::Deployment& deployment,
                                        const std::string& requested_host) {
  const std::string host =
      !deployment.hosts.empty()
          ? config::own_host(deployment.hosts, requested_host, deployment.file).name
      : requested_host.empty() ? base::host_name()
                               : requested_host;
  std::vector<config::Node> here;
  std::set<std::string> hosts;
  for (const config::Node& node : deployment.nodes) {
    if (!node.host.empty()) hosts.insert(node.host);
    if (node.host.empty() ? requested_host.empty() : node.host == host) here.push_back(node);
  }
  if (!here.empty()) return here;
  throw config::ConfigError(
      {{deployment.file, 0, 0,
        fmt::format("no node for host '{}'; choose one of the deployment's hosts with --host: {}",
                    host, hosts.empty() ? "none" : fmt::format("{}", fmt::join(hosts, ", ")))}});
}

HostProbe::HostProbe(const std::string& address) {
  to_.sin_family = AF_INET;
  to_.sin_port = htons(kUnusedPort);
  inet_pton(AF_INET, address.c_str(), &to_.sin_addr);
}

HostProbe::~HostProbe() { hang_up(); }

void HostProbe::hang_up() {
  if (socket_ >= 0) close(socket_);
  socket_ = -1;
}

void HostProbe::ask() {
  hang_up();
  socket_ = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  const bool connected = connect(socket_, reinterpret_cast<const sockaddr*>(&to_), sizeof to_) == 0;
  error_ = connected ? 0 : errno;
  is_ended_ = has_answered_ = false;
}

HostProbe::Answer HostProbe::take_answer() {
  // connect() returns the lack of a route at once; the same error later means that no machine has
  // the address.
  if (error_ == ENETUNREACH || error_ == EHOSTUNREACH) return Answer::no_route;
  pollfd ended{socket_, POLLOUT, 0};
  if (!is_ended_ && poll(&ended, 1, 0) > 0) {
    is_ended_ = true;
    // The kernel returns the error of the connection only once.
    int error = 0;
    socklen_t size = sizeof error;
    has_answered_ = getsockopt(socket_, SOL_SOCKET, SO_ERROR, &error, &size) == 0 &&
                    (error == 0 || error == ECONNREFUSED);
  }
  return has_answered_ ? Answer::answers : Answer::none;
}

OtherHosts::OtherHosts(const config::Deployment& deployment,
                       const std::vector<config::Node>& own_nodes) {
  for (const config::Host& host : deployment.hosts) {
    Host other{host, {}, nullptr};
    for (const config::Node& node : deployment.nodes)
      if (node.host == host.name &&
          std::none_of(own_nodes.begin(), own_nodes.end(),
                       [&](const config::Node& own) { return own.name == node.name; }))
        other.nodes.push_back(node.name);
    if (other.nodes.empty()) continue;
    other.probe = std::make_unique<HostProbe>(host.address);
    other.probe->ask();
    hosts_.push_back(std::move(other));
  }
}

std::vector<std::string> OtherHosts::missing(const StatusRegistry& statuses) {
  std::vector<std::string> texts;
  for (Host& other : hosts_) {
    if (!is_missing(other, statuses)) continue;
    // One answer may be late or lost.
    const auto answer = other.probe->take_answer();
    other.unanswered = answer == HostProbe::Answer::none ? other.unanswered + 1 : 0;
    if (answer != HostProbe::Answer::none || other.unanswered > 1) other.answer = answer;
    other.probe->ask();
    const char* what = "";
    switch (other.answer) {
      case HostProbe::Answer::answers:
        what = "the machine answers, but none of its nodes: run `fivepipe up` there";
        break;
      case HostProbe::Answer::no_route:
        what = "this machine has no route to its address: is an interface in its network up?";
        break;
      case HostProbe::Answer::none:
        what =
            "no answer: it is off or unplugged, it has another address, or a firewall drops the "
            "request";
        break;
    }
    texts.push_back(
        fmt::format("waiting for host {} ({}): {}", other.host.name, other.host.address, what));
  }
  return texts;
}

bool OtherHosts::is_on_missing_host(const config::Node& node,
                                    const StatusRegistry& statuses) const {
  return std::any_of(hosts_.begin(), hosts_.end(), [&](const Host& other) {
    return std::ranges::count(other.nodes, node.name) > 0 && is_missing(other, statuses);
  });
}

bool OtherHosts::is_missing(const Host& host, const StatusRegistry& statuses) {
  return std::none_of(host.nodes.begin(), host.nodes.end(),
                      [&](const std::string& node) { return statuses.newest(node) != nullptr; });
}

}  // namespace fivepipe::launch
