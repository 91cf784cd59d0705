#include "launch/supervise/interrupt.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

namespace fivepipe::launch {
namespace {

// In a child process, because the signals stay caught.
TEST(Interrupt, EachSignalThatRequestsTheEndIsCounted) {
  const pid_t child = fork();
  if (child == 0) {
    if (signals_received() != 0 || newest_signal() != 0) _exit(1);
    catch_signals();
    int raised = 0;
    for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGINT}) {
      raise(number);
      ++raised;
      if (signals_received() != raised || newest_signal() != number) _exit(1 + raised);
    }
    raise(SIGPIPE);
    _exit(signals_received() == raised && newest_signal() == SIGINT ? 0 : 9);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
}  // namespace fivepipe::launch
