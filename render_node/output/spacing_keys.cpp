#include "render_node/output/spacing_keys.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace fivepipe::render {
namespace {

// After this time without a key, the simulation's spacing is the base of the next step.
constexpr auto kAnswerTime = std::chrono::seconds(1);

}  // namespace

SpacingKeys::SpacingKeys(const config::Scene& scene) {
  for (const config::SceneObject& object : scene.objects)
    if (object.spacing) parts_.push_back({object.name, *object.spacing});
  assert(!parts_.empty());
}

void SpacingKeys::set(const std::string& object, double spacing_m, Clock::time_point now) {
  for (Part& part : parts_) {
    if (part.name != object || !std::isfinite(spacing_m)) continue;
    part.shown_m = spacing_m;
    if (now - part.asked > kAnswerTime) part.wanted_m.reset();
  }
}

std::optional<SpacingKeys::Request> SpacingKeys::press(const KeyPress& press,
                                                       Clock::time_point now) {
  if (press.key == KeyPress::Key::next) {
    selected_ = (selected_ + 1) % parts_.size();
    return std::nullopt;
  }
  Part& part = parts_[selected_];
  if (!part.shown_m) return std::nullopt;
  const bool adds_up = part.wanted_m && now - part.asked <= kAnswerTime;
  const double before_m = adds_up ? *part.wanted_m : *part.shown_m,
               step_m = press.shift ? kFineKeyStep_m : kKeyStep_m;
  const double wanted_m = std::clamp(before_m + (press.key == KeyPress::Key::up ? step_m : -step_m),
                                     part.range.low_m, part.range.high_m);
  if (wanted_m == before_m) return std::nullopt;
  part.wanted_m = wanted_m;
  part.asked = now;
  return Request{part.name, wanted_m};
}

std::string SpacingKeys::title() const {
  const Part& part = parts_[selected_];
  constexpr double kCmPerM = 100;
  return part.shown_m ? fmt::format("{}: {:.1f} cm", part.name, kCmPerM * *part.shown_m)
                      : part.name;
}

}  // namespace fivepipe::render
