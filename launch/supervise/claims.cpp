#include "launch/supervise/claims.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
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

std::string process_text(pid_t pid) {
  return pid > 0 ? "process " + std::to_string(pid) : "another process";
}

std::string holder_of(const Address& address) {
  const int fd = new_socket();
  ucred holder{};
  socklen_t size = sizeof holder;
  const bool known = connect(fd, address.get(), address.length) == 0 &&
                     getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &holder, &size) == 0 && holder.pid > 0;
  close(fd);
  return process_text(known ? holder.pid : 0);
}

// Returns the process that holds the lock of the open file; 0 if it is in another PID namespace.
pid_t lock_holder(int file) {
  struct stat of_file {};
  if (fstat(file, &of_file) != 0) return 0;
  // "1: FLOCK  ADVISORY  WRITE 4711 fe:00:1234 0 EOF". Some file systems show another device than
  // stat() does, so the inode identifies the lock.
  const std::string inode = ":" + std::to_string(of_file.st_ino);
  std::ifstream locks("/proc/locks");
  for (std::string line; std::getline(locks, line);) {
    std::istringstream words(line);
    std::string number, kind, mode, access, device_and_inode;
    pid_t pid = 0;
    if (words >> number >> kind >> mode >> access >> pid >> device_and_inode && kind == "FLOCK" &&
        device_and_inode.ends_with(inode))
      return pid;
  }
  return 0;
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
  throw ClaimRefused(taken + "Stop that deployment or choose another --domain.");
}

NodeClaims::~NodeClaims() { release(); }

void NodeClaims::release() {
  for (const int fd : sockets_) close(fd);
  sockets_.clear();
}

FolderClaim::FolderClaim(const std::filesystem::path& folder)
    : folder_(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  if (folder_ < 0)
    throw std::system_error(errno, std::generic_category(), "cannot open " + folder.string());
  if (flock(folder_, LOCK_EX | LOCK_NB) == 0) return;
  if (errno != EWOULDBLOCK) {
    warning_ = "cannot lock " + folder.string() + " (" + std::strerror(errno) +
               "): start no other deployment with this folder";
    return;
  }
  const std::string holder = process_text(lock_holder(folder_));
  close(folder_);
  throw ClaimRefused("another deployment, started by " + holder + ", writes its results to " +
                     folder.string() + "\nStop that deployment or choose another --out.");
}

FolderClaim::~FolderClaim() { close(folder_); }

}  // namespace fivepipe::launch
