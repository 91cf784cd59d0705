#include "tests/fuzz/runner.h"
#include "tests/support/process/cpu_time.h"
#include "tests/support/process/memory.h"
#include "tests/support/test_folder.h"

#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <new>
#include <optional>
#include <stdexcept>

namespace fivepipe::fuzz {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr int kFindingExitCode = 77;

// The child writes it, in shared memory, for the parent.
struct Progress {
  std::atomic<std::uint32_t> inputs = 0, accepted = 0, seed = 0;
  std::atomic<double> start_cpu_s = 0;  // CPU time of the child at the start of the current input
  char finding[4000] = {};
};

// Writes the input as new files: ext4 waits for the disk if an existing file is written again.
void write_input(const std::vector<File>& files, const fs::path& folder) {
  for (const auto& entry : fs::directory_iterator(folder)) fs::remove_all(entry.path());
  for (const File& file : files) std::ofstream(folder / file.name, std::ios::binary) << file.bytes;
}

Verdict verdict_of(const Target& target, std::uint32_t seed, const fs::path& folder) {
  Random random(seed);
  try {
    write_input(target.input(random), folder);
    return target.check(folder);
  } catch (const std::exception& error) {
    return {false, std::string("exception: ") + error.what()};
  }
}

[[noreturn]] void check_inputs(const Target& target, Clock::time_point end,
                               std::uint32_t min_inputs, std::uint32_t first_seed,
                               const fs::path& folder, Progress& progress) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  for (std::uint32_t seed = first_seed; Clock::now() < end || progress.inputs < min_inputs;
       ++seed) {
    progress.start_cpu_s = test::cpu_s(getpid());
    progress.seed = seed;
    ++progress.inputs;
    const Verdict verdict = verdict_of(target, seed, folder);
    if (!verdict.broken.empty()) {
      std::strncpy(progress.finding, verdict.broken.c_str(), sizeof progress.finding - 1);
      _exit(kFindingExitCode);
    }
    progress.accepted += verdict.accepted;
  }
  _exit(0);
}

std::string finding_of_exit(int status, const Progress& progress) {
  if (WIFSIGNALED(status)) return fmt::format("ended by signal {}", WTERMSIG(status));
  if (WEXITSTATUS(status) == kFindingExitCode) return progress.finding;
  if (WEXITSTATUS(status) != 0)
    return fmt::format("ended with exit code {}: see the sanitizer's report", WEXITSTATUS(status));
  return "";
}

// Waits for the child and enforces the limits. Returns its finding.
std::string watch(pid_t child, const Progress& progress, const Limits& limits) {
  constexpr timespec kPoll{0, 20'000'000};
  std::uint32_t inputs = 0;
  Clock::time_point input_start = Clock::now();
  for (int status = 0;;) {
    if (waitpid(child, &status, WNOHANG) == child) return finding_of_exit(status, progress);
    if (const std::uint32_t now = progress.inputs; now != inputs) {
      inputs = now;
      input_start = Clock::now();
    }
    const double start_cpu_s = progress.start_cpu_s, used_cpu_s = test::cpu_s(child) - start_cpu_s;
    std::string finding;
    if (used_cpu_s > limits.cpu_s && inputs == progress.inputs)
      finding = fmt::format("needs more than {} s of CPU time", limits.cpu_s);
    else if (Clock::now() - input_start > std::chrono::duration<double>(limits.elapsed_s))
      finding = fmt::format("needs more than {} s", limits.elapsed_s);
    else if (test::resident_bytes(child) > limits.memory_bytes)
      finding = fmt::format("needs more than {} MiB", limits.memory_bytes >> 20);
    if (!finding.empty()) {
      kill(child, SIGKILL);
      waitpid(child, nullptr, 0);
      return finding;
    }
    nanosleep(&kPoll, nullptr);
  }
}

struct SharedProgress {
  void* memory =
      mmap(nullptr, sizeof(Progress), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  Progress* progress = nullptr;
  SharedProgress() {
    if (memory == MAP_FAILED) throw std::runtime_error("no shared memory");
    progress = new (memory) Progress;
  }
  ~SharedProgress() { munmap(memory, sizeof(Progress)); }
  SharedProgress(const SharedProgress&) = delete;
  SharedProgress& operator=(const SharedProgress&) = delete;
};

}  // namespace

Report run(const Target& target, double duration_s, std::uint32_t min_inputs,
           std::uint32_t first_seed, const fs::path& keep_in, const Limits& limits) {
  const test::TestFolder folder;
  const SharedProgress shared;
  const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                      std::chrono::duration<double>(duration_s));
  std::fflush(nullptr);
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("fork failed");
  if (child == 0) check_inputs(target, end, min_inputs, first_seed, folder.path, *shared.progress);
  Report report;
  report.finding = watch(child, *shared.progress, limits);
  report.inputs = shared.progress->inputs;
  report.accepted = shared.progress->accepted;
  report.seed = shared.progress->seed;
  if (!report.finding.empty()) {
    report.kept_input = keep_in / fmt::format("fuzz_{}_{}", target.name, report.seed);
    fs::remove_all(report.kept_input);
    fs::copy(folder.path, report.kept_input, fs::copy_options::recursive);
  }
  return report;
}

}  // namespace fivepipe::fuzz
