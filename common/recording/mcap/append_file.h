// A file that grows by whole pieces: each is with the kernel when append() returns, or is not in
// the file.
#pragma once
#include <filesystem>

#include "common/recording/mcap/format/bytes.h"

namespace fivepipe::mcap {

class AppendFile {
 public:
  // Both throw std::system_error that names the file. create() empties a file that is there;
  // reopen() cuts it after `size_bytes`, which is at most its size.
  static AppendFile create(const std::filesystem::path& path);
  static AppendFile reopen(const std::filesystem::path& path, std::uint64_t size_bytes);
  AppendFile(AppendFile&& other) noexcept;
  AppendFile& operator=(AppendFile&&) = delete;
  ~AppendFile();

  // std::system_error (a full disk): the file ends where it ended before.
  void append(ByteView bytes);
  // What was appended outlives a power cut when it returns. std::system_error where the disk
  // failed.
  void sync();
  void overwrite(std::uint64_t byte, std::byte value);
  std::uint64_t size_bytes() const { return size_bytes_; }
  std::uint32_t crc() const {
    return crc_;
  }                                         // of everything that was appended; reopen() starts anew
  std::uint32_t crc_of_whole_file() const;  // reads it

 private:
  AppendFile(std::filesystem::path path, int flags);
  [[noreturn]] void fail(const char* what) const;  // with errno
  void write_all(ByteView bytes, std::uint64_t at) const;

  std::filesystem::path path_;
  int file_;
  std::uint64_t size_bytes_ = 0;
  std::uint32_t crc_ = 0;
};

}  // namespace fivepipe::mcap
