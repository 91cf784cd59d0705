// Random access to the bytes of a file.
#pragma once
#include <filesystem>

#include "common/recording/mcap/format/bytes.h"

namespace fivepipe::mcap {

// Uses pread, not mmap: if another process truncates the file, read() throws McapError and the
// process receives no signal. Threads may call read() concurrently.
class File {
 public:
  explicit File(const std::filesystem::path& path);  // throws std::system_error with the file name
  ~File();
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  const std::string& name() const { return name_; }
  std::uint64_t size_bytes() const { return size_bytes_; }  // at the time of opening
  // Throws McapError beyond the end, std::system_error if the disk fails.
  Buffer read(std::uint64_t byte, std::uint64_t size_bytes) const;

 private:
  std::string name_;
  int file_;
  std::uint64_t size_bytes_ = 0;
};

// Throws McapError if the file does not begin with MCAP's magic bytes.
void check_magic(const File& file);

}  // namespace fivepipe::mcap
