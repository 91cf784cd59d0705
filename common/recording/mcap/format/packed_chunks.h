// The chunk indexes of a file that is being written, in little memory. The file has its summary at
// its end, so a recorder keeps one index per chunk as long as it runs: as ChunkIndex a kilobyte per
// chunk with 20 channels, here a tenth of it.
#pragma once
#include <deque>

#include "common/recording/mcap/format/summary.h"

namespace fivepipe::mcap {

class PackedChunks {
 public:
  // `compression` of all chunks.
  explicit PackedChunks(std::string_view compression) : compression_(compression) {}
  // Chunks must come in file order, and no message index record may be before its chunk.
  void add(const ChunkIndex& chunk);
  // Returns all chunks that were added, in this order.
  std::vector<ChunkIndex> unpacked() const;

 private:
  void put(std::uint64_t value);

  std::string compression_;
  // Numbers of seven bits per byte, the lowest first; the highest bit is set if more follow. A
  // deque, because a vector would at times hold the bytes twice.
  std::deque<std::uint8_t> bytes_;
  std::uint64_t end_ = 0;  // of the last chunk in the file
};

}  // namespace fivepipe::mcap
