// Progress of a long command, on stderr.
#pragma once
#include <chrono>
#include <string>

namespace fivepipe::base {

// Prints "NAME: 40 %, about 12 s left": twice a second if stderr is a terminal, else every 10 s.
// The first time after 1 s, so that short commands print nothing.
class ProgressLine {
 public:
  explicit ProgressLine(std::string name);
  ~ProgressLine();  // ends the line of a terminal
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  // done: part of the work that is done, 0 to 1.
  void operator()(double done);

 private:
  using Clock = std::chrono::steady_clock;
  std::string name_;
  bool is_terminal_, has_printed_ = false;
  Clock::time_point start_ = Clock::now(), next_ = start_ + std::chrono::seconds(1);
};

}  // namespace fivepipe::base
