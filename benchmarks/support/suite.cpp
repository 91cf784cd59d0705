#include "benchmarks/support/suite.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>

namespace fivepipe::bench {
namespace {

Args parsed(int argc, char** argv) {
  Args args;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const auto value = [&] {
      if (++i == argc) throw std::invalid_argument(word + " needs a value");
      return std::string(argv[i]);
    };
    if (word == "--quick")
      args.quick = true;
    else if (word == "--full")
      args.full = true;
    else if (word == "--json")
      args.json_file = value();
    else if (word == "--plot")
      args.plot_file = value();
    else if (word == "--only")
      args.only = value();
    else if (word == "--maps")
      args.maps.push_back(value());
    else if (word == "--threads")
      args.threads = std::atoi(value().c_str());
    else
      throw std::invalid_argument("unknown argument " + word);
  }
  if (args.threads < 1 || args.threads > 256)
    throw std::invalid_argument("--threads must be 1 to 256");
  return args;
}

}  // namespace

int run_suite(const std::string& name, const char* help, int argc, char** argv,
              const std::function<void(const Args&)>& run) {
  if (std::any_of(argv + 1, argv + argc,
                  [](const std::string& word) { return word == "--help" || word == "-h"; }))
    return std::fputs(help, stdout), 0;
  Args args;
  try {
    args = parsed(argc, argv);
  } catch (const std::invalid_argument& e) {
    return std::fprintf(stderr, "bench %s: %s\n%s", name.c_str(), e.what(), help), 2;
  }
  setenv("LP_NUM_THREADS", std::to_string(args.threads).c_str(), 1);
  try {
    run(args);
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "bench %s: %s\n", name.c_str(), e.what());
    return 1;
  }
}

}  // namespace fivepipe::bench
