#include "launch/supervise/own_files.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "common/base/usage_error.h"

namespace fivepipe::launch {
namespace {

namespace fs = std::filesystem;

// From the folder of the programs: lib/fivepipe of an installation, build/PRESET/bin of the source
// tree.
constexpr const char* kDeployments[] = {"../../share/fivepipe/launch/deployments",
                                        "../../../launch/deployments"};

fs::path deployments_of(const fs::path& folder) {
  for (const char* const relative : kDeployments) {
    std::error_code error;
    if (const fs::path found = fs::weakly_canonical(folder / relative, error);
        fs::is_directory(found, error))
      return found;
  }
  return {};
}

}  // namespace

fs::path program_folder() { return fs::read_symlink("/proc/self/exe").parent_path(); }

std::vector<std::string> shipped_deployments(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(deployments_of(folder), error))
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem());
  std::sort(names.begin(), names.end());
  return names;
}

fs::path deployment_file(const std::string& given, const fs::path& folder) {
  std::error_code error;
  const fs::path path = given;
  if (path.has_parent_path() || path.has_extension() || fs::is_regular_file(path, error))
    return path;
  const std::vector<std::string> names = shipped_deployments(folder);
  if (!std::binary_search(names.begin(), names.end(), given))
    throw base::UsageError(
        names.empty() ? fmt::format("there is no file {}", given)
                      : fmt::format("there is no file {}, and no shipped deployment of this name; "
                                    "shipped: {}",
                                    given, fmt::join(names, ", ")));
  return deployments_of(folder) / (given + ".yaml");
}

}  // namespace fivepipe::launch
