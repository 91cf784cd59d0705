#include "sim_node/messages_spacing.h"

#include <fmt/format.h>

#include <cmath>

namespace fivepipe::sim {
namespace {

messages::Received<SpacingChange> checked_change(const std::string& name, double spacing_m,
                                                 std::int64_t capture_stamp_ns,
                                                 const config::Scene& scene) {
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const config::SceneObject& object = scene.objects[i];
    if (object.name != name) continue;
    if (!object.spacing) return messages::BadMessage{"bad_spacing", name, "has no spacing"};
    if (!std::isfinite(spacing_m))
      return messages::BadMessage{"bad_spacing", name, "is not finite"};
    if (!object.spacing->permits(spacing_m))
      return messages::BadMessage{
          "bad_spacing", name,
          fmt::format("{:.4g} m is outside of range_m [{:g}, {:g}]", spacing_m,
                      object.spacing->low_m, object.spacing->high_m)};
    return SpacingChange{i, spacing_m, capture_stamp_ns};
  }
  return messages::BadMessage{"bad_spacing", name, "not in the scene"};
}

}  // namespace

messages::Received<SpacingChange> change_to(const std::string& object, double spacing_m,
                                            const config::Scene& scene) {
  return checked_change(object, spacing_m, 0, scene);
}

messages::Received<SpacingChange> change_from(const fivepipe_v1_SpacingRequest& message,
                                              const config::Scene& scene) {
  return change_to(message.object, message.spacing_m, scene);
}

messages::Received<SpacingChange> change_from(const fivepipe_v1_ObjectSpacing& message,
                                              const config::Scene& scene) {
  if (const auto why = messages::why_implausible(message.frame, message.capture_stamp_ns))
    return messages::BadMessage{"bad_spacing", message.object, *why};
  return checked_change(message.object, message.spacing_m, message.capture_stamp_ns, scene);
}

fivepipe_v1_ObjectSpacing spacing_message(const std::string& object, std::uint64_t frame,
                                          std::int64_t capture_stamp_ns, double spacing_m,
                                          bool requested) {
  fivepipe_v1_ObjectSpacing message{};
  messages::set_text(message.object, object);
  message.frame = frame;
  message.capture_stamp_ns = capture_stamp_ns;
  message.spacing_m = spacing_m;
  message.requested = requested;
  return message;
}

}  // namespace fivepipe::sim
