#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <iostream>
#include <system_error>

#include "common/base/usage_error.h"
#include "launch/cli/commands.h"

namespace fivepipe::launch {
namespace {

constexpr const char* kBenchPrefix = "fivepipe_bench_";
// The program of `bench NODE`, `bench pipeline` and `bench compare` (benchmarks/nodes/program).
constexpr const char* kMeasureProgram = "fivepipe_measure";

std::vector<std::string> suites() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(program_folder()))
    if (const std::string file = entry.path().filename();
        file.starts_with(kBenchPrefix) && entry.is_regular_file())
      names.push_back(file.substr(std::string(kBenchPrefix).size()));
  std::sort(names.begin(), names.end());
  return names;
}

// Replaces this process by the program that words.front() names.
[[noreturn]] void exec_program(std::vector<std::string> words) {
  if (!std::filesystem::exists(words.front()))
    throw base::UsageError(words.front() + " is not built; run launch/build --target " +
                           std::filesystem::path(words.front()).filename().string());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  execv(argv.front(), argv.data());
  throw std::system_error(errno, std::generic_category(), words.front());
}

bool has_option(const std::vector<std::string>& words, const std::string& option) {
  return std::any_of(words.begin(), words.end(), [&](const std::string& word) {
    return word == option || word.starts_with(option + "=");
  });
}

// A node can have any name. --from identifies its benchmark, or --help after a word that names no
// suite.
bool is_node_benchmark(const std::vector<std::string>& words,
                       const std::vector<std::string>& known) {
  const std::string& name = words.front();
  const bool names_suite = std::find(known.begin(), known.end(), name) != known.end();
  return name == "compare" || name == "pipeline" || name.ends_with("_node") ||
         has_option(words, "--from") ||
         (!name.starts_with('-') && !names_suite &&
          (has_option(words, "--help") || has_option(words, "-h")));
}

int run_bench(std::vector<std::string> words) {
  const std::vector<std::string> known = suites();
  if (!words.empty() && is_node_benchmark(words, known)) {
    words.insert(words.begin(), program_folder() / kMeasureProgram);
    exec_program(std::move(words));
  }
  if (words.empty() || std::find(known.begin(), known.end(), words.front()) == known.end()) {
    std::cerr << (words.empty() ? "bench: name a benchmark\n"
                                : fmt::format("bench: no benchmark '{}'\n", words.front()))
              << fmt::format(
                     "  suites: {}\n  from a recording: NODE --from FILE.mcap, pipeline --from "
                     "FILE.mcap\n  results: compare BEFORE AFTER\n",
                     known.empty() ? "none in " + program_folder().string() +
                                         "; an installation has none: build the source tree by "
                                         "launch/build, and run build/release/bin/fivepipe bench"
                                   : fmt::format("{}", fmt::join(known, ", ")));
    return 2;
  }
  words.front() = program_folder() / (kBenchPrefix + words.front());
  exec_program(std::move(words));
}

}  // namespace

void add_bench(CLI::App& app, Command& command) {
  CLI::App* bench = app.add_subcommand(
      "bench",
      "Measure a suite, a node or the pipeline: bench SUITE [OPTIONS], bench "
      "NODE --from FILE, bench pipeline --from FILE or --deployment FILE, bench compare BEFORE "
      "AFTER");
  bench->footer(
      "Examples:\n"
      "  fivepipe bench hull --json out/hull.json              a suite: hull, collision, capture, "
      "render, sim, security or features;\n"
      "                                                        in the source tree only\n"
      "  fivepipe bench collision --plot out/collision.png\n"
      "  fivepipe bench recon_node --from session.mcap         the first recon_node of the "
      "deployment alone, from a recording\n"
      "  fivepipe bench pipeline --from session.mcap           all nodes except capture_node, with "
      "the latency by stage\n"
      "  fivepipe bench pipeline --deployment FILE.yaml        all nodes\n"
      "  fivepipe bench compare before.json after.json --fail-above 5%\n"
      "  fivepipe bench hull --help");
  bench->prefix_command();
  bench->callback(
      [bench, &command] { command = [words = bench->remaining()] { return run_bench(words); }; });
}

namespace {

// A subcommand that is a program of its own, with its own help.
void add_program(CLI::App& app, Command& command, const char* name, const char* program,
                 const char* description) {
  CLI::App* sub = app.add_subcommand(name, description);
  sub->set_help_flag();
  sub->prefix_command();
  sub->callback([sub, program, &command] {
    command = [words = sub->remaining(), program]() -> int {
      std::vector<std::string> all{program_folder() / program};
      all.insert(all.end(), words.begin(), words.end());
      exec_program(std::move(all));
    };
  });
}

}  // namespace

void add_maps(CLI::App& app, Command& command) {
  add_program(app, command, "maps", "fivepipe_maps",
              "Write the object-pixel maps of frames as images: maps DEPLOYMENT --out FOLDER "
              "[--frames A:B] [--overlays] [--set KEY=VALUE]");
}

void add_cameras(CLI::App& app, Command& command) {
  add_program(app, command, "cameras", "fivepipe_cameras",
              "List the connected cameras, their modes and the bandwidth that they need: cameras "
              "[--json]");
}

void add_study(CLI::App& app, Command& command) {
  add_program(app, command, "study", "fivepipe_study",
              "How much space a task needs: study new, run, report lead from a scene to a report; "
              "study space moves a part live; study what-if computes other layouts");
}

void add_export(CLI::App& app, Command& command) {
  add_program(app, command, "export", "fivepipe_export",
              "Write the real objects of a recording as meshes, points, tables, depth images or "
              "their swept volume: export RECORDING --out FOLDER [--meshes FORMAT] "
              "[--swept FORMAT] ...");
}

void add_segment(CLI::App& app, Command& command) {
  add_program(app, command, "segment", "fivepipe_segment",
              "Segment one clip into masks and overlays: segment CLIP --out FOLDER "
              "[--background FILE] [--set KEY=VALUE]");
}

}  // namespace fivepipe::launch
