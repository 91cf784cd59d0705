// The machines of a deployment.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "common/config/yaml/yaml_reader.h"

namespace fivepipe::config {

struct Host {
  std::string name;       // as the nodes and --host name it
  std::string address;    // IPv4, by which the other machines reach it
  std::string interface;  // its name on that machine; empty: the interface with `address`
};

// Reads `hosts`: a mapping from each name to `address` and, optionally, `interface`. Returns an
// empty list if the key is absent.
std::vector<Host> read_hosts(YamlMap& map);

// Returns the host of this machine: that of the name, or, if it is empty, the one that has this
// machine's name or one of its addresses. `hosts` is not empty, `file` is that of the deployment.
// Throws ConfigError if there is none.
const Host& own_host(const std::vector<Host>& hosts, const std::string& name,
                     const std::filesystem::path& file);

}  // namespace fivepipe::config
