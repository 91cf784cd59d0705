// The hosts of a deployment: the nodes of this one, and the others while none of their nodes has
// sent a status.
#pragma once
#include <netinet/in.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/config/deployment.h"
#include "launch/supervise/status/node_status.h"

namespace fivepipe::launch {

// Returns the nodes that run on `host`. An empty host means this machine: that of
// config::own_host() if the deployment names hosts; else its nodes are those that name it and those
// that name no host. Throws config::ConfigError if there is none.
std::vector<config::Node> nodes_of_host(const config::Deployment& deployment,
                                        const std::string& host);

// Asks a machine whether it is there: connects to a TCP port that no program uses, which the
// machine refuses. Not by UDP, because the kernel limits the rate of its answers to a host, and the
// discovery packets to the ports of nodes that do not run use them up. Never waits.
class HostProbe {
 public:
  explicit HostProbe(const std::string& address);  // IPv4
  ~HostProbe();
  HostProbe(const HostProbe&) = delete;
  HostProbe& operator=(const HostProbe&) = delete;
  void ask();
  enum class Answer { none, answers, no_route };
  // Returns the answer to the last request. `none` may mean that a firewall drops the request.
  Answer take_answer();

 private:
  void hang_up();

  int socket_ = -1;
  sockaddr_in to_{};
  int error_ = 0;  // of connect()
  bool is_ended_ = false, has_answered_ = false;
};

class OtherHosts {
 public:
  // own_nodes: those of this host.
  OtherHosts(const config::Deployment& deployment, const std::vector<config::Node>& own_nodes);
  // Returns a text for each host of which no node has sent a status, and asks these hosts again.
  std::vector<std::string> missing(const StatusRegistry& statuses);
  // Returns whether the node is on a host of which no node has sent a status.
  bool is_on_missing_host(const config::Node& node, const StatusRegistry& statuses) const;

 private:
  struct Host {
    config::Host host;
    std::vector<std::string> nodes;
    std::unique_ptr<HostProbe> probe;
    HostProbe::Answer answer = HostProbe::Answer::none;
    int unanswered = 0;  // questions, one after the other
  };
  static bool is_missing(const Host& host, const StatusRegistry& statuses);
  std::vector<Host> hosts_;
};

}  // namespace fivepipe::launch
