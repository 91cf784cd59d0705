#include "launch/cli/program.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <iostream>

#include "common/base/usage_error.h"
#include "common/base/version.h"
#include "common/config/yaml/config_error.h"
#include "common/pipeline/bus/bus.h"
#include "launch/cli/commands.h"

namespace fivepipe::launch {
namespace {

int run(int argc, char** argv) {
  CLI::App app(
      "fivepipe puts real, moving objects into a virtual environment.\n\n"
      "Examples:\n"
      "  fivepipe up launch/deployments/demo.yaml --duration 10 --out out/demo\n"
      "  fivepipe top            shows the running nodes\n"
      "  fivepipe ls             lists the topics; echo TOPIC prints messages, hz TOPIC measures "
      "their rate\n"
      "  fivepipe info FILE      describes a recording and checks it for damage\n"
      "  fivepipe doctor         checks whether this machine is ready\n"
      "  fivepipe keys FILE      makes the keys of a deployment with security\n"
      "  fivepipe bench hull     measures the visual hull; bench collision measures collision "
      "detection");
  app.set_version_flag("--version", std::string("fivepipe ") + base::version() + " (" +
                                        base::commit() + ", " + base::build_type() + ")");
  app.require_subcommand(1);
  Command command;
  add_up(app, command);
  add_top(app, command);
  add_record(app, command);
  add_replay(app, command);
  add_info(app, command);
  add_ls(app, command);
  add_echo(app, command);
  add_hz(app, command);
  add_simulation(app, command);
  add_keys(app, command);
  add_doctor(app, command);
  add_bench(app, command);
  add_maps(app, command);
  add_study(app, command);
  add_export(app, command);
  add_segment(app, command);
  add_cameras(app, command);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;  // also after --help and --version
  }
  const int code = command();
  const bool is_ended = code == 0 || code == 130;
  return is_ended && bus::keys_expired() ? 2 : code;
}

}  // namespace

int run_program(int argc, char** argv) {
  spdlog::set_default_logger(spdlog::stderr_color_mt("fivepipe"));
  spdlog::set_pattern("%H:%M:%S.%e %^%l%$ %v");
  try {
    return run(argc, argv);
  } catch (const config::ConfigError& error) {
    std::cerr << error.what() << '\n';
    return 2;
  } catch (const base::UsageError& error) {
    std::cerr << error.what() << '\n';
    return 2;
  } catch (const std::exception& error) {
    spdlog::critical("{}", error.what());
    return 1;
  }
}

}  // namespace fivepipe::launch
