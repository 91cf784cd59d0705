// Iterates over the messages of a file in the order of their log stamps.
#pragma once
#include <memory>
#include <optional>

#include "common/recording/mcap/format/file.h"
#include "common/recording/mcap/format/summary.h"

namespace fivepipe::mcap {

// Messages with the same stamp keep their file order. Holds the current chunk and the chunks that
// overlap it in time, decompressed. A Cursor may outlive its Reader.
class Cursor {
 public:
  // `wanted[id]` selects the channels to return. Chunks without a wanted channel are not read.
  Cursor(std::shared_ptr<const File> file, const std::vector<ChunkIndex>& chunks,
         std::uint64_t start_ns, std::uint64_t end_ns, std::vector<bool> wanted);
  Cursor(Cursor&&) noexcept;
  ~Cursor();

  // The payload is valid until the next call. Throws McapError if the next chunk is damaged, or if
  // the chunks that overlap in time exceed kMaxOpenBytes; the following call skips that chunk.
  std::optional<Message> next();
  static constexpr std::uint64_t kMaxOpenBytes = std::uint64_t(2) << 30;

 private:
  struct OpenChunk;
  void open(const ChunkIndex& chunk);
  void advance();  // past the message returned last

  std::shared_ptr<const File> file_;
  std::vector<ChunkIndex> pending_;  // in descending order of start: the next chunk is at the back
  std::uint64_t start_ns_, end_ns_;
  std::vector<bool> wanted_;
  std::vector<std::unique_ptr<OpenChunk>> open_;  // a heap; the chunk of the next message is first
  std::unique_ptr<OpenChunk> current_;            // of the message returned last
  std::uint64_t open_bytes_ = 0;
};

}  // namespace fivepipe::mcap
