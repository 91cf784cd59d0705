#include "render_node/spacing_pipe.h"

#include <utility>

#include "common/pipeline/messages/wire_conversions.h"

namespace fivepipe::render {

SpacingPipe::SpacingPipe(node::NodeContext& node, Presenter& presenter)
    : window_(presenter.window()) {
  if (!window_ || !config::has_spacings(node.deployment.scene)) return;
  keys_.emplace(node.deployment.scene);
  spacings_.emplace(node.bus.reader<bus::topics::ObjectSpacing>());
  requests_.emplace(node.bus.writer<bus::topics::SpacingRequest>());
}

void SpacingPipe::step() {
  if (!keys_) return;
  const auto now = SpacingKeys::Clock::now();
  for (const auto& sample : spacings_->take())
    if (sample.valid()) keys_->set(sample->object, sample->spacing_m, now);
  for (const KeyPress& press : window_->take_keys())
    if (const auto request = keys_->press(press, now)) {
      fivepipe_v1_SpacingRequest message{};
      messages::set_text(message.object, request->object);
      message.spacing_m = request->spacing_m;
      requests_->write(message);
    }
  if (std::string title = keys_->title(); title != title_) {
    title_ = std::move(title);
    window_->set_title("fivepipe, " + title_);
  }
}

}  // namespace fivepipe::render
