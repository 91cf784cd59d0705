// Why images can't be had. Found at the start; what goes wrong later is told frame by frame.
#pragma once
#include <stdexcept>
#include <string>
#include <vector>

namespace fivepipe::capture {

enum class SourceFault {
  not_found,
  not_decodable,
  wrong_size,
  no_frames,
  hardware_missing,
  hardware_failed
};

struct SourceProblem {
  std::string camera;
  SourceFault fault;
  std::string what;  // names the file or device
};

// what() lists every problem, one a line, as camera: what.
class SourceError : public std::runtime_error {
 public:
  explicit SourceError(std::vector<SourceProblem> problems);
  const std::vector<SourceProblem>& problems() const { return problems_; }

 private:
  std::vector<SourceProblem> problems_;
};

// At least one of the problems is a device that is not there or does not deliver (exit code 3).
class HardwareMissing : public SourceError {
 public:
  using SourceError::SourceError;
};

// Throws HardwareMissing where a problem is of hardware, else SourceError. At least one problem.
[[noreturn]] void throw_problems(std::vector<SourceProblem> problems);

}  // namespace fivepipe::capture
