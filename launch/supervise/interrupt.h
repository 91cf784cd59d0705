// Counts the signals that request the end of the `fivepipe` command, and survives the end of the
// program that reads its output.
#pragma once

namespace fivepipe::launch {

// From this call on, SIGINT, SIGTERM and SIGHUP are counted and have no other effect. SIGPIPE is
// ignored.
void catch_signals();
// From this call on, a write to a closed pipe fails instead of ending the process: `fivepipe up |
// head -1` continues. ChildProcess restores the default for its children.
void ignore_closed_pipes();
int signals_received();  // number since catch_signals()
int newest_signal();     // 0: none

}  // namespace fivepipe::launch
