// The subcommands of `fivepipe study`, one file each.
#pragma once
#include <CLI/CLI.hpp>
#include <functional>

namespace fivepipe::study {

// Runs the subcommand that the command line selected and returns the exit code.
using Command = std::function<int()>;

// Adds the subcommands to `app`. Parsing sets `command`, which must outlive `app`.
void add_new(CLI::App& app, Command& command);
void add_register(CLI::App& app, Command& command);
void add_run(CLI::App& app, Command& command);
void add_space(CLI::App& app, Command& command);
void add_edit(CLI::App& app, Command& command);
void add_list(CLI::App& app, Command& command);
void add_report(CLI::App& app, Command& command);
void add_forget(CLI::App& app, Command& command);
void add_what_if(CLI::App& app, Command& command);

}  // namespace fivepipe::study
