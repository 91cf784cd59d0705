// The command line of every node.
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

namespace fivepipe::node {

struct Arguments {
  std::string deployment, node;
  std::filesystem::path out;
  std::optional<std::uint32_t> domain;
  std::map<std::string, std::string> settings;
  bool every_frame = false;
  std::map<std::string, double> spacings_m;  // by object
  std::string host;    // name of this machine in the deployment; empty: find it
  bool local = false;  // use the loopback interface, whatever the deployment's network is
};

// The command line requested help or the version (0), or is wrong (2). parse_arguments() has
// printed the output.
struct CommandLineExit {
  int exit_code;
};

// Parses --deployment FILE --node NAME [--domain N] [--out DIR] [--set KEY=VALUE]...
// [--every-frame] [--spacing OBJECT METRES]... [--host NAME] [--local]. Only sim_node has
// --spacing. Throws CommandLineExit.
Arguments parse_arguments(const std::string& program, int argc, char** argv);

}  // namespace fivepipe::node
