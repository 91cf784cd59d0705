// Reads the keys that pause and step a replay, from a terminal or a pipe.
#pragma once
#include <termios.h>

#include <optional>

#include "common/recording/replay/replayer.h"

namespace fivepipe::launch {

// space: pause or continue; s: one frame; q: stop. While this object exists, the terminal neither
// waits for the return key nor echoes keys.
class ReplayKeys {
 public:
  explicit ReplayKeys(bool paused);
  ~ReplayKeys();
  ReplayKeys(const ReplayKeys&) = delete;
  ReplayKeys& operator=(const ReplayKeys&) = delete;

  // The request of the keys typed so far. Returns each step once.
  replay::ReplayControl control();
  bool paused() const { return paused_; }

 private:
  void read_keys();

  bool paused_, stopped_ = false, at_end_ = false;
  int steps_ = 0;
  std::optional<termios> before_;
};

}  // namespace fivepipe::launch
