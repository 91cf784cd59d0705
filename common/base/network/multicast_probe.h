// Finds out whether multicast passes between machines.
#pragma once
#include <cstddef>
#include <set>
#include <string>

namespace fivepipe::base {

// Joins the group of the network profile `lan`. Sends and receives short texts. Never waits.
class MulticastProbe {
 public:
  // interface: name or IPv4 address of this machine's. text: what the others hear, at most 200
  // characters.
  MulticastProbe(const std::string& interface, std::string text);
  ~MulticastProbe();
  MulticastProbe(const MulticastProbe&) = delete;
  MulticastProbe& operator=(const MulticastProbe&) = delete;

  // Sends the text, and takes those of others.
  void step();
  // The texts heard so far, at most kMaxHeard different ones.
  const std::set<std::string>& heard() const { return heard_; }
  static constexpr std::size_t kMaxHeard = 256;

 private:
  int socket_;
  std::string text_;
  std::set<std::string> heard_;
};

}  // namespace fivepipe::base
