// fivepipe export: the real objects of a recording as files of other programs.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>

#include "common/surface/mesh_file.h"
#include "launch/export/depth_file.h"

namespace fivepipe::exports {

struct ExportRequest {
  std::filesystem::path recording, folder;
  std::map<std::string, std::string> settings;  // of the recorded deployment
  // What to write.
  std::optional<surface::MeshFormat> meshes, points, swept;
  std::optional<DepthFormat> depth;
  std::string camera;  // of the depth: a camera of the rig; empty: the viewer
  bool volumes = false, components = false;
  bool composites = false;  // of all frames in the range, whatever `every` is
  bool colour = true;       // in meshes and points, if it was recorded
  // Of which frames: by time since the first complete frame, both ends included; every n-th.
  double start_s = 0, end_s = std::numeric_limits<double>::infinity();
  int every = 1;
  double cell_m = 0.004, swept_cell_m = 0.005;
  int threads = 1;
};

struct SweptResult {
  std::size_t triangles = 0;
  double volume_m3 = 0, hull_volume_m3 = 0, hull_volume_error_m3 = 0;  // see SweptSurface
};

struct ExportSummary {
  std::size_t frames = 0;               // written
  std::size_t frames_in_recording = 0;  // complete ones that were read
  // Of the written ones. Without a mesh: there is no hull, or it is thinner than a cell.
  std::size_t without_mesh = 0, without_colour = 0, without_pose = 0;
  std::size_t files = 0;
  std::size_t composited = 0;  // frames of the video
  std::optional<SweptResult> swept;
  std::map<std::string, std::uint64_t> drops;  // of the recording, by reason
  std::string first_fault, damage;             // empty: none
};

// Called with the part of the work that is done, 0 to 1, when it has grown.
using Progress = std::function<void(double done)>;
// Writes the files into the folder, which must be empty or absent:
//   meshes/FRAME.ply, points/FRAME.ply   hull meshes, and the vertices of these
//   depth/FRAME.png, depth/views.csv     depth of the hull, and the views' cameras
//   frames.csv, components.csv           volumes; tracked components
//   swept.ply                            the swept volume of the frames
//   composites/composite.mp4, .png       what render_node draws (composite_export.h)
// Threads work on different frames; the files do not depend on their number. Throws
// base::UsageError if the request is wrong, recording::RecordingError if no frame can be exported,
// and as replay::RecordedFrames, replay::RecordedDeployment and
// export_composites() do. Call it from the main thread.
ExportSummary export_session(const ExportRequest& request, const Progress& progress);

// For people: what was written and what is missing.
std::string text_of(const ExportRequest& request, const ExportSummary& summary);

}  // namespace fivepipe::exports
