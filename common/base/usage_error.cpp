#include "common/base/usage_error.h"

#include <unistd.h>

#include <iostream>

#include "common/base/output_queue.h"

namespace fivepipe::base {

int report_errors(const std::function<int()>& run) {
  try {
    const int result = run();
    // A full disk is an error; a reader that has seen enough is not.
    if (!std::cout.flush() && !is_broken_pipe(STDOUT_FILENO))
      throw std::runtime_error("cannot write to standard output");
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
