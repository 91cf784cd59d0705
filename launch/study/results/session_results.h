// Computes what one recording of a trial shows: collisions, clearance, curves, the swept volume.
#pragma once
#include <functional>
#include <map>
#include <memory>

#include "common/recording/replay/recorded_deployment.h"
#include "common/study/report/study.h"
#include "common/study/session_timeline.h"
#include "common/surface/swept_volume.h"
#include "launch/study/recorded/recorded_spacings.h"
#include "launch/study/results/event_pictures.h"
#include "launch/study/results/trial_results.h"

namespace fivepipe::study {

class SessionResults {
 public:
  // swept: of all recordings of the trial, or null; its box must contain the volume of this one's
  // rig. Borrows pool and swept. Throws recording::RecordingError, mcap::McapError or
  // std::system_error if the recording cannot be used.
  SessionResults(const std::filesystem::path& file, const TrialRequest& request,
                 base::WorkerPool& pool, surface::SweptVolume* swept);

  // Throws recording::RecordingError if the recording has no complete frame.
  void compute(const std::function<void(double done)>& progress);

  // The functions below need the computed results.
  //
  // of: "Trial 1", at the start of each sentence.
  void add_remarks(const std::string& of, std::vector<std::string>& remarks) const;
  // Adds what was found to the trial, `offset_s` after its start.
  void add_to(report::Trial& trial, double offset_s, const EventPictures* pictures);
  // CLOCK_REALTIME of the first frame: the time 0 of the recording's results.
  std::int64_t start_ns() const {
    return recording_.start_ns() + std::int64_t(1e9 * times_s_.front());
  }
  double duration_s() const { return times_s_.back() + durations_s_.back() - times_s_.front(); }
  const recording::Recording& recording() const { return recording_; }
  const config::Scene& scene() const { return scene_; }

 private:
  std::optional<collision::SpacingInterval> in_view(const config::SceneObject& object) const;
  void sweep(std::vector<std::vector<hull::Silhouette>>& waiting);
  void add_timeline(const std::vector<TimelinePoint>& timeline, const config::SceneObject& object,
                    double offset_s, const EventPictures* pictures, report::PartResult& part);
  void add_spacings(std::size_t reported, double offset_s, report::Trial& trial) const;

  recording::Recording recording_;
  replay::RecordedDeployment recorded_;
  const config::Scene& scene_;
  base::WorkerPool& pool_;
  surface::SweptVolume* swept_;
  StudyOptions options_;
  std::vector<const config::SceneObject*> reported_, movable_;
  std::vector<std::vector<RecordedSpacing>> spacings_;  // by reported part
  std::unique_ptr<SessionTimeline> timeline_;
  std::unique_ptr<SpacingStudy> study_;
  std::vector<std::uint64_t> frames_;
  std::vector<double> times_s_, durations_s_;  // since the start of the recording
  std::map<std::string, std::uint64_t> drops_;
};

}  // namespace fivepipe::study
