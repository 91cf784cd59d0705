// MCAP files: truncated, with flipped bits, spliced, with changed lengths.
#include "tests/fuzz/target.h"
#include "tests/support/recording/mcap_mutations.h"

namespace fivepipe::fuzz {
namespace {

constexpr const char* kFile = "recording.mcap";

std::vector<File> input(Random& random) {
  const test::TestFolder folder;
  const std::uint32_t seed = random() % 50;
  const std::size_t chunks = random() % 5;
  test::Recording recording = test::made_up_recording(seed, chunks, 1 + random() % 12);
  const auto compression = mcap::Compression(random() % 3);
  test::write(recording, folder.path / kFile, compression, random() % 2 == 0);
  mcap::Bytes bytes = test::file_bytes(folder.path / kFile);
  for (std::uint32_t mutations = random() % 9; mutations > 0; --mutations)
    test::mutate(bytes, random);
  if (random() % 2 == 0) test::make_crcs_fit(bytes);
  return {{kFile, std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size())}};
}

bool is_readable(const std::filesystem::path& file) {
  try {
    mcap::Reader reader(file);
    return true;
  } catch (const mcap::McapError&) {
    return false;
  }
}

Verdict check(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / kFile;
  return {is_readable(file), test::violated_invariant(file, folder / "repaired.mcap")};
}

}  // namespace

Target mcap_target() { return {"mcap", "MCAP files: reading and repairing", input, check}; }

}  // namespace fivepipe::fuzz
