#include "common/recording/replay/replay_plan.h"

#include "common/base/realtime.h"
#include "common/base/usage_error.h"

namespace fivepipe::replay {

void set_range(ReplayPlan& plan, const recording::Recording& recording, double start_s,
               std::optional<double> end_s) {
  plan.start_ns = base::later_by_s(recording.start_ns(), start_s);
  plan.end_ns = end_s ? base::later_by_s(recording.start_ns(), *end_s) : recording.end_ns();
  if (plan.start_ns > plan.end_ns || plan.start_ns > recording.end_ns())
    throw base::UsageError(
        "nothing to replay: the recording lasts " +
        std::to_string(base::difference_s(recording.end_ns(), recording.start_ns())) +
        " s; --start " + std::to_string(start_s) + " must be before its end and before --end");
}

}  // namespace fivepipe::replay
