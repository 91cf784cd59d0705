// What a fuzzer reads: how its inputs are made, and what must hold for each of them.
#pragma once
#include <cstdint>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

namespace fivepipe::fuzz {

// All randomness of an input. std::mt19937 and % give the same input on every machine.
using Random = std::mt19937;

struct File {
  std::string name, bytes;
};

// Result of one input: whether the product accepted it, and the invariant that does not hold, empty
// if all hold.
struct Verdict {
  bool accepted = false;
  std::string broken;
};

struct Target {
  std::string name;
  std::string what;  // what it reads, for the usage text
  // Returns the files of an input: a damaged copy of a valid one, or the valid one itself.
  std::vector<File> (*input)(Random&);
  // Reads the files of an input, which are alone in `folder`, as the product does. May write
  // further files there. An exception is a broken invariant, too.
  Verdict (*check)(const std::filesystem::path& folder);
};

Target mcap_target();
Target map_target();
Target tile_target();
Target rig_target();
Target scene_target();
Target deployment_target();
Target mesh_target();
Target texture_target();

}  // namespace fivepipe::fuzz
