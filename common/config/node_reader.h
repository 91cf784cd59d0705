// The nodes of a deployment file, one by one; what concerns several of them is checked in
// node_checks.h.
#pragma once
#include <map>
#include <string>

#include "common/config/deployment.h"
#include "common/config/yaml/yaml_reader.h"

namespace fivepipe::config {

// A node with the places that later problems refer to.
struct ParsedNode {
  Node node;
  SourceLocation location, name_location, worker_index_location;
  std::map<std::string, SourceLocation> source_locations;  // by camera
};

// `rig` says which cameras `sources: synthetic` stands for.
ParsedNode read_node(YamlMap map, const Rig& rig);

}  // namespace fivepipe::config
