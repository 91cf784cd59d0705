// Exit codes of the subcommands that inspect recordings and topics.
#pragma once
#include <functional>
#include <stdexcept>

namespace fivepipe::base {

// The user named something that does not exist or is ambiguous. what() lists the choices.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Calls `run` and returns its exit code. Prints an exception to stderr and returns 2 for a
// UsageError, 1 for any other (for example an unreadable file).
int report_errors(const std::function<int()>& run);

}  // namespace fivepipe::base
