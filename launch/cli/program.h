// The program `fivepipe`.
#pragma once

namespace fivepipe::launch {

// Parses the command line, runs the subcommand and returns the exit code: 0 done, 1 failed, 2 wrong
// usage or configuration.
int run_program(int argc, char** argv);

}  // namespace fivepipe::launch
