// The main() of every `fivepipe bench SUITE` program: arguments, help and exit codes.
#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace fivepipe::bench {

struct Args {
  std::string json_file, plot_file;
  std::string only;  // a text that a result's name must contain; empty: all results
  std::vector<std::string> maps, footage;  // folders; footage: of recordings
  int threads = 2;
  bool quick = false, full = false, every_pixel = false;
  std::optional<double> latency_ms;
};

// Every suite has the options --json, --threads and --quick.
struct Suite {
  const char* name;
  const char* description;
  const char* example;
  // The help of the options that not every suite has; nullptr: the suite lacks the option.
  const char* plot_help = nullptr;
  const char* maps_help = nullptr;
  const char* only_help = nullptr;
  const char* full_help = nullptr;
  const char* every_pixel_help = nullptr;
  const char* latency_help = nullptr;
  const char* footage_help = nullptr;
};

// Parses the arguments and calls `run`. Returns the exit code: 0; 1 if `run` throws; 2 if the
// arguments are wrong. Also limits llvmpipe, the OpenGL renderer on the CPU, to `threads` threads.
int run_suite(const Suite& suite, int argc, char** argv,
              const std::function<void(const Args&)>& run);

}  // namespace fivepipe::bench
