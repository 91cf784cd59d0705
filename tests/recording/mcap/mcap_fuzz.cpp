// Damages MCAP files at random and checks the invariants of
// tests/support/recording/mcap_mutations.h. Run it under the sanitizers.
#include <charconv>
#include <chrono>
#include <cstdio>
#include <cstring>

#include "tests/support/recording/mcap_mutations.h"

namespace fivepipe::mcap {
namespace {

constexpr const char* kUsage = R"(Usage: mcap_fuzz SECONDS [FIRST_SEED]

Reads and repairs randomly damaged MCAP files: truncated, with flipped bits, spliced, with changed
lengths. Exit code 1: an invariant does not hold; prints the seed and keeps the file as
mcap_fuzz_broken.mcap.
)";

Bytes starting_file(const test::TestFolder& folder, std::mt19937& random) {
  test::Recording recording =
      test::made_up_recording(random() % 50, random() % 5, 1 + random() % 12);
  test::write(recording, folder.path / "start.mcap", Compression(random() % 3), random() % 2 == 0);
  return test::file_bytes(folder.path / "start.mcap");
}

bool invariants_hold(const test::TestFolder& folder, std::uint32_t seed) {
  std::mt19937 random(seed);
  Bytes bytes = starting_file(folder, random);
  for (std::uint32_t mutations = 1 + random() % 8; mutations > 0; --mutations)
    test::mutate(bytes, random);
  if (random() % 2 == 0) test::make_crcs_fit(bytes);
  const std::filesystem::path path = folder.path / "a.mcap";
  test::write_file(path, bytes);
  const std::string broken = test::violated_invariant(path, folder.path / "b.mcap");
  if (broken.empty()) return true;
  std::printf("seed %u: %s\n", seed, broken.c_str());
  test::write_file("mcap_fuzz_broken.mcap", bytes);
  return false;
}

int fuzz(double duration_s, std::uint32_t seed) {
  using Clock = std::chrono::steady_clock;
  const test::TestFolder folder;
  const auto end = Clock::now() + std::chrono::duration<double>(duration_s);
  const std::uint32_t first = seed;
  for (; Clock::now() < end; ++seed) try {
      if (!invariants_hold(folder, seed)) return 1;
    } catch (const std::exception& error) {
      std::printf("seed %u: %s\n", seed, error.what());
      return 1;
    }
  std::printf("%u files, seeds from %u on: nothing broken\n", seed - first, first);
  return 0;
}

bool read(const char* text, auto& value) {
  const char* end = text + std::strlen(text);
  const auto [rest, error] = std::from_chars(text, end, value);
  return error == std::errc() && rest == end;
}

}  // namespace
}  // namespace fivepipe::mcap

int main(int argc, char** argv) {
  double duration_s = 0;
  std::uint32_t seed = 1;
  if (argc < 2 || argc > 3 || !fivepipe::mcap::read(argv[1], duration_s) ||
      (argc == 3 && !fivepipe::mcap::read(argv[2], seed))) {
    std::fputs(fivepipe::mcap::kUsage, stderr);
    return 2;
  }
  return fivepipe::mcap::fuzz(duration_s, seed);
}
