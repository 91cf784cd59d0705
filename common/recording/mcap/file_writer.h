// Second stage of writing: stores chunks, attachments and metadata in a file. The first stage is
// format/chunk_builder.h.
//
// fivepipe has its own MCAP code because the reference library has neither an append that survives
// a crash or a full disk, nor repair of unfinished files.
#pragma once
#include <filesystem>

#include "common/recording/mcap/append_file.h"
#include "common/recording/mcap/format/chunk_builder.h"
#include "common/recording/mcap/format/packed_chunks.h"
#include "common/recording/mcap/format/summary.h"

namespace fivepipe::mcap {

// When a call returns, the kernel has everything it wrote, so killing the process loses none of it.
// Each call may throw std::system_error, which names the file, for example if the disk is full. The
// file then ends where it ended before the call, and later calls may succeed. A file without
// finish() looks like that of a killed process; recover.h repairs it.
class FileWriter {
 public:
  // Truncates an existing file.
  FileWriter(const std::filesystem::path& path, Compression compression, std::string_view library,
             std::string_view profile = "");

  // All chunks of a file must come from one ChunkBuilder. A chunk without messages is not written.
  // Throws std::length_error above kMaxChunkBytes, which this library refuses to read. Returns
  // false if `stop` ends the call; the file then does not have the chunk, and no further chunk may
  // follow.
  bool write(const Chunk& chunk, const StopCondition& stop = {});
  void attach(const Attachment& attachment);
  void add(const Metadata& metadata);
  // Returns true when everything written so far is on the disk, false if `stop` ends the call
  // before. Throws std::system_error if the disk fails.
  bool sync(const StopCondition& stop = {}) { return file_.sync(stop); }
  // Writes the summary. No other call may follow, except sync(). Returns false if `stop` ends the
  // call; the file then has no summary.
  bool finish(const StopCondition& stop = {});
  std::uint64_t bytes_written() const { return file_.size_bytes(); }

 private:
  AppendFile file_;
  Compression compression_;
  Summary summary_;  // without chunks, until finish()
  PackedChunks chunks_;
  Bytes record_;  // scratch memory, reused
};

}  // namespace fivepipe::mcap
