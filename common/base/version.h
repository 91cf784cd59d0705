#pragma once

namespace fivepipe::base {

const char* version();  // of the project, "0.1.0"
const char* commit();   // short hash of the tree that was built, "+" appended where it had changes;
                        // "unknown" outside a checkout
const char* build_type();

}  // namespace fivepipe::base
