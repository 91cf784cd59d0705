// Runs a fuzz target in a child process, which a crash ends and whose time and memory are bounded.
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

#include "tests/fuzz/target.h"
#include "tests/support/sanitizer.h"

namespace fivepipe::fuzz {

// Bounds for one input. The CPU time is that of the checking process alone, so that a busy machine
// does not fail the test. The elapsed time ends an input that waits for ever.
struct Limits {
  double cpu_s = 2.0 * test::kSlowdown;
  double elapsed_s = 60.0 * test::kSlowdown;
  std::size_t memory_bytes = std::size_t{1} * test::kSlowdown << 30;  // resident
};

struct Report {
  std::uint32_t inputs = 0, accepted = 0;
  std::uint32_t seed = 0;            // of the finding, or of the last input
  std::string finding;               // empty: none
  std::filesystem::path kept_input;  // folder with the files of the finding
};

// Checks the inputs of first_seed, first_seed + 1, ... for duration_s seconds and at least
// min_inputs of them, or until a finding, whose files it copies to `keep_in`/fuzz_TARGET_SEED. Must
// be called from a process with one thread.
Report run(const Target& target, double duration_s, std::uint32_t min_inputs,
           std::uint32_t first_seed, const std::filesystem::path& keep_in,
           const Limits& limits = {});

}  // namespace fivepipe::fuzz
