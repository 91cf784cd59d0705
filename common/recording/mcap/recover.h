// Mends files that were not finished (process killed, power cut, disk full), so that readers which
// need the summary read them.
#pragma once
#include <filesystem>

#include "common/recording/mcap/scan.h"

namespace fivepipe::mcap {

struct Recovery {
  bool was_finished = false;  // then nothing was done
  Statistics statistics;      // of the mended file
  Damage damage;
};

// Cuts the file after its last whole record, sets damaged records aside (their opcode becomes a
// private one, which readers skip; their bytes stay), moves chunks whose message index is damaged
// to the end, with a new one, and writes the summary. Interrupted, it can be called again, but may
// then leave a chunk that it moved twice. McapError: the file does not begin as an MCAP file, or
// has messages outside of chunks, which no summary finds. std::system_error: it can't be read or
// written.
Recovery recover(const std::filesystem::path& path);
// A copy of it, which replaces what is there; `from` is left as it is.
Recovery recover(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace fivepipe::mcap
