// A file that is read piece by piece, at any place.
#pragma once
#include <filesystem>

#include "common/recording/mcap/format/bytes.h"

namespace fivepipe::mcap {

// Not mapped into memory: a file that another process cuts meanwhile is an McapError, not a signal.
// May be read from many threads.
class File {
 public:
  explicit File(const std::filesystem::path& path);  // std::system_error that names the file
  ~File();
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  const std::string& name() const { return name_; }
  std::uint64_t size_bytes() const { return size_bytes_; }  // when it was opened
  Buffer read(std::uint64_t byte, std::uint64_t size_bytes)
      const;  // McapError beyond the end; std::system_error where the disk fails

 private:
  std::string name_;
  int file_;
  std::uint64_t size_bytes_ = 0;
};

// McapError if the file does not begin with MCAP's magic bytes.
void check_magic(const File& file);

}  // namespace fivepipe::mcap
