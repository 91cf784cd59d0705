// The files that belong to the running program: in the build folder of the source tree, or where
// `cmake --install` put them.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace fivepipe::launch {

// The folder of the running program. fivepipe finds the nodes and the benchmarks there.
std::filesystem::path program_folder();

// The names of the deployments that come with the program in `folder`, such as "demo", sorted.
// Empty if there is none.
std::vector<std::string> shipped_deployments(const std::filesystem::path& folder);

// Returns the file of the deployment that the user names: `given` itself if it is a path, has an
// extension, or is a file, otherwise the file of the shipped deployment of this name. If there is
// none, throws base::UsageError, which lists those that exist.
std::filesystem::path deployment_file(const std::string& given,
                                      const std::filesystem::path& folder = program_folder());

}  // namespace fivepipe::launch
