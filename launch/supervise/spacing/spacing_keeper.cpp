#include "launch/supervise/spacing/spacing_keeper.h"

namespace fivepipe::launch {

void SpacingKeeper::add(const SeenSpacing& seen) {
  if (seen.requested)
    objects_[seen.object] = {.requested_m = seen.spacing_m};
  else if (const auto known = objects_.find(seen.object); known != objects_.end())
    known->second.is_lost = known->second.requested_m != seen.spacing_m;
}

std::map<std::string, double> SpacingKeeper::requested() const {
  std::map<std::string, double> requested;
  for (const auto& [name, object] : objects_) requested[name] = object.requested_m;
  return requested;
}

std::map<std::string, double> SpacingKeeper::due(Clock::time_point now) {
  std::map<std::string, double> due;
  for (auto& [name, object] : objects_) {
    if (!object.is_lost || (object.asked && now - *object.asked < kRepeat)) continue;
    object.asked = now;
    due[name] = object.requested_m;
  }
  return due;
}

}  // namespace fivepipe::launch
