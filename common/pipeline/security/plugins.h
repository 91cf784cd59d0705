// Where the security plugins of Cyclone DDS are.
#pragma once
#include <string>

namespace fivepipe::security {

// name: "auth", "ac" or "crypto". Returns the path of the plugin beside the library of Cyclone DDS
// that this process uses, or in the folder beside it in which Debian keeps it, such as
// libddsc0debian/. If it is in neither, returns the name by which the loader searches its own
// folders.
std::string plugin_library(const std::string& name);

}  // namespace fivepipe::security
