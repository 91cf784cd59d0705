#include "launch/export/session_export.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <fstream>
#include <memory>
#include <mutex>
#include <stdexcept>

#include "common/base/text_table.h"
#include "common/base/usage_error.h"
#include "common/recording/replay/recorded_deployment.h"
#include "common/surface/hull_mesh.h"
#include "launch/export/composite_export.h"
#include "launch/export/frame_export.h"
#include "launch/export/tables.h"
#include "launch/supervise/interrupt.h"

namespace fivepipe::exports {
namespace {

using base::UsageError;
namespace fs = std::filesystem;

// Frames per thread that are read and computed together: bounds the memory.
constexpr std::size_t kFramesPerThread = 2;
// Of the normals of the swept volume, whose faces are those of cells: shading over some 4 cells.
constexpr int kNormalSteps = 8;

bool needs_surfaces(const ExportRequest& request) {
  return request.meshes || request.points || request.volumes;
}
// Whether the hulls of frames are needed.
bool needs_hulls(const ExportRequest& request) {
  return needs_surfaces(request) || request.swept || request.depth || request.components;
}

void check(const ExportRequest& request, const config::Deployment& deployment) {
  if (!needs_hulls(request) && !request.composites)
    throw UsageError(
        "nothing to export: choose at least one of --meshes, --points, --volumes, --components, "
        "--depth, --swept and --composites");
  if (request.points == surface::MeshFormat::stl)
    throw UsageError("--points: STL holds only triangles; choose ply, obj or glb");
  if (!(request.start_s <= request.end_s)) throw UsageError("--start is after --end");
  const auto camera =
      std::ranges::find(deployment.rig.cameras, request.camera, &config::RigCamera::name);
  if (!request.camera.empty() && camera == deployment.rig.cameras.end()) {
    std::vector<std::string> names;
    for (const config::RigCamera& of_rig : deployment.rig.cameras) names.push_back(of_rig.name);
    throw UsageError("--view: the rig has no camera '" + request.camera +
                     "'; it has: " + base::joined(names, ", "));
  }
  std::error_code error;
  if (fs::exists(request.folder) && !fs::is_empty(request.folder, error))
    throw UsageError("--out: " + request.folder.string() +
                     (error ? ": " + error.message() : " is not empty; choose another folder"));
}

// Whether the volume has at most as many cells as the surfaces accept.
void check_cells(const ExportRequest& request, const Eigen::AlignedBox3d& volume_m) {
  const auto refuse = [](const char* option, const std::invalid_argument& error) {
    throw UsageError(std::string(option) + ": " + error.what());
  };
  try {
    base::WorkerPool pool(1);
    hull::CpuHull empty(pool);
    if (needs_surfaces(request))
      surface::hull_mesh(hull::HullQuery(empty),
                         {.within_world_m = volume_m, .cell_m = request.cell_m});
  } catch (const std::invalid_argument& error) {
    refuse("--cell", error);
  }
  try {
    if (request.swept) surface::SweptVolume({volume_m, request.swept_cell_m});
  } catch (const std::invalid_argument& error) {
    refuse("--swept-cell", error);
  }
}

// A table that is written line by line.
class Table {
 public:
  Table(const fs::path& file, const std::string& head, std::size_t& files)
      : file_(file), out_(file) {
    write(head);
    ++files;
  }
  void write(const std::string& lines) {
    out_ << lines;
    if (!out_.flush()) throw std::runtime_error("cannot write " + file_.string());
  }

 private:
  fs::path file_;
  std::ofstream out_;
};

class SessionExport {
 public:
  SessionExport(const ExportRequest& request, const config::Deployment& deployment,
                const recording::Recording& recording)
      : request_(request),
        frames_(recording, deployment,
                {.colours = request.colour && (request.meshes || request.points),
                 .head_poses = bool(request.depth)}),
        pool_(request.threads) {
    summary_.damage = recording.mcap().damage().summary;
    if (request.swept)
      swept_ = std::make_unique<surface::SweptVolume>(
          surface::SweptVolumeOptions{deployment.hull_rule.within_world_m, request.swept_cell_m});
    for (int i = 0; i < pool_.threads(); ++i)
      exporters_.push_back(std::make_unique<FrameExporter>(request, deployment, swept_.get()));
    const config::HistoryRequests history =
        deployment.scene.history.value_or(config::HistoryRequests{});
    tracker_ = std::make_unique<collision::ComponentTracker>(collision::ComponentTrackerOptions{
        .window_frames = history.window_frames, .max_speed_m_s = history.max_speed_m_s});
  }

  ExportSummary run(const Progress& progress) {
    while (read_batch()) {
      compute_batch();
      progress(batch_.back().frame.done);
    }
    summary_.drops = frames_.drops();
    summary_.first_fault = frames_.first_fault();
    if (summary_.frames == 0) throw recording::RecordingError(why_nothing());
    if (swept_) write_swept();
    progress(1);
    return summary_;
  }

 private:
  struct Job {
    replay::RecordedFrame frame;
    FrameTime time;
    // The tracker also needs the frames between those that are exported.
    bool is_exported = true;
    FrameFigures figures = {};
  };

