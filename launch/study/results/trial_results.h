// Computes what the report shows of a trial, from its recordings.
#pragma once
#include <functional>

#include "common/study/report/study.h"
#include "launch/study/folder/study_folder.h"

namespace fivepipe::study {

struct TrialRequest {
  int layouts = 25;      // spacings per movable part and curve
  bool pictures = true;  // one per event, from the video of the trial
  bool swept = true;     // the volume that the real objects sweep
  double swept_cell_m = 0.005;
  int threads = 2;
};

// The virtual parts that the report shows: all objects of the scene that keep their shape. A part
// with a `spacing` has an axis.
std::vector<report::Part> report_parts(const config::Scene& scene);

// Adds a sentence to `remarks` for each thing that limits the results: dropped or damaged
// messages, frames without a hull, a video that is missing. Throws recording::RecordingError if a
// recording cannot be used.
report::Trial trial_results(const StudyFolder& study, const StoredTrial& trial,
                            const TrialRequest& request,
                            const std::function<void(double done)>& progress,
                            std::vector<std::string>& remarks);

}  // namespace fivepipe::study
