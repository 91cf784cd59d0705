// Assigns the tiles of each frame to the reconstruction nodes that answer, by the costs of the
// frames before.
#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/pipeline/frames/tile_balancer.h"
#include "common/pipeline/frames/worker_presence.h"
#include "common/pipeline/node/run_node.h"

namespace fivepipe::capture {

class TileAssignment {
 public:
  explicit TileAssignment(node::NodeContext& node);

  // Takes the answers of the reconstruction nodes and reports which of them take no part.
  // has_published_lately: of a frame number.
  void update(const std::function<bool(std::uint64_t)>& has_published_lately);
  // Returns the owners of the tiles of the frame that is published next, row by row; empty if the
  // deployment has no reconstruction node.
  std::vector<std::uint8_t> owners_of(std::uint64_t frame);
  // Returns the newest frame that does not become complete, because a node that owes tiles of it
  // became silent since the last call.
  std::optional<std::uint64_t> take_lost();

 private:
  void take_answers(const std::function<bool(std::uint64_t)>& has_published_lately);

  node::NodeContext& node_;
  const std::string& viewer_;
  bus::Reader<bus::topics::TileCosts> tile_costs_;
  std::vector<std::string> nodes_;  // by worker; empty: none has this index
  std::optional<frames::TileBalancer> balancer_;
  frames::WorkerPresence presence_;
};

}  // namespace fivepipe::capture
