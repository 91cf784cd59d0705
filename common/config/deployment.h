// A deployment: which processes run, on what rig and scene, with which settings. One YAML file; all
// processes read the same one.
#pragma once
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/config/rig.h"
#include "common/config/scene.h"
#include "common/config/yaml/config_error.h"

namespace fivepipe::config {

// Largest DDS domain d that deployments and command lines accept. Cyclone DDS gives participant i
// of a host the UDP ports 7400 + 250 d + 10 + 2 i and the next one. The limit keeps these ports
// below 65,536 for 312 participants per host.
inline constexpr int kMaxDomain = 230;

// --- where a camera's images come from
// -------------------------------------------------------------------------
struct SyntheticSource {};  // rendered: see SyntheticWorld
// A video file, or an image sequence by a printf pattern (frame_%04d.png). The reference image is
// learnt from `background` (video, sequence or single plate image).
struct VideoSource {
  std::string file, background;
  int first_frame = 0;
};
// A V4L2 camera by index or by path (/dev/v4l/by-id/... keeps its name over reboots). Learns its
// reference image from the first `background_frames` frames unless a plate is given.
struct V4l2Source {
  std::string device;
  std::string background;  // optional plate
  int background_frames = 30;
};
using CameraSource = std::variant<SyntheticSource, VideoSource, V4l2Source>;

// The real things that synthetic cameras see: a hand with forearm holding a pipe, moving with this
// period, repeated exactly.
struct SyntheticWorld {
  std::uint64_t seed = 1;
  double period_s = 4.0;
  double noise_sigma_levels = 2.0;  // sensor noise, grey levels of 255
  bool cast_shadow = true;
  // One period is rendered before the start, by cameras fixed in the world (up to 1 MB an image):
  // playing it then costs next to nothing.
  bool prerender = false;
};

// Image segmentation (paper, section 3.1): a pixel is an object pixel where its difference from the
// reference image exceeds max(floor, sigmas * its measured noise).
struct SegmentationConfig {
  double threshold_sigmas = 6.0;
  double threshold_floor_levels = 12.0;
  double shadow_darkest = 0.5;  // a pixel as dark as this fraction of the reference, with its
                                // colour kept, is shadow; 1 switches it off
  int opening_px = 1;           // radius of the morphological opening that removes specks; 0: none
  int closing_px = 0;
};

struct CaptureConfig {
  std::map<std::string, CameraSource> sources;  // by camera name: the cameras that this node reads
  SyntheticWorld synthetic;
  SegmentationConfig segmentation;
  bool loop = true;              // files start over at their end; frame numbers go on
  int max_frames_in_flight = 3;  // published and not yet composited; 0: no pacing
  int precomputed_frames =
      0;  // segment this many frame sets before the start and publish those over and over; 0: live
};

// automatic: gl where OpenGL runs on a GPU, else cpu. sweep is the paper's, an approximation.
enum class HullBackend { automatic, cpu, gl, sweep };
// How reconstruction nodes share the work: every frame's tiles (latency), or whole frames by turns
// (rate).
enum class ReconSplit { tiles, frames };

struct ReconConfig {
  HullBackend backend = HullBackend::automatic;
  int threads = 1;  // of backend cpu
  int sweep_planes = 64;
  // The same in every reconstruction node:
  int tile_columns = 8, tile_rows = 6;  // of the view
  int worker_count = 1;
  ReconSplit split = ReconSplit::tiles;
  bool balance = true;  // of tiles: by what they cost some frames ago; else by turns

  int worker_index = 0;  // of shares, this node's
};

// How collisions with the hull are found: cpu and gl, certified (common/collision/cpu_detection.h,
// gl_detection.h), or as the paper did, by sampling in OpenGL.
enum class CollisionBackend { cpu, gl, paper };

struct SimConfig {
  CollisionBackend collision = CollisionBackend::cpu;
  int threads = 1;          // of all that asks the hull; the bits are the same for any number
  double eps_m = 0.5e-3;    // cpu, gl: a part of a triangle in the hull that is thinner may be left
                            // undecided (`touching`)
  double spacing_m = 3e-3;  // cpu, gl: of collision points, at most
  int viewport_px = 10;     // paper: each triangle is volume-queried in viewport_px x viewport_px
                            // (paper, section 4.2.4)
  int window_px = 400;  // paper: of a window_px x window_px window; every backend: samples along
                        // the lines of a response that samples
  double step_s = 1.0 / 240;
  int max_points =
      256;  // collision points per object that are published; more set the truncated flag
};

struct RenderConfig {
  bool window = false;  // also show a window (needs a display)
  bool video = true;    // composite.mp4 in the output folder
  std::int64_t still_frame =
      0;  // composite.png shows the first frame composited at or after this one
};

using NodeConfig = std::variant<CaptureConfig, ReconConfig, SimConfig, RenderConfig>;

struct Node {
  std::string name;        // unique
  std::string host;        // empty: any
  std::vector<int> cores;  // pinned to these; empty: not pinned
  NodeConfig config;
  int line = 0;  // in the deployment file
};
// capture_node, recon_node, sim_node or render_node.
std::string program_of(const Node& node);

// Eye poses over time, or a file of them.
struct HeadKey {
  double t_s;
  Eigen::Vector3d eye_world_m, target_world_m;
};
struct Viewer {
  std::string name = "viewer";
  std::vector<HeadKey>
      path;  // piecewise smooth through the keys, repeated after the last; one key: a fixed view
  std::filesystem::path file;  // or CSV: t_s, eye x y z [m], target x y z [m]; its keys are already
                               // in `path` when loaded
  double horizontal_fov_rad = 1.0;
  int render_width_px = 640, render_height_px = 480;
  int recon_width_px = 320, recon_height_px = 240;
  double near_m = 0.05, far_m = 5.0;
};
// Pinholes of the two images of a view; same field of view.
geometry::Pinhole render_pinhole(const Viewer& viewer);
geometry::Pinhole recon_pinhole(const Viewer& viewer);
// camera_from_world of the eye at a time since the start [s].
Eigen::Isometry3d eye_from_world_at(const Viewer& viewer, double t_s);

struct Deployment {
  std::string name;
  std::filesystem::path file;
  std::vector<std::filesystem::path> files;  // all that it was read from, itself first: rig, scene,
                                             // meshes, head path; footage apart
  std::uint32_t domain = 0;
  std::string network_profile = "loopback";
  double frame_rate_hz = 30;
  Rig rig;
  Scene scene;
  Viewer viewer;
  std::vector<Node> nodes;
};

// Settings fill ${key} in the file's strings; the file's own `settings:` are the defaults. Paths
// are relative to the file that names them, or to the working directory where they come from --set.
// Throws ConfigError with every problem of the deployment, its rig, its scene and the files they
// name, all together.
Deployment load_deployment(const std::filesystem::path& file,
                           const std::map<std::string, std::string>& settings = {});

const Node* find_node(const Deployment& deployment, const std::string& name);

}  // namespace fivepipe::config
