// The subcommands of `fivepipe`, each in a file of its own name; bench and maps are programs of
// their own, in other_programs.cpp.
#pragma once
#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>

namespace fivepipe::launch {

// What the command line asked for; returns the exit code.
using Command = std::function<int()>;

// Each adds its subcommand to the application, and sets `command` when it is parsed.
void add_up(CLI::App& app, Command& command);
void add_top(CLI::App& app, Command& command);
void add_record(CLI::App& app, Command& command);
void add_replay(CLI::App& app, Command& command);
void add_info(CLI::App& app, Command& command);
void add_ls(CLI::App& app, Command& command);
void add_echo(CLI::App& app, Command& command);
void add_hz(CLI::App& app, Command& command);
void add_simulation(CLI::App& app, Command& command);
void add_doctor(CLI::App& app, Command& command);
void add_bench(CLI::App& app, Command& command);
void add_maps(CLI::App& app, Command& command);

// The folder of the running program, where its sibling programs lie.
std::filesystem::path program_folder();

}  // namespace fivepipe::launch
