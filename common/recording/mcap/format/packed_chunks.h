// The chunk indexes of a file that is being written, in little memory. The file has its summary at
// its end, so a recorder keeps one index per chunk as long as it runs. A chunk with 20 channels
// takes a kilobyte as ChunkIndex, and here a tenth of it.
#pragma once
#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <vector>

#include "common/recording/mcap/format/summary.h"

namespace fivepipe::mcap {

class PackedChunks {
 public:
  // All chunks have this `compression`; that of their indexes is ignored.
  explicit PackedChunks(std::string_view compression) : compression_(compression) {}
  // Keeps all fields of the index but `compression` and `unchunked`. Needs little memory if the
  // chunks are in the order of the file, and each message index record is behind its chunk.
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
