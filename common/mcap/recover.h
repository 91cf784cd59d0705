// Mends files that were not finished (process killed, power cut, disk full), so that readers which need the summary read them.
#pragma once
#include <filesystem>

#include "common/mcap/scan.h"

namespace fivepipe::mcap {

struct Recovery {
  bool was_finished = false;  // then nothing was done
  Statistics statistics;      // of the mended file
  Damage damage;
};

// Cuts the file after its last whole record, sets damaged chunks aside (their opcode becomes a private one, which readers skip; their bytes stay),
// and writes the summary. McapError: it does not begin as an MCAP file, or has messages outside of chunks, which no summary finds.
// std::system_error: it can't be read or written. Interrupted, it can be called again.
Recovery recover(const std::filesystem::path& path);
// A copy of it, which replaces what is there; `from` is left as it is.
Recovery recover(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace fivepipe::mcap
