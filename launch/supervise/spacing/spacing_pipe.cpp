#include "launch/supervise/spacing/spacing_pipe.h"

#include <algorithm>

#include "common/pipeline/messages/wire_conversions.h"

namespace fivepipe::launch {

SpacingPipe::SpacingPipe(bus::Bus& bus, const config::Scene& scene) : scene_(scene) {
  if (!config::has_spacings(scene)) return;
  spacings_.emplace(bus.reader<bus::topics::ObjectSpacing>());
  requests_.emplace(bus.writer<bus::topics::SpacingRequest>());
}

void SpacingPipe::step() {
  if (!spacings_) return;
  for (const auto& sample : spacings_->take()) {
    if (!sample.valid()) continue;
    const bool is_known = std::any_of(scene_.objects.begin(), scene_.objects.end(),
                                      [&](const config::SceneObject& object) {
                                        return object.name == sample->object && object.spacing &&
                                               object.spacing->permits(sample->spacing_m);
                                      });
    if (is_known)
      keeper_.add({sample->object, sample->spacing_m, sample->requested, sample.writer()});
  }
  for (const auto& [object, spacing_m] : keeper_.due(SpacingKeeper::Clock::now())) {
    fivepipe_v1_SpacingRequest request{};
    messages::set_text(request.object, object);
    request.spacing_m = spacing_m;
    requests_->write(request);
  }
}

}  // namespace fivepipe::launch
