#include "common/pipeline/bus/shutdown/receiver_wakeup.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <vector>

namespace fivepipe::bus::detail {
namespace {

// More than Cyclone DDS needs while the network exists.
constexpr std::chrono::milliseconds kDelay{100}, kPeriod{50};

// The ports of the UDP sockets of this process that are bound to no address, in network byte order.
std::vector<in_port_t> open_ports() {
  std::vector<in_port_t> ports;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd", error)) {
    const int file = std::atoi(entry.path().filename().c_str());
    int type = 0;
    socklen_t size = sizeof type;
    if (getsockopt(file, SOL_SOCKET, SO_TYPE, &type, &size) != 0 || type != SOCK_DGRAM) continue;
    sockaddr_in address{};
    size = sizeof address;
    if (getsockname(file, reinterpret_cast<sockaddr*>(&address), &size) == 0 &&
        address.sin_family == AF_INET && address.sin_addr.s_addr == htonl(INADDR_ANY) &&
        address.sin_port != 0)
      ports.push_back(address.sin_port);
  }
  return ports;
}

void send_datagrams() {
  const int from = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (from < 0) return;
  for (const in_port_t port : open_ports()) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    to.sin_port = port;
    // Shorter than any message, so it is ignored. The next round repeats a datagram that is lost.
    constexpr char kByte = 0;
    (void)!sendto(from, &kByte, sizeof kByte, MSG_DONTWAIT, reinterpret_cast<const sockaddr*>(&to),
                  sizeof to);
  }
  close(from);
}

}  // namespace

ReceiverWakeup::ReceiverWakeup() : thread_([this] { run(); }) {}

ReceiverWakeup::~ReceiverWakeup() {
  {
    const std::lock_guard lock(mutex_);
    done_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void ReceiverWakeup::run() {
  std::unique_lock lock(mutex_);
  const auto is_done = [this] { return done_; };
  for (auto pause = kDelay; !changed_.wait_for(lock, pause, is_done); pause = kPeriod)
    send_datagrams();
}

}  // namespace fivepipe::bus::detail
