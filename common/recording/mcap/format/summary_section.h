// The end of a finished file: DataEnd, summary section, summary offset section, footer, magic
// (https://mcap.dev/spec#summary-section).
#pragma once
#include "common/recording/mcap/format/bytes.h"
#include "common/recording/mcap/format/file.h"
#include "common/recording/mcap/format/summary.h"

namespace fivepipe::mcap {

// For a file whose data section ends after `data_bytes` and has that CRC.
Bytes end_of_file(const Summary& summary, std::uint64_t data_bytes, std::uint32_t data_crc);

// McapError says why there is no summary to rely on: none, damaged, not complete (its statistics
// tell of chunks or messages that no index finds), or one that points to where nothing of the kind
// can stand.
Summary read_summary(const File& file);

}  // namespace fivepipe::mcap
