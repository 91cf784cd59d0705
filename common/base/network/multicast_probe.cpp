#include "common/base/network/multicast_probe.h"

#include <arpa/inet.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <utility>

#include "common/base/network/network_interfaces.h"

namespace fivepipe::base {
namespace {

constexpr const char* kGroup = "239.255.80.80";  // launch/profiles/lan.xml
constexpr std::uint16_t kProbePort = 7398;       // below those of DDS
constexpr std::size_t kMaxText = 200;

sockaddr_in group() {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(kProbePort);
  inet_pton(AF_INET, kGroup, &address.sin_addr);
  return address;
}

}  // namespace

MulticastProbe::MulticastProbe(const std::string& interface, std::string text)
    : socket_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)),
      text_(std::move(text)) {
  text_.resize(std::min(text_.size(), kMaxText));
  const int on = 1;
  setsockopt(socket_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in own = group();
  // Otherwise it hears nothing.
  if (bind(socket_, reinterpret_cast<const sockaddr*>(&own), sizeof own) != 0) return;
  ip_mreqn membership{};
  membership.imr_multiaddr = own.sin_addr;
  membership.imr_ifindex = int(if_nametoindex(find_interface(interface).name.c_str()));
  setsockopt(socket_, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership);
  setsockopt(socket_, IPPROTO_IP, IP_MULTICAST_IF, &membership, sizeof membership);
}

MulticastProbe::~MulticastProbe() { close(socket_); }

void MulticastProbe::step() {
  const sockaddr_in to = group();
  // A text that is lost is sent again by the next call.
  sendto(socket_, text_.data(), text_.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
  char text[kMaxText];
  for (ssize_t n; (n = recv(socket_, text, sizeof text, 0)) >= 0;)
    if (heard_.size() < kMaxHeard) heard_.emplace(text, std::size_t(n));
}

}  // namespace fivepipe::base
