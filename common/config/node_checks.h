// Checks the nodes of a deployment against each other: one capture node reads each camera, the
// reconstruction nodes cover the view exactly once, and node names are unique.
#pragma once
#include <vector>

#include "common/config/node_reader.h"

namespace fivepipe::config {

// Checks the cameras' sources. Cameras that no node reads are reported at `nodes_location`, the
// location of the list of nodes. `rig` must be the deployment's rig and have no problems.
void check_sources(const std::vector<ParsedNode>& nodes, const Rig& rig,
                   const std::filesystem::path& file, SourceLocation nodes_location,
                   Problems& problems);
// Checks that node names are unique, and that there is at most one sim_node, and one render_node
// that draws for the viewer.
void check_names_and_counts(const std::vector<ParsedNode>& nodes, const std::filesystem::path& file,
                            Problems& problems);
// Checks that no spectator has the name of the deployment's viewer.
void check_spectators(const std::vector<ParsedNode>& nodes, const Viewer& viewer,
                      const std::filesystem::path& file, Problems& problems);
// Checks that each node names one of the hosts, unless the deployment names none.
void check_hosts(const std::vector<ParsedNode>& nodes, const std::vector<Host>& hosts,
                 const std::filesystem::path& file, Problems& problems);
// Checks that no reconstruction node of a deployment with coverage uses a backend without it.
void check_coverage(const std::vector<ParsedNode>& nodes, const std::filesystem::path& file,
                    Problems& problems);

// Checks that the reconstruction nodes agree about the tiles, that no view has more tiles than
// pixels, and that each worker index occurs exactly once.
void check_workers(const std::vector<ParsedNode>& nodes, const Viewer& viewer, const Scene& scene,
                   const std::filesystem::path& file, Problems& problems);

}  // namespace fivepipe::config
