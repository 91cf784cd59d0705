// Damages valid inputs of the product at random and checks what must hold for every input.
#include <fmt/format.h>

#include <charconv>
#include <cstdio>
#include <cstring>
#include <exception>

#include "tests/fuzz/runner.h"

namespace fivepipe::fuzz {
namespace {

// A run with fewer inputs than this tests little, so it goes on until it has read this many. Of
// these, each target accepts some and rejects some.
constexpr std::uint32_t kMinInputs = 100;

std::vector<Target> targets() {
  return {mcap_target(),  map_target(),        tile_target(), rig_target(),
          scene_target(), deployment_target(), mesh_target(), texture_target()};
}

int print_usage() {
  std::fputs(R"(Usage: fuzz TARGET SECONDS [FIRST_SEED]
       fuzz TARGET FOLDER

Reads damaged inputs for SECONDS, at least 100, one for each seed from FIRST_SEED (1) on. The same
seed gives the same input. A finding is a crash, a sanitizer report, an undocumented exception, a
broken invariant, or an input that needs more than 2 s or 1 GiB (five times as much with the
sanitizers). The program then prints target and seed, keeps the input in the folder
fuzz_TARGET_SEED, and ends with code 1.

FOLDER: reads such an input again in this process, for a debugger.

Target mesh: as in the product, a child process with limits imports the file. A crash or a sanitizer
report in that child counts as a rejected input.

Targets:
)",
             stderr);
  for (const Target& target : targets())
    fmt::print(stderr, "  {:11} {}\n", target.name, target.what);
  return 2;
}

bool read(const char* text, auto& value) {
  const char* end = text + std::strlen(text);
  const auto [rest, error] = std::from_chars(text, end, value);
  return error == std::errc() && rest == end;
}

int repeat(const Target& target, const char* folder) {
  const Verdict verdict = target.check(folder);
  fmt::print("{}: {}\n", target.name,
             !verdict.broken.empty() ? verdict.broken
             : verdict.accepted      ? "accepted"
                                     : "rejected");
  return verdict.broken.empty() ? 0 : 1;
}

int fuzz(const Target& target, double duration_s, std::uint32_t first_seed) {
  const Report report =
      run(target, duration_s, kMinInputs, first_seed, std::filesystem::current_path());
  if (!report.finding.empty()) {
    fmt::print("{}, seed {}: {}\ninput: {}\nrepeat: fuzz {} {} {}\n", target.name, report.seed,
               report.finding, report.kept_input.string(), target.name, duration_s, report.seed);
    return 1;
  }
  fmt::print("{}: {} inputs, seeds from {} on, {} accepted: no finding\n", target.name,
             report.inputs, first_seed, report.accepted);
  if (report.accepted > 0 && report.accepted < report.inputs) return 0;
  fmt::print("the target accepted all or none of the inputs\n");
  return 1;
}

int main_of(int argc, char** argv) {
  if (argc < 3 || argc > 4) return print_usage();
  double duration_s = 0;
  std::uint32_t first_seed = 1;
  const bool is_folder = argc == 3 && std::filesystem::is_directory(argv[2]);
  if (!is_folder && !(read(argv[2], duration_s) && duration_s > 0)) return print_usage();
  if (argc == 4 && !read(argv[3], first_seed)) return print_usage();
  for (const Target& target : targets())
    if (target.name == argv[1])
      return is_folder ? repeat(target, argv[2]) : fuzz(target, duration_s, first_seed);
  return print_usage();
}

}  // namespace
}  // namespace fivepipe::fuzz

int main(int argc, char** argv) {
  try {
    return fivepipe::fuzz::main_of(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "fuzz: {}\n", error.what());
    return 1;
  }
}
