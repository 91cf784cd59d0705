#include "common/base/process/heartbeat.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <string>
#include <thread>

namespace fivepipe::base {
namespace {

// Runs `work` in a child process whose heartbeat is this file; returns its exit code.
template <class Work>
int in_child(int file, const Work& work) {
  const pid_t child = fork();
  if (child == 0) {
    setenv(kHeartbeatVariable, std::to_string(file).c_str(), 1);
    _exit(work());
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST(HeartbeatTest, TheSupervisorSeesTheBeatsOfTheProcess) {
  const Heartbeat heartbeat;
  EXPECT_EQ(heartbeat.process(), 0u);
  EXPECT_EQ(in_child(heartbeat.file(),
                     [&] {
                       const BeatingThread beating;
                       for (int i = 0; i < 3; ++i) beat_loop();
                       const auto until =
                           std::chrono::steady_clock::now() + std::chrono::seconds(20);
                       while (heartbeat.process() < 4 && std::chrono::steady_clock::now() < until)
                         std::this_thread::sleep_for(std::chrono::milliseconds(5));
                       return heartbeat.process() >= 4 ? 0 : 1;
                     }),
            0);
  EXPECT_EQ(heartbeat.loop(), 3u);
}

TEST(HeartbeatTest, AnEndingProcessBeatsNoMore) {
  const Heartbeat heartbeat;
  EXPECT_EQ(in_child(heartbeat.file(),
                     [] {
                       const BeatingThread beating;
                       return 0;
                     }),
            0);
  EXPECT_EQ(heartbeat.process(), Beats::kEnding);
}

TEST(HeartbeatTest, ChildrenOfTheProcessHaveNone) {
  const Heartbeat heartbeat;
  EXPECT_EQ(in_child(heartbeat.file(),
                     [] {
                       beat_loop();
                       return std::getenv(kHeartbeatVariable) == nullptr ? 0 : 1;
                     }),
            0);
}

TEST(HeartbeatTest, WithoutASupervisorOrWithAnotherFileNothingHappens) {
  const int other = open("/dev/null", O_RDWR | O_CLOEXEC);
  for (const int file : {other, 9999, -1})
    EXPECT_EQ(in_child(file,
                       [] {
                         const BeatingThread beating;
                         beat_loop();
                         return 0;
                       }),
              0);
  close(other);
}

// A process that shrinks the memory would end the supervisor by SIGBUS.
TEST(HeartbeatTest, TheProcessCannotShrinkTheMemory) {
  const Heartbeat heartbeat;
  EXPECT_EQ(in_child(heartbeat.file(), [&] { return ftruncate(heartbeat.file(), 0) == 0 ? 1 : 0; }),
            0);
  EXPECT_EQ(heartbeat.process(), 0u);
}

}  // namespace
}  // namespace fivepipe::base
