#include "common/base/machine.h"

#include <sched.h>
#include <unistd.h>

#include <array>
#include <fstream>

namespace fivepipe::base {
namespace {

std::string vector_extension() {
#if defined(__x86_64__) || defined(__i386__)
  if (__builtin_cpu_supports("avx512bw")) return " (AVX-512)";
  if (__builtin_cpu_supports("avx2")) return " (AVX2)";
  if (__builtin_cpu_supports("avx")) return " (AVX)";
#endif
  return "";
}

}  // namespace

std::string cpu_name() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("model name"))
      if (const std::size_t colon = line.find(": "); colon != std::string::npos)
        return line.substr(colon + 2) + vector_extension();
  return "unknown";
}

int core_count() {
  cpu_set_t cores;
  CPU_ZERO(&cores);
  return sched_getaffinity(0, sizeof cores, &cores) == 0 ? CPU_COUNT(&cores) : 1;
}

std::string host_name() {
  std::array<char, 256> name{};
  gethostname(name.data(), name.size() - 1);
  return name.data();
}

}  // namespace fivepipe::base
