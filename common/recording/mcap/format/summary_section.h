// The end of a finished file: DataEnd, summary section, summary offset section, footer, magic
// (https://mcap.dev/spec#summary-section).
#pragma once
#include "common/recording/mcap/format/bytes.h"
#include "common/recording/mcap/format/file.h"
#include "common/recording/mcap/format/summary.h"

namespace fivepipe::mcap {

// Returns the bytes after a data section that ends at `data_bytes` and has the CRC `data_crc`.
Bytes end_of_file(const Summary& summary, std::uint64_t data_bytes, std::uint32_t data_crc);

// Throws McapError with the reason if the file has no valid summary: it is missing, damaged or
// incomplete (its statistics count chunks or messages without an index), or an index gives an
// offset at which no such record can be.
Summary read_summary(const File& file);

}  // namespace fivepipe::mcap
