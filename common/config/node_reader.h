// The nodes of a deployment file, one by one; what concerns several of them is checked in
// node_checks.h.
#pragma once
#include <map>
#include <string>

#include "common/config/deployment.h"
#include "common/config/yaml/yaml_reader.h"

namespace fivepipe::config {

// A node with the places that later problems refer to.
struct PlacedNode {
  Node node;
  Place place, place_of_name, place_of_share;
  std::map<std::string, Place> place_of_source;  // by camera
};

// `rig` says which cameras `sources: synthetic` stands for.
PlacedNode read_node(YamlMap map, const Rig& rig);

}  // namespace fivepipe::config
