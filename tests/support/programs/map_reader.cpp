// Reads ObjectPixelMap until it is killed: map_reader DOMAIN. Prints "reads" with the first one.
#include <sys/prctl.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <string>

#include "common/pipeline/bus/bus.h"

using namespace fivepipe;

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  prctl(PR_SET_PDEATHSIG, SIGKILL);  // ends with the test
  bus::Bus bus({std::uint32_t(std::stoul(argv[1]))});
  auto reader = bus.reader<bus::topics::ObjectPixelMap>();
  for (bool reads = false;; bus.wait(std::chrono::milliseconds(20))) {
    if (reader.take().empty() || reads) continue;
    reads = true;
    std::puts("reads");
    std::fflush(stdout);
  }
}
