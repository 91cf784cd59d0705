// A deployment: which nodes run, with which rig, scene, viewer and settings. One YAML file, which
// all processes of the deployment read. *_config.h document each node's settings.
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "common/config/capture/capture_config.h"
#include "common/config/network/hosts.h"
#include "common/config/network/security.h"
#include "common/config/recon_config.h"
#include "common/config/render_config.h"
#include "common/config/rig.h"
#include "common/config/scene.h"
#include "common/config/sim_config.h"
#include "common/config/view/viewer.h"
#include "common/config/yaml/config_error.h"

namespace fivepipe::config {

// Largest DDS domain d that deployments and command lines accept. Cyclone DDS gives participant i
// of a host the UDP ports 7400 + 250 d + 10 + 2 i and the next one. The limit keeps these ports
// below 65,536 for 312 participants per host.
inline constexpr int kMaxDomain = 230;

using NodeConfig = std::variant<CaptureConfig, ReconConfig, SimConfig, RenderConfig>;

struct Node {
  std::string name;        // unique
  std::string host;        // empty: any host; else one of Deployment::hosts, if there are any
  std::vector<int> cores;  // CPU cores to which the process is pinned; empty: not pinned
  NodeConfig config;
  int line = 0;  // in the deployment file
};
// Returns "capture_node", "recon_node", "sim_node" or "render_node".
std::string program_of(const Node& node);

struct Deployment {
  std::string name;
  std::filesystem::path file;
  // All files that were read: the deployment file first, then rig, scene, meshes with the
  // textures beside them, and head path. Excludes videos and pictures.
  std::vector<std::filesystem::path> files;
  std::uint32_t domain = 0;                  // DDS domain
  std::vector<Host> hosts;                   // empty: the nodes' `host` are names of machines
  std::string network_profile = "loopback";  // with several hosts by default "lan"
  std::optional<Security> security;          // nullopt: every process may join
  double frame_rate_hz = 30;
  Rig rig;
  Scene scene;
  bool coverage = false;     // sub-pixel silhouettes; as in the nodes'
  hull::HullRule hull_rule;  // which cameras limit the hull, in the rig's volume; as in the nodes'
                             // configurations
  Viewer viewer;
  std::vector<Node> nodes;
};

// Reads a deployment. `settings` replace ${key} in the file's strings; the file's own `settings:`
// are the defaults. Paths are relative to the file that contains them, or to the working directory
// if they come from `settings` (--set). Throws ConfigError with every problem of the deployment,
// its rig, its scene and the files they name, all together.
Deployment load_deployment(const std::filesystem::path& file,
                           const std::map<std::string, std::string>& settings = {});

// Returns a pointer into `deployment`, or nullptr if it has no node of this name.
const Node* find_node(const Deployment& deployment, const std::string& name);

// Returns the viewer of a render_node that draws for a spectator; nullptr for any other node. Valid
// as long as the node.
const Viewer* spectator_of(const Node& node);
// Returns the viewers of all spectators.
std::vector<Viewer> spectators_of(const Deployment& deployment);
// Returns whether the node is the render_node that draws for the viewer of the deployment.
bool draws_for_viewer(const Node& node);

// Returns the capture_node that decides when a frame is captured: the first one of the file;
// nullptr if there is none.
const Node* first_capture_node(const Deployment& deployment);
// Returns the cameras that give shape and whose capture_node has `lost_camera: continue`: frames
// are complete without the maps of these that are lost.
std::set<std::string> dispensable_cameras(const Deployment& deployment);
// Returns what all capture_nodes together capture, for a program that does it in one process: the
// cameras of all nodes, each with its segmentation, and the other settings of the first node.
// Throws std::runtime_error if there is none.
CaptureConfig capture_of_all_nodes(const Deployment& deployment);

}  // namespace fivepipe::config
