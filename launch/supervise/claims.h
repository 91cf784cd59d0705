// Prevents two deployments on one machine from running nodes of the same name in one DDS domain,
// and from writing their results into one folder.
#pragma once
#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

namespace fivepipe::launch {

// Another process holds the claim. what() names it and what to do.
struct ClaimRefused : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Holds the names until its destruction or the end of the process. A claim is a listening socket in
// the kernel's abstract namespace. It leaves no file behind. Like the loopback interface, it is
// visible to all users and containers of the same network namespace.
class NodeClaims {
 public:
  // Throws ClaimRefused, which lists each claimed name with the process that holds it.
  NodeClaims(std::uint32_t domain, const std::vector<std::string>& nodes);
  ~NodeClaims();
  NodeClaims(const NodeClaims&) = delete;
  NodeClaims& operator=(const NodeClaims&) = delete;

 private:
  void release();
  std::vector<int> sockets_;
};

// Holds a folder until its destruction or the end of the process, whatever path names it. A claim
// is a lock of the folder itself (flock). It leaves no file behind and is visible in all containers
// that share the folder.
class FolderClaim {
 public:
  // The folder must exist. Throws ClaimRefused if another deployment writes to it, and
  // std::system_error if it cannot be opened.
  explicit FolderClaim(const std::filesystem::path& folder);
  ~FolderClaim();
  FolderClaim(const FolderClaim&) = delete;
  FolderClaim& operator=(const FolderClaim&) = delete;

  // Why the folder is not locked although the claim was granted: its file system has no locks.
  // Empty if it is locked.
  const std::string& warning() const { return warning_; }

 private:
  int folder_ = -1;
  std::string warning_;
};

}  // namespace fivepipe::launch
