// Reads ObjectPixelMap until it is killed: map_reader DOMAIN.
#include <sys/prctl.h>

#include <chrono>
#include <csignal>
#include <string>

#include "common/pipeline/bus/bus.h"

using namespace fivepipe;

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  prctl(PR_SET_PDEATHSIG, SIGKILL);  // ends with the test
  bus::Bus bus({std::uint32_t(std::stoul(argv[1]))});
  for (auto reader = bus.reader<bus::topics::ObjectPixelMap>();; reader.take())
    bus.wait(std::chrono::milliseconds(20));
}
