// fivepipe study: how much space a task needs, from recorded sessions.
#include <iostream>

#include "common/base/usage_error.h"
#include "common/config/yaml/config_error.h"
#include "launch/study/commands.h"

namespace fivepipe::study {
namespace {

int run(int argc, char** argv) {
  CLI::App app("fivepipe study: how much space a task needs, from sessions and recordings.");
  app.require_subcommand(1);
  app.footer(
      "Examples:\n"
      "  fivepipe study new spacing --deployment payload\n"
      "  fivepipe study run spacing --participant P1 --duration 30\n"
      "  fivepipe study report spacing\n"
      "  fivepipe study space 18cm --deployment payload.yaml\n"
      "  fivepipe study what-if session.mcap --part side_block --axis x --range -40cm:20cm");
  Command command;
  for (const auto add : {add_new, add_register, add_run, add_space, add_edit, add_list, add_report,
                         add_forget, add_what_if})
    add(app, command);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return command();
}

}  // namespace
}  // namespace fivepipe::study

int main(int argc, char** argv) {
  try {
    return fivepipe::study::run(argc, argv);
  } catch (const fivepipe::config::ConfigError& error) {
    return std::cerr << error.what() << '\n', 2;
  } catch (const fivepipe::base::UsageError& error) {
    return std::cerr << "fivepipe study: " << error.what() << '\n', 2;
  } catch (const std::exception& error) {
    return std::cerr << "fivepipe study: " << error.what() << '\n', 1;
  }
}
