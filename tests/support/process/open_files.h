// The open files of this process.
#pragma once
#include <sys/resource.h>
#include <unistd.h>

#include <cstddef>
#include <exception>
#include <filesystem>
#include <iterator>

#include "tests/support/sanitizer.h"

namespace fivepipe::test {

// Counts the file that reads the list, too.
inline std::size_t open_files() {
  return std::size_t(std::distance(std::filesystem::directory_iterator("/proc/self/fd"),
                                   std::filesystem::directory_iterator()));
}

// While it exists, this process can open no further file.
class NoFurtherFile {
 public:
  NoFurtherFile() {
    getrlimit(RLIMIT_NOFILE, &before_);
    const int lowest_free = dup(STDERR_FILENO);
    close(lowest_free);
    rlimit none = before_;
    none.rlim_cur = rlim_t(lowest_free);
    setrlimit(RLIMIT_NOFILE, &none);
  }
  ~NoFurtherFile() { setrlimit(RLIMIT_NOFILE, &before_); }
  NoFurtherFile(const NoFurtherFile&) = delete;
  NoFurtherFile& operator=(const NoFurtherFile&) = delete;

 private:
  rlimit before_{};
};

// The undefined-behaviour sanitizer of preset asan examines an exception as it is made, and needs a
// pipe for that.
inline constexpr bool kCanThrowWithoutFiles = !kHasAddressSanitizer;

// Returns what `call` throws while no further file can be opened, or null.
template <class Call>
std::exception_ptr thrown_without_files(const Call& call) {
  const NoFurtherFile limit;
  try {
    call();
  } catch (...) {
    return std::current_exception();
  }
  return nullptr;
}

}  // namespace fivepipe::test
