// Requests spacings as the keys in the window ask, and shows the present one in its title.
#pragma once
#include <optional>
#include <string>

#include "common/pipeline/node/run_node.h"
#include "render_node/output/presenter.h"
#include "render_node/output/spacing_keys.h"

namespace fivepipe::render {

// Reads and writes nothing without a window or without an object with a spacing. Borrows its
// arguments.
class SpacingPipe {
 public:
  SpacingPipe(node::NodeContext& node, Presenter& presenter);
  // Call often.
  void step();

 private:
  Window* window_;
  std::string title_;
  std::optional<SpacingKeys> keys_;
  std::optional<bus::Reader<bus::topics::ObjectSpacing>> spacings_;
  std::optional<bus::Writer<bus::topics::SpacingRequest>> requests_;
};

}  // namespace fivepipe::render
