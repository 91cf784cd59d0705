// Gives the spacings of the objects to a restarted sim_node. Spacings live in sim_node, which
// begins with those of the scene.
#pragma once
#include <chrono>
#include <map>
#include <optional>
#include <string>

namespace fivepipe::launch {

// What SpacingKeeper takes from an ObjectSpacing.
struct SeenSpacing {
  std::string object;
  double spacing_m = 0;
  bool requested = false;  // false: that with which sim_node began
};

// Remembers the requested spacings.
class SpacingKeeper {
 public:
  using Clock = std::chrono::steady_clock;

  void add(const SeenSpacing& seen);
  // Returns the newest requested spacings [m], by object, for the start of a sim_node on this host.
  std::map<std::string, double> requested() const;
  // For a sim_node that another process started. Returns the spacings [m] to request now, by
  // object: those that a restarted sim_node does not have yet, each at most every kRepeat, because
  // a request may precede the discovery of its reader.
  std::map<std::string, double> due(Clock::time_point now);

  static constexpr std::chrono::milliseconds kRepeat{200};

 private:
  struct Object {
    double requested_m = 0;
    bool is_lost = false;
    std::optional<Clock::time_point> asked = {};
  };
  std::map<std::string, Object> objects_;  // those with a request
};

}  // namespace fivepipe::launch
