// What `fivepipe cameras` prints.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "capture_node/cameras/connected_camera.h"

namespace fivepipe::capture {

// A mode that all cameras of a link have, and what it needs if all of them use it at its highest
// common rate.
struct SharedMode {
  CameraMode mode;
  double needed_mbit_s;  // of all cameras together
  // nullopt: the speed of the link is unknown.
  std::optional<bool> fits;
};

struct SharedLink {
  CameraLink link;
  int cameras;
  std::vector<SharedMode> modes;  // uncompressed, by the bandwidth that they need
};

// Returns the links of the cameras, by name.
std::vector<SharedLink> shared_links(const std::vector<ConnectedCamera>& cameras);

// `notes` are lines about what was not searched, such as a library that this build lacks.
std::string report_text(const std::vector<ConnectedCamera>& cameras,
                        const std::vector<std::string>& notes);
nlohmann::json report_json(const std::vector<ConnectedCamera>& cameras,
                           const std::vector<std::string>& notes);

}  // namespace fivepipe::capture
