#include "common/base/process/progress_line.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <utility>

namespace fivepipe::base {

ProgressLine::ProgressLine(std::string name)
    : name_(std::move(name)), is_terminal_(isatty(STDERR_FILENO) == 1) {}

ProgressLine::~ProgressLine() {
  if (is_terminal_ && has_printed_) std::fputs("\n", stderr);
}

void ProgressLine::operator()(double done) {
  const auto now = Clock::now();
  if (now < next_ || !(done > 0)) return;
  const double passed_s = std::chrono::duration<double>(now - start_).count();
  fmt::print(stderr, "{}{}: {:.0f} %, about {:.0f} s left{}", is_terminal_ ? "\r" : "", name_,
             100 * done, passed_s * (1 - done) / done, is_terminal_ ? "   " : "\n");
  std::fflush(stderr);
  has_printed_ = true;
  next_ = now + (is_terminal_ ? std::chrono::milliseconds(500) : std::chrono::seconds(10));
}

}  // namespace fivepipe::base
