#include "launch/supervise/node_claims.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

namespace fivepipe::launch {
namespace {

struct Address {
  sockaddr_un raw{};
  socklen_t length = 0;
  const sockaddr* get() const { return reinterpret_cast<const sockaddr*>(&raw); }
};

Address address_of(std::uint32_t domain, const std::string& node) {
  // A leading zero byte makes the name abstract.
  const std::string name = "fivepipe/domain-" + std::to_string(domain) + "/" + node;
  Address address;
  address.raw.sun_family = AF_UNIX;
  const std::size_t size = std::min(name.size(), sizeof address.raw.sun_path - 1);
  std::copy_n(name.begin(), size, address.raw.sun_path + 1);
  address.length = socklen_t(offsetof(sockaddr_un, sun_path) + 1 + size);
  return address;
}

int new_socket() {
  const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) throw std::system_error(errno, std::generic_category(), "socket");
  return fd;
}

std::string holder_of(const Address& address) {
  const int fd = new_socket();
  ucred holder{};
  socklen_t size = sizeof holder;
  const bool known = connect(fd, address.get(), address.length) == 0 &&
                     getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &holder, &size) == 0 && holder.pid > 0;
  close(fd);
  return known ? "process " + std::to_string(holder.pid) : "another process";
}

}  // namespace

NodeClaims::NodeClaims(std::uint32_t domain, const std::vector<std::string>& nodes) {
  std::string taken;
  for (const std::string& node : nodes) {
    const Address address = address_of(domain, node);
    const int fd = new_socket();
    sockets_.push_back(fd);
    if (bind(fd, address.get(), address.length) == 0 && listen(fd, 8) == 0) continue;
    taken += "node '" + node + "' already runs in domain " + std::to_string(domain) +
             ", started by " + holder_of(address) + "\n";
  }
  if (taken.empty()) return;
  release();
  throw NodeNameTaken(taken + "Stop that deployment or choose another --domain.");
}

NodeClaims::~NodeClaims() { release(); }

void NodeClaims::release() {
  for (const int fd : sockets_) close(fd);
  sockets_.clear();
}

}  // namespace fivepipe::launch
