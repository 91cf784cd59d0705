#pragma once

namespace fivepipe::base {

const char* version();  // the project's version, such as "0.1.0"
// The short hash of the commit that was built, with "+" appended if tracked files had changes.
// "unknown" outside a git checkout.
const char* commit();
const char* build_type();  // of CMake, such as "Release"

}  // namespace fivepipe::base
