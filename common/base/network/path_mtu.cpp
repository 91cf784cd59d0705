#include "common/base/network/path_mtu.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/ip.h>
#include <netinet/udp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <vector>

namespace fivepipe::base {
namespace {

// "discard", which no usual system serves any more.
constexpr std::uint16_t kPort = 9;
// The kernel answers a burst of six such packets, then one per second, also for other programs that
// send to closed ports, as the discovery of DDS does.
constexpr int kRounds = 12, kPatience_ms = 300;
// So many small packets are answered before a large one counts as lost.
constexpr int kSmallAnswers = 3;
constexpr int kHeaders = sizeof(ip) + sizeof(udphdr);

class Socket {
 public:
  explicit Socket(const std::string& address)
      : handle_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(kPort);
    inet_pton(AF_INET, address.c_str(), &to.sin_addr);
    const int unfragmented = IP_PMTUDISC_DO;
    setsockopt(handle_, IPPROTO_IP, IP_MTU_DISCOVER, &unfragmented, sizeof unfragmented);
    is_connected_ = connect(handle_, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0;
  }
  ~Socket() { close(handle_); }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;

  int mtu() const {
    int bytes = 0;
    socklen_t size = sizeof bytes;
    return is_connected_ && getsockopt(handle_, IPPROTO_IP, IP_MTU, &bytes, &size) == 0 ? bytes : 0;
  }
  // Sends a packet of this size, headers included. Returns whether the machine refuses it.
  bool is_refused(int bytes) {
    if (bytes < kHeaders) return false;  // the route has disappeared
    const std::vector<char> payload(std::size_t(bytes - kHeaders));
    if (send(handle_, payload.data(), payload.size(), 0) < 0 && errno == ECONNREFUSED) return true;
    pollfd answer{handle_, POLLIN, 0};
    if (poll(&answer, 1, kPatience_ms) <= 0) return false;
    char none = 0;
    return recv(handle_, &none, sizeof none, 0) < 0 && errno == ECONNREFUSED;
  }

 private:
  int handle_;
  bool is_connected_ = false;
};

}  // namespace

PathMtu path_mtu(const std::string& address) {
  Socket socket(address);
  PathMtu found{socket.mtu()};
  if (found.bytes == 0) return found;
  int small_answers = 0;
  for (int i = 0; i < kRounds && !found.arrives && small_answers < kSmallAnswers; ++i) {
    // A router may report a smaller size, which the kernel remembers.
    found.arrives = socket.is_refused(socket.mtu());
    found.bytes = socket.mtu();
    if (!found.arrives) small_answers += socket.is_refused(kHeaders);
  }
  found.answers = found.arrives || small_answers == kSmallAnswers;
  return found;
}

}  // namespace fivepipe::base
