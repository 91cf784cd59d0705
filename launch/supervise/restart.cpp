#include "launch/supervise/restart.h"

#include <algorithm>
#include <cmath>

namespace fivepipe::launch {

RestartDecision RestartPolicy::on_exit(const ProcessExit& exit, double uptime_s) {
  const bool has_code = !exit.by_signal;
  if (has_code && exit.number == 0) return Ended{};

  const bool states_reason =
      has_code && (exit.number == 2 || exit.number == 3) && !settings_.is_dispensable;
  const int deployment_code = states_reason ? exit.number : 1;
  if (states_reason && !is_healthy_)
    return StopDeployment{deployment_code, "cannot start: " + to_string(exit)};

  // If a camera is unplugged, the node exits with code 3 until the camera is back.
  const bool waits_for_hardware = has_code && exit.number == 3;
  const bool was_healthy = uptime_s >= settings_.healthy_after_s;
  if (was_healthy) deaths_in_row_ = 0;
  ++deaths_in_row_;
  if (uptime_s >= settings_.quick_death_s)
    quick_deaths_in_row_ = 0;
  else if (!waits_for_hardware)
    ++quick_deaths_in_row_;
  if (quick_deaths_in_row_ >= settings_.quick_deaths && !settings_.is_dispensable)
    return StopDeployment{deployment_code, "cannot start: died " +
                                               std::to_string(quick_deaths_in_row_) +
                                               " times in a row, last by " + to_string(exit)};

  if (was_healthy && !waits_for_hardware) return Restart{0, ++restarts_};
  const double delay_s =
      std::min(settings_.max_delay_s, settings_.first_delay_s * std::exp2(deaths_in_row_ - 1));
  return Restart{delay_s, ++restarts_};
}

}  // namespace fivepipe::launch
