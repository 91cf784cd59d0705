// A network of the test's own, with nothing but the loopback interface.
#pragma once
#include <arpa/inet.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstring>
#include <string>
#include <vector>

namespace fivepipe::test {

// Moves the calling thread, and the threads and processes that it starts from then on, into a new
// network with these loopback addresses. The network ends with its last process. Returns false if
// the system does not allow it, which needs CAP_SYS_ADMIN.
inline bool enter_own_network(const std::vector<std::string>& addresses) {
  if (unshare(CLONE_NEWNET) != 0) return false;
  const int socket_fd = socket(AF_INET, SOCK_DGRAM, 0);
  bool is_good = socket_fd >= 0;
  for (std::size_t i = 0; is_good && i < addresses.size(); ++i) {
    ifreq request{};
    std::strncpy(request.ifr_name, (i == 0 ? "lo" : "lo:" + std::to_string(i)).c_str(),
                 IFNAMSIZ - 1);
    auto* const address = reinterpret_cast<sockaddr_in*>(&request.ifr_addr);
    address->sin_family = AF_INET;
    is_good = inet_pton(AF_INET, addresses[i].c_str(), &address->sin_addr) == 1 &&
              ioctl(socket_fd, SIOCSIFADDR, &request) == 0;
    request.ifr_flags = IFF_UP | IFF_RUNNING | IFF_LOOPBACK;
    is_good = is_good && ioctl(socket_fd, SIOCSIFFLAGS, &request) == 0;
  }
  if (socket_fd >= 0) close(socket_fd);
  return is_good;
}

}  // namespace fivepipe::test
