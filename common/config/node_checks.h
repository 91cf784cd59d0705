// What the nodes of a deployment must be together: cameras read once, the view shared out once, no
// two nodes of one name.
#pragma once
#include <vector>

#include "common/config/node_reader.h"

namespace fivepipe::config {

// `nodes_location`: of the list of nodes, for what is missing altogether. The rig is the
// deployment's, without problems of its own.
void check_sources(const std::vector<ParsedNode>& nodes, const Rig& rig,
                   const std::filesystem::path& file, SourceLocation nodes_location,
                   Problems& problems);
void check_names_and_counts(const std::vector<ParsedNode>& nodes, const std::filesystem::path& file,
                            Problems& problems);
void check_shares(const std::vector<ParsedNode>& nodes, const Viewer& viewer,
                  const std::filesystem::path& file, Problems& problems);

}  // namespace fivepipe::config
