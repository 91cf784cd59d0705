// Signals that ask the `fivepipe` command to end.
#pragma once

namespace fivepipe::launch {

// From here on SIGINT, SIGTERM and SIGHUP are counted, and nothing else.
void catch_signals();
int signals_received();
int newest_signal();  // 0: none

}  // namespace fivepipe::launch
