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
  stuck_s_ = std::exchange(loop_, loop) == loop && handles_frames ? stuck_s_ + step_s : 0;
  if (silent_s_ > settings_.silent_s)
    return fmt::format("hangs: no sign of life for {:.1f} s", silent_s_);
  if (stuck_s_ > settings_.stuck_s)
    return fmt::format("hangs: its main loop stands still for {:.0f} s", stuck_s_);
  return "";
}

}  // namespace fivepipe::launch
