// Errors of image sources at the start of a node. Later faults are reported frame by frame
// (ReadStatus::missing).
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

// what() lists every problem on its own line, as "camera: what".
class SourceError : public std::runtime_error {
 public:
  explicit SourceError(std::vector<SourceProblem> problems);
  const std::vector<SourceProblem>& problems() const { return problems_; }

 private:
  std::vector<SourceProblem> problems_;
};

// At least one of the problems is a device that is missing or delivers no images (exit code 3).
class HardwareMissing : public SourceError {
 public:
  using SourceError::SourceError;
};

// Throws HardwareMissing if a problem concerns hardware, SourceError otherwise. `problems` must not
// be empty.
[[noreturn]] void throw_problems(std::vector<SourceProblem> problems);

}  // namespace fivepipe::capture
