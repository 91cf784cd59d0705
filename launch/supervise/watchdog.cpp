#include "launch/supervise/watchdog.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/base/process/heartbeat.h"

namespace fivepipe::launch {

std::string Watchdog::step(std::uint64_t process, std::uint64_t loop, double elapsed_s,
                           bool handles_frames) {
  if (process == 0 || process == base::Beats::kEnding) return "";
  const double step_s = std::clamp(elapsed_s, 0.0, kMaxStep_s);
  silent_s_ = std::exchange(process_, process) == process ? silent_s_ + step_s : 0;
  stalled_s_ = std::exchange(loop_, loop) == loop && handles_frames ? stalled_s_ + step_s : 0;
  if (silent_s_ > settings_.no_heartbeat_s)
    return fmt::format("no heartbeat for {:.1f} s", silent_s_);
  if (stalled_s_ > settings_.stalled_loop_s)
    return fmt::format("its main loop has not run for {:.0f} s", stalled_s_);
  return "";
}

}  // namespace fivepipe::launch
