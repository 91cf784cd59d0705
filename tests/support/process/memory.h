// Memory of processes.
#pragma once
#include <sys/types.h>
#include <unistd.h>

#include <cstddef>
#include <fstream>
#include <string>

namespace fivepipe::test {

// Resident memory of the process; 0 if there is no such process.
inline std::size_t resident_bytes(pid_t pid) {
  std::size_t total_pages = 0, resident_pages = 0;
  std::ifstream("/proc/" + std::to_string(pid) + "/statm") >> total_pages >> resident_pages;
  return resident_pages * std::size_t(sysconf(_SC_PAGESIZE));
}

}  // namespace fivepipe::test
