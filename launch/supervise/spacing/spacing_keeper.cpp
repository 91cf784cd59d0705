#include "launch/supervise/spacing/spacing_keeper.h"

namespace fivepipe::launch {

void SpacingKeeper::add(const SeenSpacing& seen) {
  const auto known = objects_.find(seen.object);
  if (known == objects_.end()) {
    if (seen.requested)
      objects_[seen.object] = {.requested_m = seen.spacing_m, .writer = seen.writer};
    return;
  }
  Object& object = known->second;
  const bool is_successor = object.given_m && seen.writer != object.writer;
  if (!seen.requested || (is_successor && seen.spacing_m == *object.given_m)) {
    object.is_lost = object.requested_m != seen.spacing_m;
  } else {
    object.requested_m = seen.spacing_m;
    object.is_lost = false;
    object.asked.reset();
  }
  if (object.given_m && !is_successor) return;  // late, of the process before
  object.given_m.reset();
  object.writer = seen.writer;
}

std::map<std::string, double> SpacingKeeper::for_start() {
  std::map<std::string, double> given;
  for (auto& [name, object] : objects_) object.given_m = given[name] = object.requested_m;
  return given;
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
