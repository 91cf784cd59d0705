#include "common/pipeline/security/plugins.h"

#include <dlfcn.h>

#include <filesystem>

namespace fivepipe::security {
namespace {

// The library of Cyclone DDS without links; empty if this process does not use it.
std::filesystem::path cyclone_library() {
  const void* const function = dlsym(RTLD_DEFAULT, "dds_create_participant");
  Dl_info info{};
  if (!function || dladdr(function, &info) == 0 || !info.dli_fname) return {};
  std::error_code error;
  return std::filesystem::canonical(info.dli_fname, error);
}

}  // namespace

std::string plugin_library(const std::string& name) {
  const std::string file = "libdds_security_" + name + ".so";
  const std::filesystem::path folder = cyclone_library().parent_path();
  std::error_code error;
  if (std::filesystem::exists(folder / file, error)) return folder / file;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error))
    if (entry.path().filename().string().starts_with("libddsc") && entry.is_directory(error) &&
        std::filesystem::exists(entry.path() / file, error))
      return entry.path() / file;
  return "dds_security_" + name;
}

}  // namespace fivepipe::security
