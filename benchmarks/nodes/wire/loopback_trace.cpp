#include "benchmarks/nodes/wire/loopback_trace.h"

#include <arpa/inet.h>
#include <linux/if_ether.h>
#include <linux/if_packet.h>
#include <net/if.h>
#include <netinet/ip.h>
#include <netinet/udp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <system_error>

namespace fivepipe::wire {
namespace {

// Room for about a second of the demo's traffic while the thread waits for a core.
constexpr int kBufferBytes = 64 << 20;
constexpr int kPollPeriod_ms = 20;

[[noreturn]] void fail(const char* what) {
  throw std::system_error(errno, std::generic_category(), what);
}

void set_option(int socket, int level, int option, int value) {
  if (setsockopt(socket, level, option, &value, sizeof value) != 0)
    fail("option of the packet socket");
}

int open_on_loopback() {
  const int opened = socket(AF_PACKET, SOCK_DGRAM | SOCK_CLOEXEC, htons(ETH_P_IP));
  if (opened < 0) fail("packet socket");
  try {
    // Without CAP_NET_ADMIN the kernel limits the buffer; dropped() then shows the losses.
    if (setsockopt(opened, SOL_SOCKET, SO_RCVBUFFORCE, &kBufferBytes, sizeof kBufferBytes) != 0)
      set_option(opened, SOL_SOCKET, SO_RCVBUF, kBufferBytes);
    set_option(opened, SOL_SOCKET, SO_TIMESTAMPNS, 1);
    sockaddr_ll address{};
    address.sll_family = AF_PACKET;
    address.sll_protocol = htons(ETH_P_IP);
    address.sll_ifindex = int(if_nametoindex("lo"));
    if (bind(opened, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
      fail("packet socket on interface lo");
  } catch (...) {
    close(opened);
    throw;
  }
  return opened;
}

std::int64_t stamp_of(msghdr& message) {
  for (cmsghdr* control = CMSG_FIRSTHDR(&message); control;
       control = CMSG_NXTHDR(&message, control))
    if (control->cmsg_level == SOL_SOCKET && control->cmsg_type == SCM_TIMESTAMPNS) {
      timespec stamp{};
      std::memcpy(&stamp, CMSG_DATA(control), sizeof stamp);
      return std::int64_t(stamp.tv_sec) * 1'000'000'000 + stamp.tv_nsec;
    }
  return 0;
}

}  // namespace

LoopbackTrace::LoopbackTrace(std::function<void(const Datagram&)> each)
    : socket_(open_on_loopback()),
      thread_(
          [this, each = std::move(each)](const std::stop_token& stop) { receive(each, stop); }) {}

LoopbackTrace::~LoopbackTrace() {
  stop();
  close(socket_);
}

void LoopbackTrace::stop() {
  if (!thread_.joinable()) return;
  thread_.request_stop();
  thread_.join();
  tpacket_stats statistics{};
  socklen_t size = sizeof statistics;
  if (getsockopt(socket_, SOL_PACKET, PACKET_STATISTICS, &statistics, &size) == 0)
    dropped_ = statistics.tp_drops;
}

void LoopbackTrace::receive(const std::function<void(const Datagram&)>& each,
                            const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    pollfd waiting{socket_, POLLIN, 0};
    if (poll(&waiting, 1, kPollPeriod_ms) > 0)
      while (receive_one(each, MSG_DONTWAIT)) continue;
  }
  while (receive_one(each, MSG_DONTWAIT)) continue;
}

// Returns false if no datagram is queued.
bool LoopbackTrace::receive_one(const std::function<void(const Datagram&)>& each, int flags) {
  constexpr std::size_t kMaxIpOptions = 40;
  std::array<std::byte, sizeof(ip) + kMaxIpOptions + sizeof(udphdr) + kMaxPayloadBytes> bytes;
  alignas(cmsghdr) std::array<char, 256> control;
  iovec buffer{bytes.data(), bytes.size()};
  msghdr message{};
  message.msg_iov = &buffer;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const ssize_t received = recvmsg(socket_, &message, flags);
  if (received < 0) return false;
  ip header;
  udphdr udp;
  if (std::size_t(received) < sizeof header) return true;
  std::memcpy(&header, bytes.data(), sizeof header);
  const std::size_t header_bytes = std::size_t(header.ip_hl) * 4;
  if (header.ip_p != IPPROTO_UDP || std::size_t(received) < header_bytes + sizeof udp) return true;
  std::memcpy(&udp, bytes.data() + header_bytes, sizeof udp);
  const auto payload = std::span<const std::byte>(bytes.data(), std::size_t(received))
                           .subspan(header_bytes + sizeof udp);
  each({stamp_of(message), ntohs(udp.dest),
        payload.first(std::min(payload.size(), kMaxPayloadBytes))});
  return true;
}

}  // namespace fivepipe::wire
