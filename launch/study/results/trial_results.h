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

// Adds to `shown` the scene of the trial as it was recorded, unless it has the same one, and a
// sentence to its remarks for each thing that limits the results: dropped or damaged messages,
// frames without a hull, a video that is missing, a recording that cannot be used.
report::Trial trial_results(const StudyFolder& study, const StoredTrial& trial,
                            const TrialRequest& request,
                            const std::function<void(double done)>& progress, report::Study& shown);

}  // namespace fivepipe::study
