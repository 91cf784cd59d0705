// What every `fivepipe bench SUITE` program has: its arguments, help, and exit codes.
#pragma once
#include <functional>
#include <string>
#include <vector>

namespace fivepipe::bench {

struct Args {
  std::string json_file, plot_file, only;
  std::vector<std::string> maps;  // folders
  int threads = 2;
  bool quick = false, full = false;
};

// The whole of main(). 0: done; 1: run threw; 2: wrong arguments, said with the help. OpenGL's
// threads on a CPU (llvmpipe) are set to `threads`.
int run_suite(const std::string& name, const char* help, int argc, char** argv,
              const std::function<void(const Args&)>& run);

}  // namespace fivepipe::bench
