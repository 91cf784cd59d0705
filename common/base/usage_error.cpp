#include "common/base/usage_error.h"

#include <iostream>

namespace fivepipe::base {

int report_errors(const std::function<int()>& run) {
  try {
    const int result = run();
    // A full disk; a closed pipe has ended the process before.
    if (!std::cout.flush()) throw std::runtime_error("standard output can't be written");
    return result;
  } catch (const UsageError& error) {
    std::cerr << error.what() << "\n";
    return 2;
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
}

}  // namespace fivepipe::base
