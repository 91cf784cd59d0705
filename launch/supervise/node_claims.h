// Keeps two deployments on one machine from running nodes of the same name in the same DDS domain.
#pragma once
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace fivepipe::launch {

struct NodeNameTaken : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Holds the names until destroyed, or until the process dies however it dies. A claim is a
// listening socket in the kernel's abstract namespace: no file is left behind, and it reaches
// exactly as far as the loopback interface, over users and containers.
class NodeClaims {
 public:
  // Throws NodeNameTaken listing every name that is taken and by which process.
  NodeClaims(std::uint32_t domain, const std::vector<std::string>& nodes);
  ~NodeClaims();
  NodeClaims(const NodeClaims&) = delete;
  NodeClaims& operator=(const NodeClaims&) = delete;

 private:
  void release();
  std::vector<int> sockets_;
};

}  // namespace fivepipe::launch
