#include "benchmarks/support/suite.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <iostream>

namespace fivepipe::bench {
namespace {

void add_options(CLI::App& app, const Suite& suite, Args& args) {
  app.add_option("--json", args.json_file, "write the results to this file (JSON)");
  app.add_option("--threads", args.threads, "threads of each method, and of OpenGL on a CPU")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  CLI::Option* quick = app.add_flag("--quick", args.quick, "check that the suite runs at all");
  CLI::Option* plot = nullptr;
  if (suite.plot_help) plot = app.add_option("--plot", args.plot_file, suite.plot_help);
  if (suite.maps_help)
    app.add_option("--maps", args.maps, suite.maps_help)
        ->check(CLI::ExistingDirectory)
        ->take_all()
        ->allow_extra_args(false);
  if (suite.only_help) app.add_option("--only", args.only, suite.only_help);
  if (suite.latency_help)
    app.add_option("--latency-ms", args.latency_ms, suite.latency_help)
        ->check(CLI::Range(0.0, 10'000.0));
  if (suite.footage_help)
    app.add_option("--footage", args.footage, suite.footage_help)
        ->check(CLI::ExistingDirectory)
        ->take_all()
        ->allow_extra_args(false);
  CLI::Option* full = nullptr;
  if (suite.full_help) full = app.add_flag("--full", args.full, suite.full_help)->excludes(quick);
  if (suite.every_pixel_help) {
    CLI::Option* const every_pixel =
        app.add_flag("--every-pixel", args.every_pixel, suite.every_pixel_help)->excludes(quick);
    for (CLI::Option* const other : {plot, full})
      if (other) every_pixel->excludes(other);
  }
}

}  // namespace

int run_suite(const Suite& suite, int argc, char** argv,
              const std::function<void(const Args&)>& run) {
  Args args;
  CLI::App app(suite.description, fmt::format("fivepipe bench {}", suite.name));
  app.footer(fmt::format("Example:\n  {}", suite.example));
  add_options(app, suite, args);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  setenv("LP_NUM_THREADS", std::to_string(args.threads).c_str(), 1);
  try {
    run(args);
    return 0;
  } catch (const std::exception& error) {
    std::cerr << fmt::format("bench {}: {}\n", suite.name, error.what());
    return 1;
  }
}

}  // namespace fivepipe::bench
