// Gives the spacings of the objects to a restarted sim_node. Spacings live in sim_node, which
// begins with those of the scene.
#pragma once
#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

namespace fivepipe::launch {

// What SpacingKeeper takes from an ObjectSpacing.
struct SeenSpacing {
  std::string object;
  double spacing_m = 0;
  bool requested = false;    // false: that of the scene, with which sim_node began
  std::uint64_t writer = 0;  // of its process
};

// Remembers the requested spacings.
class SpacingKeeper {
 public:
  using Clock = std::chrono::steady_clock;

  void add(const SeenSpacing& seen);
  // Returns the newest requested spacings [m], by object, for the start of a sim_node on this host.
  // The next writer's first spacing confirms them; it is not a newer request.
  std::map<std::string, double> for_start();
  // Returns the spacings [m] to request now, by object: those that a restarted sim_node does not
  // have, because another process started it, or because the request became known after
  // for_start(). Each at most every kRepeat, because a request may precede the discovery of its
  // reader.
  std::map<std::string, double> due(Clock::time_point now);

  static constexpr std::chrono::milliseconds kRepeat{200};

 private:
  struct Object {
    double requested_m = 0;
    std::uint64_t writer = 0;  // of the newest message
    bool is_lost = false;
    std::optional<double> given_m = {};  // to a process that has not answered yet
    std::optional<Clock::time_point> asked = {};
  };
  std::map<std::string, Object> objects_;  // those with a request
};

}  // namespace fivepipe::launch
