// Connects SpacingKeeper with the topics of the deployment.
#pragma once
#include <map>
#include <optional>
#include <string>

#include "common/config/scene.h"
#include "common/pipeline/bus/bus.h"
#include "launch/supervise/spacing/spacing_keeper.h"

namespace fivepipe::launch {

// Reads and writes nothing if no object of the scene has a spacing. Both must outlive it.
class SpacingPipe {
 public:
  SpacingPipe(bus::Bus& bus, const config::Scene& scene);
  // Call often, from one thread.
  void step();
  // SpacingKeeper::for_start().
  std::map<std::string, double> for_start() { return keeper_.for_start(); }

 private:
  const config::Scene& scene_;
  SpacingKeeper keeper_;
  std::optional<bus::Reader<bus::topics::ObjectSpacing>> spacings_;
  std::optional<bus::Writer<bus::topics::SpacingRequest>> requests_;
};

}  // namespace fivepipe::launch
