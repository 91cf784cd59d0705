#include "launch/cli/replay_keys.h"

#include <poll.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

namespace fivepipe::launch {

ReplayKeys::ReplayKeys(bool paused) : paused_(paused) {
  termios now{};
  if (!isatty(STDIN_FILENO) || tcgetattr(STDIN_FILENO, &now) != 0) return;
  // A background job must not read from its terminal.
  if (tcgetpgrp(STDIN_FILENO) != getpgrp()) {
    at_end_ = true;
    return;
  }
  before_ = now;
  now.c_lflag &= ~tcflag_t(ICANON | ECHO);
  tcsetattr(STDIN_FILENO, TCSANOW, &now);
}

ReplayKeys::~ReplayKeys() {
  if (before_) tcsetattr(STDIN_FILENO, TCSANOW, &*before_);
}

void ReplayKeys::read_keys() {
  for (pollfd input{STDIN_FILENO, POLLIN, 0}; !at_end_ && poll(&input, 1, 0) > 0;) {
    char key = 0;
    if (read(STDIN_FILENO, &key, 1) != 1) {
      at_end_ = true;
      return;
    }
    if (key == ' ') paused_ = !paused_;
    if (key == 's') {
      paused_ = true;
      ++steps_;
    }
    if (key == 'q') stopped_ = true;
  }
}

replay::ReplayControl ReplayKeys::control() {
  read_keys();
  if (stopped_) return replay::ReplayControl::stop;
  if (!paused_) return replay::ReplayControl::resume;
  if (steps_ == 0 && at_end_) {
    spdlog::warn("stdin closed while paused; stopping the replay");
    stopped_ = true;
    return replay::ReplayControl::stop;
  }
  if (steps_ == 0) return replay::ReplayControl::pause;
  --steps_;
  return replay::ReplayControl::step;
}

}  // namespace fivepipe::launch
