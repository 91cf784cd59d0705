// The exception of the files that render_node writes.
#pragma once
#include <stdexcept>

namespace fivepipe::render {

// A file cannot be written; what() names the file and the reason.
struct OutputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace fivepipe::render
