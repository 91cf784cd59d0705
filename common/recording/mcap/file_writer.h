// The second half of writing: chunks, attachments and metadata to a file (https://mcap.dev/spec).
#pragma once
#include <filesystem>

#include "common/recording/mcap/append_file.h"
#include "common/recording/mcap/format/chunk_builder.h"
#include "common/recording/mcap/format/summary.h"

namespace fivepipe::mcap {

// Everything that a call wrote is with the kernel when it returns: a process that is killed loses
// nothing of it. Each call may throw std::system_error that names the file (a full disk): the file
// then ends where it ended before the call, and is still good to write to. Without finish() the
// file is left as a killed process leaves it; recover.h mends it.
class FileWriter {
 public:
  // Empties a file that is there.
  FileWriter(const std::filesystem::path& path, Compression compression, std::string_view library,
             std::string_view profile = "");

  // All chunks of one file come from one ChunkBuilder; one without messages is not written.
  // std::length_error: above kMaxChunkBytes, which no reader here would read.
  void write(const Chunk& chunk);
  void attach(const Attachment& attachment);
  void add(const Metadata& metadata);
  // What was written so far outlives a power cut too. std::system_error where the disk failed.
  void sync() { file_.sync(); }
  // Writes the summary; nothing may be written after it.
  void finish();
  std::uint64_t bytes_written() const { return file_.size_bytes(); }

 private:
  AppendFile file_;
  Compression compression_;
  Summary summary_;
  Bytes record_;  // kept for its memory
};

}  // namespace fivepipe::mcap
