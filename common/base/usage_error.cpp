#include "common/base/usage_error.h"

#include <iostream>

namespace fivepipe::base {

int report_errors(const std::function<int()>& run) {
  try {
    const int result = run();
    // This reports a full disk. A closed pipe ends the process earlier, by SIGPIPE.
    if (!std::cout.flush()) throw std::runtime_error("cannot write to standard output");
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
