#include "common/base/network/path_mtu.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/ip.h>
#include <netinet/ip_icmp.h>
#include <netinet/udp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <vector>

namespace fivepipe::base {
namespace {

constexpr int kPatience_ms = 300;
// So many small packets are answered before a large one counts as lost.
constexpr int kSmallAnswers = 3;

// A socket that sends packets of any size to one machine, unfragmented.
class Socket {
 public:
  // port: 0 for ICMP.
  Socket(int protocol, const std::string& address, std::uint16_t port)
      : handle_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, protocol)) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(port);
    inet_pton(AF_INET, address.c_str(), &to.sin_addr);
    const int unfragmented = IP_PMTUDISC_DO;
    setsockopt(handle_, IPPROTO_IP, IP_MTU_DISCOVER, &unfragmented, sizeof unfragmented);
    is_connected_ = connect(handle_, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0;
  }
  ~Socket() {
    if (handle_ >= 0) close(handle_);
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;

  bool is_open() const { return handle_ >= 0; }
  // Of IP packets; 0: there is no route. A router may report a smaller size, which the kernel
  // remembers.
  int mtu() const {
    int bytes = 0;
    socklen_t size = sizeof bytes;
    return is_connected_ && getsockopt(handle_, IPPROTO_IP, IP_MTU, &bytes, &size) == 0 ? bytes : 0;
  }

 protected:
  bool send_out(const std::vector<char>& data) const {
    return send(handle_, data.data(), data.size(), 0) >= 0;
  }
  // Waits for an answer or an error. Returns the number of bytes in `data`, or -1 with errno.
  ssize_t answer(char* data, std::size_t size) const {
    pollfd ready{handle_, POLLIN, 0};
    errno = ETIMEDOUT;
    return poll(&ready, 1, kPatience_ms) > 0 ? recv(handle_, data, size, 0) : -1;
  }

 private:
  int handle_;
  bool is_connected_ = false;
};

// ICMP echo requests. A kernel answers each one. The system lets the groups of
// net.ipv4.ping_group_range open such a socket.
class Echo : public Socket {
 public:
  static constexpr int kHeaders = sizeof(ip) + sizeof(icmphdr), kLargePerSmall = 1, kRounds = 5;

  explicit Echo(const std::string& address) : Socket(IPPROTO_ICMP, address, 0) {}
  // bytes: of the packet, headers included.
  bool is_answered(int bytes) {
    if (bytes < kHeaders) return false;  // the route has disappeared
    icmphdr header{};                    // the kernel writes the identity and the checksum
    header.type = ICMP_ECHO;
    header.un.echo.sequence = htons(++sequence_);
    std::vector<char> data(std::size_t(bytes) - sizeof(ip));
    std::memcpy(data.data(), &header, sizeof header);
    if (!send_out(data)) return false;
    icmphdr reply{};
    // A late answer to an earlier request does not count.
    while (answer(reinterpret_cast<char*>(&reply), sizeof reply) == ssize_t(sizeof reply))
      if (reply.un.echo.sequence == header.un.echo.sequence) return true;
    return false;
  }

 private:
  std::uint16_t sequence_ = 0;
};

// UDP packets to a port that no program uses, which the machine refuses. Its kernel refuses a burst
// of six such packets, then one per second, also of other programs that send to closed ports, as
// the discovery of DDS does. The large packets of a round take longer than a second, so that they
// take most of the refusals if they arrive.
class Refusals : public Socket {
 public:
  static constexpr int kHeaders = sizeof(ip) + sizeof(udphdr), kLargePerSmall = 6, kRounds = 4;

  explicit Refusals(const std::string& address) : Socket(0, address, kPort) {}
  // bytes: of the packet, headers included.
  bool is_answered(int bytes) {
    if (bytes < kHeaders) return false;  // the route has disappeared
    if (!send_out(std::vector<char>(std::size_t(bytes - kHeaders))) && errno == ECONNREFUSED)
      return true;
    char none = 0;
    return answer(&none, sizeof none) < 0 && errno == ECONNREFUSED;
  }

 private:
  static constexpr std::uint16_t kPort = 9;  // "discard", which no usual system serves any more
};

template <class Probe>
PathMtu measure(Probe& probe) {
  PathMtu found{probe.mtu()};
  if (found.bytes == 0) return found;
  int small_answers = 0;
  for (int i = 0; i < Probe::kRounds && !found.arrives && small_answers < kSmallAnswers; ++i) {
    for (int large = 0; large < Probe::kLargePerSmall && !found.arrives; ++large) {
      found.arrives = probe.is_answered(probe.mtu());
      found.bytes = probe.mtu();
    }
    if (!found.arrives) small_answers += probe.is_answered(Probe::kHeaders);
  }
  found.answers = found.arrives || small_answers == kSmallAnswers;
  return found;
}

}  // namespace

PathMtu path_mtu(const std::string& address) {
  if (Echo echo(address); echo.is_open())
    if (const PathMtu found = measure(echo); found.answers || found.bytes == 0) return found;
  Refusals refusals(address);
  return measure(refusals);
}

}  // namespace fivepipe::base
