// Publishes NodeStatus as a node of the deployment `demo` does, until SIGTERM: status_writer NODE
// DOMAIN [VIEWER]. With a viewer's name it also composites 50 frames per second.
#include <sys/prctl.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <string>
#include <thread>

#include "common/base/realtime.h"
#include "common/pipeline/messages/wire_conversions.h"
#include "common/pipeline/node/status.h"
#include "common/pipeline/node/status_names.h"

using namespace fivepipe;

namespace {

volatile std::sig_atomic_t ending = 0;

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return 2;
  prctl(PR_SET_PDEATHSIG, SIGKILL);  // ends with the test
  signal(SIGTERM, [](int) { ending = 1; });
  bus::Bus bus({std::uint32_t(std::stoul(argv[2])), "loopback", argv[1], "demo"});
  node::NodeStatusReporter status(bus, argv[1]);
  auto composited = bus.writer<bus::topics::FrameComposited>();
  fivepipe_v1_FrameComposited message{};
  if (argc > 3) messages::set_text(message.viewer, argv[3]);
  for (; !ending; std::this_thread::sleep_for(std::chrono::milliseconds(20))) {
    status.frame_handled(++message.frame);
    if (argc == 3) continue;
    message.composited_stamp_ns = base::now_realtime_ns();
    composited.write(message);
    status.count(node::kFramesComposited);
  }
  if (argc > 3) std::printf("composited %llu\n", static_cast<unsigned long long>(message.frame));
}
