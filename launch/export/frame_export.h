// The files and figures of one frame.
#pragma once
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "common/base/worker_pool.h"
#include "common/collision/tracking/hull_components.h"
#include "common/config/deployment.h"
#include "common/recording/replay/recorded_frames.h"
#include "common/surface/swept_volume.h"
#include "launch/export/session_export.h"

namespace fivepipe::exports {

// Name of a frame's files, without extension. A recording holds a number twice if capture_node was
// restarted; the index of the frame in the recording tells them apart.
std::string name_of_frame(std::size_t index, std::uint64_t frame);

struct FrameFigures {
  std::size_t vertices = 0, triangles = 0;
  double volume_m3 = 0, area_m2 = 0;
  std::vector<collision::HullComponent> components;
  std::optional<geometry::Camera> view;  // of the depth; nullopt: no depth was written
  std::size_t files = 0;
  bool has_colour = false;
};

// What one thread needs. Several may share the swept volume.
class FrameExporter {
 public:
  // Borrows all of them. swept: null if it is not requested.
  FrameExporter(const ExportRequest& request, const config::Deployment& deployment,
                surface::SweptVolume* swept);

  // Writes the files of the frame. Throws std::runtime_error if one cannot be written.
  FrameFigures exported(const replay::RecordedFrame& frame, std::size_t index);
  // The connected parts of the hull, for the tracker. Writes nothing.
  std::vector<collision::HullComponent> components(const replay::RecordedFrame& frame);

 private:
  std::vector<collision::HullComponent> components_of(const hull::HullQuery& query) const;
  void write_meshes(const replay::RecordedFrame& frame, const std::string& name,
                    const hull::HullQuery& query, FrameFigures& figures);
  void write_depth_of(const replay::RecordedFrame& frame, const std::string& name,
                      FrameFigures& figures);

  const ExportRequest& request_;
  const config::Deployment& deployment_;
  surface::SweptVolume* swept_;
  base::WorkerPool pool_{1};
  hull::CpuHull hull_{pool_};
};

}  // namespace fivepipe::exports
