// The messages of a file, one after the other, in the order of their log stamps.
#pragma once
#include <memory>
#include <optional>

#include "common/recording/mcap/format/file.h"
#include "common/recording/mcap/format/summary.h"

namespace fivepipe::mcap {

// Messages of one stamp come in the order of the file. Holds one decompressed chunk, and as many as
// overlap it in time. Outlives its Reader.
class Cursor {
 public:
  // `wanted[id]`: the channels whose messages are given; of the others' chunks nothing is read.
  Cursor(std::shared_ptr<const File> file, const std::vector<ChunkIndex>& chunks,
         std::uint64_t start_ns, std::uint64_t end_ns, std::vector<bool> wanted);
  Cursor(Cursor&&) noexcept;
  Cursor& operator=(Cursor&&) noexcept;
  ~Cursor();

  // The payload lives until the next call. McapError: the next chunk is damaged, or more than
  // kMaxOpenBytes of chunks overlap in time; a call after that goes on behind this chunk.
  std::optional<Message> next();
  static constexpr std::uint64_t kMaxOpenBytes = std::uint64_t(2) << 30;

 private:
  struct OpenChunk;
  void open(const ChunkIndex& chunk);
  void advance();  // past the message given last

  std::shared_ptr<const File> file_;
  std::vector<ChunkIndex> pending_;  // by start, the last first
  std::uint64_t start_ns_, end_ns_;
  std::vector<bool> wanted_;
  std::vector<std::unique_ptr<OpenChunk>> open_;  // a heap: the next message's chunk first
  std::unique_ptr<OpenChunk> current_;            // of the message given last
  std::uint64_t open_bytes_ = 0;
};

}  // namespace fivepipe::mcap
