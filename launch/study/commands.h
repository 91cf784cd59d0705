// The subcommands of `fivepipe study`, one file each.
#pragma once
#include <CLI/CLI.hpp>
#include <functional>

namespace fivepipe::study {

// Runs the subcommand that the command line selected and returns the exit code.
using Command = std::function<int()>;

// Adds the subcommand to `app`. Parsing sets `command`, which must outlive `app`.
void add_space(CLI::App& app, Command& command);
void add_what_if(CLI::App& app, Command& command);

}  // namespace fivepipe::study
