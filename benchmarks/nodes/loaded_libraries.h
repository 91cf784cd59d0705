// The shared libraries that the nodes of a deployment have loaded.
#pragma once
#include <sys/types.h>

#include <filesystem>
#include <map>
#include <set>
#include <string>

namespace fivepipe::node_bench {

using Libraries = std::set<std::string>;  // file names, without folders

// The libraries that are mapped in a process now (/proc/PID/maps): those that the program links and
// those that it has opened since (dlopen), such as the OpenGL driver. Empty if there is no process.
Libraries loaded_libraries(pid_t pid);

// Runs all nodes of a deployment, until a viewer has kLiveFrames frames, and returns the libraries
// of each by its program, such as "sim_node". Writes the nodes' files to `out`. Throws
// std::runtime_error if a node does not start, or ends, with its output.
std::map<std::string, Libraries> libraries_of_nodes(const std::filesystem::path& deployment,
                                                    const std::filesystem::path& out);
// Enough for each node to have handled a frame with every feature: the history begins with the
// second.
inline constexpr int kLiveFrames = 10;

// "sim_node: +libx.so.1 -liby.so.2; render_node: +libz.so", or "the same".
std::string difference_text(const std::map<std::string, Libraries>& base,
                            const std::map<std::string, Libraries>& other);

}  // namespace fivepipe::node_bench
