// Reads one node of a deployment file. node_checks.h checks the nodes against each other.
#pragma once
#include <map>
#include <string>

#include "common/config/deployment.h"
#include "common/config/yaml/yaml_reader.h"

namespace fivepipe::config {

// A node and the locations at which node_checks.h reports problems.
struct ParsedNode {
  Node node;
  SourceLocation location, name_location, worker_index_location;
  std::map<std::string, SourceLocation> source_locations;  // by camera
};

// Adds problems to those of `map`. `sources: synthetic` stands for all cameras of `rig` that give
// shape or colour.
ParsedNode read_node(YamlMap map, const Rig& rig);

}  // namespace fivepipe::config
