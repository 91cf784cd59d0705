// How the subcommands that look at recordings and topics tell that they can't do what was asked.
#pragma once
#include <functional>
#include <stdexcept>

namespace fivepipe::base {

// What was asked for does not exist, or is not clear; says what there is.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Runs it, and gives its exit code. A UsageError is told on stderr, with exit code 2; what else is
// thrown (a file that can't be read) with 1.
int report_errors(const std::function<int()>& run);

}  // namespace fivepipe::base
