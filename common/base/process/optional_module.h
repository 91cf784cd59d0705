// Modules: shared libraries beside the program, which are loaded when their first function is
// needed. They hold the use of a library that is optional or slow to load; that of an optional
// library exists only if the library was installed when fivepipe was built. Only the functions of
// its header are called.
#pragma once

namespace fivepipe::base {

struct OptionalModule {
  const char *file, *library, *package;  // package: Debian's, with the library's headers
};

// Returns the address of a function of the module, which stays loaded. Throws std::runtime_error if
// this build has no such module, or if it cannot be loaded; the message states what to install.
void* function_of(const OptionalModule& module, const char* function);

// Returns whether this build has the module.
bool exists(const OptionalModule& module);

}  // namespace fivepipe::base