  // Returns false at the end.
  bool read_batch() {
    batch_.clear();
    const std::size_t count = kFramesPerThread * std::size_t(pool_.threads());
    while (batch_.size() < count && !is_after_end_) {
      auto frame = frames_.next();
      if (!frame) break;
      const std::size_t index = summary_.frames_in_recording++;
      if (index == 0) first_stamp_ns_ = frame->set.capture_stamp_ns;
      const std::int64_t stamp_ns = frame->set.capture_stamp_ns;
      const double time_s = 1e-9 * double(stamp_ns - first_stamp_ns_);
      if (time_s > request_.end_s) is_after_end_ = true;
      if (time_s < request_.start_s || time_s > request_.end_s) continue;
      const bool is_exported = in_range_++ % std::size_t(request_.every) == 0;
      if (!is_exported && !request_.components) continue;
      const FrameTime time{index, frame->set.frame, stamp_ns, time_s, frame->duration_s};
      batch_.push_back({std::move(*frame), time, is_exported});
    }
    return !batch_.empty();
  }

  void compute_batch() {
    if (summary_.frames == 0) make_folders();
    std::mutex mutex;
    std::exception_ptr failure;
    pool_.run(int(batch_.size()), [&](int i, int thread) {
      Job& job = batch_[std::size_t(i)];
      try {
        FrameExporter& exporter = *exporters_[std::size_t(thread)];
        if (job.is_exported)
          job.figures = exporter.exported(job.frame, job.time.index);
        else
          job.figures.components = exporter.components(job.frame);
      } catch (...) {
        const std::lock_guard lock(mutex);
        if (!failure) failure = std::current_exception();
      }
    });
    if (failure) std::rethrow_exception(failure);
    for (const Job& job : batch_) fold(job);
  }

  void make_folders() {
    fs::create_directories(request_.folder);
    if (needs_surfaces(request_))
      frames_table_ =
          std::make_unique<Table>(request_.folder / "frames.csv", frames_head(), summary_.files);
    if (request_.components)
      components_table_ = std::make_unique<Table>(request_.folder / "components.csv",
                                                  components_head(), summary_.files);
    if (!request_.depth) return;
    fs::create_directories(request_.folder / "depth");
    views_table_ = std::make_unique<Table>(request_.folder / "depth" / "views.csv", views_head(),
                                           summary_.files);
  }

  void fold(const Job& job) {
    std::vector<collision::TrackedComponent> tracked;
    if (components_table_) tracked = tracker_->add(job.time.time_s, job.figures.components);
    if (!job.is_exported) return;
    ++summary_.frames;
    summary_.files += job.figures.files;
    summary_.without_mesh += job.figures.triangles == 0;
    summary_.without_colour += !job.figures.has_colour;
    summary_.without_pose += request_.depth && !job.figures.view;
    if (frames_table_) frames_table_->write(frame_line(job.time, job.figures));
    if (components_table_) components_table_->write(component_lines(job.time, tracked));
    if (job.figures.view) views_table_->write(view_line(job.time, *job.figures.view));
  }

  void write_swept() {
    const surface::SweptSurface found = swept_->surface();
    surface::write_mesh(request_.folder / ("swept" + surface::extension_of(*request_.swept)),
                        {.mesh = found.mesh, .normal_steps = kNormalSteps}, *request_.swept);
    ++summary_.files;
    summary_.swept = {found.mesh.triangles.size(), found.volume_m3, found.hull_volume_m3,
                      found.hull_volume_error_m3};
  }

  std::string why_nothing() const {
    if (summary_.frames_in_recording > 0)
      return request_.recording.string() + " has no frame between --start and --end; it has " +
             base::counted(summary_.frames_in_recording, "complete frame") + " before --end";
    return frames_.why_none();
  }

  const ExportRequest& request_;
  replay::RecordedFrames frames_;
  base::WorkerPool pool_;
  std::unique_ptr<surface::SweptVolume> swept_;
  std::vector<std::unique_ptr<FrameExporter>> exporters_;  // one per thread
  std::unique_ptr<collision::ComponentTracker> tracker_;
  std::unique_ptr<Table> frames_table_, components_table_, views_table_;
  std::vector<Job> batch_;
  std::int64_t first_stamp_ns_ = 0;
  std::size_t in_range_ = 0;
  bool is_after_end_ = false;
  ExportSummary summary_;
};

constexpr std::size_t kCompositeFiles = 2;

CompositeRange composite_range(const ExportRequest& request, const recording::Recording& recording,
                               const replay::RecordedDeployment& recorded) {
  // Of the first complete frame, since the start of the recording.
  double first_s = 0;
  if (const auto frame = replay::RecordedFrames(recording, recorded.deployment()).next())
    first_s = std::max(0.0, 1e-9 * double(frame->set.capture_stamp_ns - recording.start_ns()));
  CompositeRange range;
  if (request.start_s > 0) range.start_s = first_s + request.start_s;
  if (std::isfinite(request.end_s)) range.end_s = first_s + request.end_s;
  return range;
}

}  // namespace

ExportSummary export_session(const ExportRequest& request, const Progress& progress) {
  const recording::Recording recording(request.recording);
  const replay::RecordedDeployment recorded(recording, request.settings);
  check(request, recorded.deployment());
  CompositeRange range;
  if (request.composites) {
    range = composite_range(request, recording, recorded);
    check_composites(recording, recorded, range);
  }
  ExportSummary summary;
  if (needs_hulls(request)) {
    check_cells(request, recorded.deployment().hull_rule.within_world_m);
    if (request.depth == DepthFormat::exr) enable_exr();
    summary = SessionExport(request, recorded.deployment(), recording).run(progress);
  }
  if (request.composites) {
    launch::catch_signals();
    summary.composited =
        export_composites(recording, recorded, request.folder / "composites", range);
    summary.files += kCompositeFiles;
  }
  return summary;
}

}  // namespace fivepipe::exports
