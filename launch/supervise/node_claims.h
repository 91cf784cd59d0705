// Prevents two deployments on one machine from running nodes of the same name in one DDS domain.
#pragma once
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace fivepipe::launch {

struct NodeNameTaken : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Holds the names until its destruction or the end of the process. A claim is a listening socket in
// the kernel's abstract namespace. It leaves no file behind. Like the loopback interface, it is
// visible to all users and containers of the same network namespace.
class NodeClaims {
 public:
  // Throws NodeNameTaken, which lists each claimed name with the process that holds it.
  NodeClaims(std::uint32_t domain, const std::vector<std::string>& nodes);
  ~NodeClaims();
  NodeClaims(const NodeClaims&) = delete;
  NodeClaims& operator=(const NodeClaims&) = delete;

 private:
  void release();
  std::vector<int> sockets_;
};

}  // namespace fivepipe::launch
