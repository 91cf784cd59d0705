#include "common/base/machine.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/utsname.h>

#include <fstream>
#include <regex>
#include <string>

namespace fivepipe::base {
namespace {

// By the flags that the kernel lists.
TEST(Machine, TheCpuNameIsTheFirstModelNameWithItsVectorExtension) {
  std::ifstream file("/proc/cpuinfo");
  std::string model, flags;
  const std::regex field("(model name|flags)\\s*: (.*)");
  std::smatch match;
  for (std::string line; std::getline(file, line);)
    if (std::regex_match(line, match, field)) {
      std::string& of_field = match[1] == "flags" ? flags : model;
      if (of_field.empty()) of_field = match[2];
    }
  if (model.empty()) model = "unknown";  // for example on Arm
  const auto has = [&](const std::string& flag) {
    return (' ' + flags + ' ').find(' ' + flag + ' ') != std::string::npos;
  };
  EXPECT_EQ(cpu_name(), model + (has("avx512bw") ? " (AVX-512)"
                                 : has("avx2")   ? " (AVX2)"
                                 : has("avx")    ? " (AVX)"
                                                 : ""));
}

TEST(Machine, CountsTheCoresThatTheProcessMayRunOn) {
  cpu_set_t all;
  ASSERT_EQ(sched_getaffinity(0, sizeof all, &all), 0);
  EXPECT_EQ(core_count(), CPU_COUNT(&all));
  cpu_set_t some;
  CPU_ZERO(&some);
  for (int core = 0; core < CPU_SETSIZE && CPU_COUNT(&some) < 2; ++core)
    if (CPU_ISSET(core, &all)) CPU_SET(core, &some);
  ASSERT_EQ(sched_setaffinity(0, sizeof some, &some), 0);
  EXPECT_EQ(core_count(), CPU_COUNT(&some));
  ASSERT_EQ(sched_setaffinity(0, sizeof all, &all), 0);
}

TEST(Machine, TheHostNameIsThatOfTheKernel) {
  utsname name;
  ASSERT_EQ(uname(&name), 0);
  EXPECT_EQ(host_name(), name.nodename);
}

}  // namespace
}  // namespace fivepipe::base
