// fivepipe export: the real objects of a recording as files of other programs.
#include <CLI/CLI.hpp>
#include <iostream>

#include "common/base/usage_error.h"
#include "common/config/yaml/config_error.h"
#include "launch/export/export_command.h"

namespace fivepipe::exports {
namespace {

int run(int argc, char** argv) {
  CLI::App app;
  ExportCommand command(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return command.run();
}

}  // namespace
}  // namespace fivepipe::exports

int main(int argc, char** argv) {
  try {
    return fivepipe::exports::run(argc, argv);
  } catch (const fivepipe::config::ConfigError& error) {
    return std::cerr << error.what() << '\n', 2;
  } catch (const fivepipe::base::UsageError& error) {
    return std::cerr << "fivepipe export: " << error.what() << '\n', 2;
  } catch (const std::exception& error) {
    return std::cerr << "fivepipe export: " << error.what() << '\n', 1;
  }
}
