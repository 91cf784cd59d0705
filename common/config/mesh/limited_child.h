// Calls a function in a child process whose time and memory are limited.
#pragma once
#include <cstddef>
#include <functional>
#include <string>

namespace fivepipe::config {

struct ChildLimits {
  unsigned cpu_s;            // CPU time
  unsigned elapsed_s;        // at least cpu_s; ends a child that waits without end
  std::size_t memory_bytes;  // address space, in addition to that of the caller
};

struct ChildResult {
  std::string bytes;    // what the function returned
  std::string failure;  // what the function did instead, such as "crashes (signal 11)"; else empty
};

// Calls `function` in a forked child and returns its result. A crash, an endless loop or too much
// memory ends the child alone. SIGINT, SIGTERM and SIGHUP do not end it, but the caller's end does.
// This is no sandbox: the child has the rights of the caller.
//
// Of the caller's threads, the child has only the calling one, so `function` must not wait for
// others. What it writes to stdout and stderr is dropped. Throws std::system_error if no child can
// be started.
ChildResult call_in_child(const std::function<std::string()>& function, const ChildLimits& limits);

// Raises the limits of the calling child, in proportion to input of which the caller of
// call_in_child() did not know.
void raise_own_limits(const ChildLimits& by);

}  // namespace fivepipe::config
