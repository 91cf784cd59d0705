// Counts the signals that request the end of the `fivepipe` command.
#pragma once

namespace fivepipe::launch {

// From this call on, SIGINT, SIGTERM and SIGHUP are counted and have no other effect.
void catch_signals();
int signals_received();  // number since catch_signals()
int newest_signal();     // 0: none

}  // namespace fivepipe::launch
