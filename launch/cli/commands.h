// The subcommands of `fivepipe`. Each has a file of its own name, except bench, maps, study,
// export, segment and cameras: these are programs of their own, which other_programs.cpp starts.
#pragma once
#include <CLI/CLI.hpp>
#include <functional>

#include "launch/supervise/own_files.h"

namespace fivepipe::launch {

// Runs the subcommand that the command line selected and returns the exit code.
using Command = std::function<int()>;

// Each function adds its subcommand to `app`. Parsing sets `command`, which must outlive `app`.
void add_up(CLI::App& app, Command& command);
void add_top(CLI::App& app, Command& command);
void add_record(CLI::App& app, Command& command);
void add_replay(CLI::App& app, Command& command);
void add_info(CLI::App& app, Command& command);
void add_ls(CLI::App& app, Command& command);
void add_echo(CLI::App& app, Command& command);
void add_hz(CLI::App& app, Command& command);
void add_simulation(CLI::App& app, Command& command);
void add_keys(CLI::App& app, Command& command);
void add_doctor(CLI::App& app, Command& command);
void add_bench(CLI::App& app, Command& command);
void add_maps(CLI::App& app, Command& command);
void add_study(CLI::App& app, Command& command);
void add_export(CLI::App& app, Command& command);
void add_segment(CLI::App& app, Command& command);
void add_cameras(CLI::App& app, Command& command);

}  // namespace fivepipe::launch
