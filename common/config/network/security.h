// The security of a deployment's messages.
#pragma once
#include <filesystem>
#include <optional>

#include "common/config/yaml/yaml_reader.h"

namespace fivepipe::config {

struct Security {
  std::filesystem::path keys;  // folder that `fivepipe keys` makes, with a folder for each role
  int line = 0;                // in the deployment file
};

// Reads `security`. Returns nullopt if the key is absent: every process may join. Does not read the
// keys: `fivepipe keys` loads the deployment before they exist.
std::optional<Security> read_security(YamlMap& map);

}  // namespace fivepipe::config
