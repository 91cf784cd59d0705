#include "common/base/process/optional_module.h"

#include <dlfcn.h>

#include <filesystem>
#include <stdexcept>

namespace fivepipe::base {
namespace {

namespace fs = std::filesystem;

fs::path path_of(const OptionalModule& module) {
  return fs::read_symlink("/proc/self/exe").parent_path() / module.file;
}

}  // namespace

bool exists(const OptionalModule& module) { return fs::exists(path_of(module)); }

void* function_of(const OptionalModule& module, const char* function) {
  if (!exists(module))
    throw std::runtime_error(std::string("this build has no ") + module.library + ": install " +
                             module.package + " and build again");
  void* const library = dlopen(path_of(module).c_str(), RTLD_NOW | RTLD_LOCAL);
  void* const found = library ? dlsym(library, function) : nullptr;
  if (!found) {
    const char* const why = dlerror();
    throw std::runtime_error(std::string("cannot load ") + module.library + ": " +
                             (why ? why : function) + "; install " + module.package +
                             " and build again");
  }
  return found;
}

}  // namespace fivepipe::base
