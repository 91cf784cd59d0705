// Repairs unfinished files (process killed, power cut, disk full) so that readers that need a
// summary can read them.
#pragma once
#include <filesystem>

#include "common/recording/mcap/scan.h"

namespace fivepipe::mcap {

struct Recovery {
  bool was_finished = false;  // the file needed no repair and was not changed
  Statistics statistics;      // of the repaired file
  Damage damage;
};

// Repairs the file in place: truncates it after the last complete record; quarantines damaged
// records (sets their opcode to a private one, which readers skip, and keeps their bytes); moves
// chunks with a damaged message index to the end, with a new index; writes the summary. If the
// process is killed meanwhile, recover() may be called again, but may then leave a moved chunk
// twice. Throws McapError if the file is not an MCAP file, or has messages outside of chunks, which
// a summary cannot index; std::system_error if the file cannot be read or written.
Recovery recover(const std::filesystem::path& path);
// Repairs a copy and leaves `from` unchanged. Overwrites an existing `to`.
Recovery recover(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace fivepipe::mcap
