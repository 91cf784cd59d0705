// What the nodes of a deployment must be together: cameras read once, the view shared out once, no
// two nodes of one name.
#pragma once
#include <vector>

#include "common/config/node_reader.h"

namespace fivepipe::config {

// `nodes_place`: of the list of nodes, for what is missing altogether. The rig is the deployment's,
// without problems of its own.
void check_sources(const std::vector<PlacedNode>& nodes, const Rig& rig,
                   const std::filesystem::path& file, Place nodes_place, Problems& problems);
void check_names_and_counts(const std::vector<PlacedNode>& nodes, const std::filesystem::path& file,
                            Problems& problems);
void check_shares(const std::vector<PlacedNode>& nodes, const Viewer& viewer,
                  const std::filesystem::path& file, Problems& problems);

}  // namespace fivepipe::config
