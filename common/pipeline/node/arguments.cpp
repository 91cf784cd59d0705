#include "common/pipeline/node/arguments.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <utility>
#include <vector>

#include "common/base/version.h"
#include "common/config/deployment.h"

namespace fivepipe::node {

Arguments parse_arguments(const std::string& program, int argc, char** argv) {
  CLI::App app("fivepipe " + program +
               " is one process of a deployment. `fivepipe up` starts it.\n\nExample: " + program +
               " --deployment launch/deployments/demo.yaml --node NAME\n\nExit codes: 0 ended "
               "cleanly, 1 failed, 2 usage, configuration or image file, 3 camera missing.");
  app.set_version_flag("--version", std::string(base::version()) + " (" + base::commit() + ", " +
                                        base::build_type() + ")");
  Arguments args;
  std::vector<std::string> settings;
  std::vector<std::pair<std::string, double>> spacings_m;
  std::uint32_t domain = 0;
  app.add_option("--deployment", args.deployment, "deployment file (YAML)")->required();
  app.add_option("--node", args.node, "name of the node in the deployment")->required();
  app.add_option("--out", args.out, "folder for the files that the node writes");
  CLI::Option* domain_option =
      app.add_option("--domain", domain, "DDS domain (default: the deployment's)")
          ->check(CLI::Range(0, config::kMaxDomain));
  app.add_option("--set", settings, "KEY=VALUE replaces ${KEY} in the deployment; repeatable")
      ->allow_extra_args(false);
  app.add_flag(
      "--every-frame", args.every_frame,
      "capture_node: process every frame of the files, without a clock, and end with them");
  app.add_option("--spacing", spacings_m,
                 "OBJECT METRES: sim_node: the object begins with this spacing instead of the "
                 "scene's; repeatable")
      ->allow_extra_args(false);
  app.add_option("--host", args.host, "name of this machine in the deployment");
  app.add_flag("--local", args.local,
               "use the loopback interface instead of the deployment's network");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    throw CommandLineExit{app.exit(error) == 0 ? 0 : 2};
  }
  if (!spacings_m.empty() && program != "sim_node") {
    std::cerr << program << ": only sim_node has --spacing; omit it\n";
    throw CommandLineExit{2};
  }
  if (*domain_option) args.domain = domain;
  for (const auto& [object, spacing_m] : spacings_m) args.spacings_m[object] = spacing_m;
  for (const std::string& setting : settings) {
    const std::size_t equals = setting.find('=');
    if (equals == std::string::npos || equals == 0) {
      std::cerr << program << ": --set expects KEY=VALUE, got '" << setting << "'\n";
      throw CommandLineExit{2};
    }
    args.settings[setting.substr(0, equals)] = setting.substr(equals + 1);
  }
  return args;
}

}  // namespace fivepipe::node
