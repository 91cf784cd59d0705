// The folder of the running program.
#pragma once
#include <filesystem>

namespace fivepipe::launch {

// fivepipe finds the nodes and the benchmarks in this folder.
std::filesystem::path program_folder();

}  // namespace fivepipe::launch
