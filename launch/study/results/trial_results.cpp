#include "launch/study/results/trial_results.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "common/base/realtime.h"
#include "launch/study/results/scene_parts.h"
#include "launch/study/results/session_results.h"

namespace fivepipe::study {
namespace {

// The swept volume has larger cells than requested if its box would need more than this.
constexpr double kMaxBoxCells = 1e8;

// Adds the parts to the scenes unless one of these has equal parts, and returns their position.
std::size_t position_of(std::vector<report::Part> parts,
                        std::vector<std::vector<report::Part>>& scenes) {
  const auto known = std::ranges::find_if(
      scenes, [&](const std::vector<report::Part>& scene) { return are_equal(scene, parts); });
  const auto position = std::size_t(known - scenes.begin());
  if (known == scenes.end()) scenes.push_back(std::move(parts));
  return position;
}

// Calls use(). Returns why the recording that it reads cannot be used, otherwise nothing.
std::optional<std::string> why_unusable(const std::function<void()>& use) {
  try {
    use();
    return std::nullopt;
  } catch (const recording::RecordingError& error) {
    return error.what();
  } catch (const mcap::McapError& error) {
    return error.what();
  } catch (const std::system_error& error) {
    return error.what();
  }
}

// Makes the swept volume of all recordings of a trial: the rig, and so the box that contains its
// hulls, may have been changed between them. Null if none can be used.
std::unique_ptr<surface::SweptVolume> swept_volume_of(const std::filesystem::path& folder,
                                                      const StoredTrial& stored, double cell_m) {
  Eigen::AlignedBox3d box_m;
  for (const std::string& file : stored.recordings)
    why_unusable([&] {
      const recording::Recording recording(folder / file);
      box_m.extend(replay::RecordedDeployment(recording, {}).deployment().rig.volume_m);
    });
  if (box_m.isEmpty()) return nullptr;
  return std::make_unique<surface::SweptVolume>(surface::SweptVolumeOptions{
      box_m, std::max(cell_m, std::cbrt(box_m.volume() / kMaxBoxCells))});
}

}  // namespace

report::Trial trial_results(const StudyFolder& study, const StoredTrial& stored,
                            const TrialRequest& request,
                            const std::function<void(double done)>& progress,
                            report::Study& shown) {
  std::vector<std::string>& remarks = shown.remarks;
  report::Trial trial;
  trial.number = stored.number;
  trial.is_kept = stored.state == TrialState::kept;
  trial.discarded_because = stored.discarded_because;
  trial.tool = stored.tool;
  trial.answers = stored.answers;
  base::WorkerPool pool(request.threads);
  const std::filesystem::path folder = study.folder_of(stored.number);
  const std::unique_ptr<surface::SweptVolume> swept =
      request.swept ? swept_volume_of(folder, stored, request.swept_cell_m) : nullptr;
  const std::string of = fmt::format("Trial {}", stored.number);
  std::vector<StoredNote> notes = stored.notes;
  double offset_s = 0;
  const auto add_recording = [&](std::size_t part, const std::function<void(double)>& of_part) {
    SessionResults session(folder / stored.recordings[part], request, pool, swept.get());
    session.compute(of_part);
    session.add_remarks(of, remarks);
    const std::size_t scene = position_of(report_parts(session.scene()), shown.scenes);
    if (trial.scene.value_or(scene) != scene)
      remarks.push_back(of +
                        ": the scene was changed between its recordings. The results of each are "
                        "those of its own scene, the 3D view shows that of the first one.");
    if (!trial.scene) trial.scene = scene;
    std::optional<EventPictures> pictures;
    if (request.pictures)
      pictures.emplace(session.recording(),
                       folder / fmt::format("run_{}", part + 1) / "composite.mp4");
    if (pictures && !pictures->why_none().empty())
      remarks.push_back(fmt::format("{}: no pictures: {}.", of, pictures->why_none()));
    session.add_to(trial, offset_s, pictures ? &*pictures : nullptr);
    std::erase_if(notes, [&](const StoredNote& note) {
      if (note.stamp_ns > session.recording().end_ns()) return false;
      const double time_s = offset_s + base::difference_s(note.stamp_ns, session.start_ns());
      trial.notes.push_back({std::clamp(time_s, offset_s, trial.duration_s), note.text});
      return true;
    });
    offset_s = trial.duration_s;
  };
  for (std::size_t part = 0; part < stored.recordings.size(); ++part) {
    const double parts = double(stored.recordings.size());
    const auto of_part = [&](double done) { progress((double(part) + done) / parts); };
    if (const auto why = why_unusable([&] { add_recording(part, of_part); }))
      remarks.push_back(fmt::format("{}: not used: {}.", of, *why));
  }
  for (const StoredNote& note : notes) trial.notes.push_back({trial.duration_s, note.text});
  std::ranges::stable_sort(trial.layout_changes, {}, &report::LayoutChange::time_s);
  if (swept) {
    const surface::SweptSurface surface = swept->surface();
    remarks.push_back(fmt::format(
        "{}: the swept volume is {:.0f} cm3, larger by {:.0f} cm3 (standard error {:.0f}) than "
        "what the hulls sweep, because it consists of whole cells of {:g} mm.",
        of, 1e6 * surface.volume_m3, 1e6 * (surface.volume_m3 - surface.hull_volume_m3),
        1e6 * surface.hull_volume_error_m3, 1e3 * swept->cell_m()));
    trial.swept.push_back({"real objects", surface.mesh});
  }
  return trial;
}

}  // namespace fivepipe::study
