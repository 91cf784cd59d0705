// The keys by which a replay is paused and stepped: from a terminal at once, from a pipe as well.
#pragma once
#include <termios.h>

#include <optional>

#include "common/recording/replay/replayer.h"

namespace fivepipe::launch {

// space: pause, go on; s: one frame; q: stop. While it lives, the terminal hands out keys without
// return, and does not show them.
class ReplayKeys {
 public:
  explicit ReplayKeys(bool paused);
  ~ReplayKeys();
  ReplayKeys(const ReplayKeys&) = delete;
  ReplayKeys& operator=(const ReplayKeys&) = delete;

  // What the keys typed until now say; a step is told once.
  replay::ReplayControl control();
  bool paused() const { return paused_; }

 private:
  void read_keys();

  bool paused_, stopped_ = false, at_end_ = false;
  int steps_ = 0;
  std::optional<termios> before_;
};

}  // namespace fivepipe::launch
