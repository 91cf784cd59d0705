// The keys by which an experimenter moves a part of the scene: up and down change its spacing by
// 5 mm, with Shift by 1 mm; Tab selects the next part.
#pragma once
#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "common/config/scene.h"
#include "render_node/output/window.h"

namespace fivepipe::render {

inline constexpr double kKeyStep_m = 0.005, kFineKeyStep_m = 0.001;

class SpacingKeys {
 public:
  using Clock = std::chrono::steady_clock;

  // At least one object of the scene must have a spacing.
  explicit SpacingKeys(const config::Scene& scene);

  // The simulation has this spacing of an object. Ignores an unknown object and a number that is
  // not finite.
  void set(const std::string& object, double spacing_m, Clock::time_point now);

  struct Request {
    std::string object;
    double spacing_m;
  };
  // Returns the spacing to request; nullopt if the key selects a part, if the part's spacing is not
  // known yet, or if it is at the end of its range. Keys in quick succession add up, also before
  // the simulation has answered.
  std::optional<Request> press(const KeyPress& press, Clock::time_point now);

  // "payload_a: 18.5 cm", the selected part.
  std::string title() const;

 private:
  struct Part {
    std::string name;
    config::Spacing range;
    std::optional<double> shown_m = {};   // that of the simulation
    std::optional<double> wanted_m = {};  // that of the last request
    Clock::time_point asked = {};
  };
  std::vector<Part> parts_;
  std::size_t selected_ = 0;
};

}  // namespace fivepipe::render
