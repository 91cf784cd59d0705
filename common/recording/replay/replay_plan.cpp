#include "common/recording/replay/replay_plan.h"

#include "common/base/usage_error.h"

namespace fivepipe::replay {

void set_range(ReplayPlan& plan, const recording::Recording& recording, double start_s,
               std::optional<double> end_s) {
  plan.start_ns = recording.start_ns() + std::int64_t(1e9 * start_s);
  plan.end_ns = end_s ? recording.start_ns() + std::int64_t(1e9 * *end_s) : recording.end_ns();
  if (plan.start_ns > plan.end_ns || plan.start_ns > recording.end_ns())
    throw base::UsageError(
        "nothing to replay: the recording lasts " +
        std::to_string(1e-9 * double(recording.end_ns() - recording.start_ns())) + " s; --start " +
        std::to_string(start_s) + " must be before its end and before --end");
}

}  // namespace fivepipe::replay
