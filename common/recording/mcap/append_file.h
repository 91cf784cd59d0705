// An append-only file. Each append() is atomic for readers: when it returns, the kernel has all of
// the bytes; when it throws, the file has none of them.
#pragma once
#include <filesystem>
#include <functional>

#include "common/recording/mcap/format/bytes.h"

namespace fivepipe::mcap {

// A slow disk keeps a call waiting. The call tests this condition about every kPieceBytes, and
// stops when it returns true. An empty function never stops.
using StopCondition = std::function<bool()>;

class AppendFile {
 public:
  // 0.1 s of a disk that writes 2.5 MB/s.
  static constexpr std::uint64_t kPieceBytes = std::uint64_t(256) << 10;

  // create() truncates an existing file. reopen() truncates the file to `size_bytes`, which must
  // not exceed its size. Both lock the file (flock) before they change it. Both throw
  // std::system_error, which names the file, also if another AppendFile holds the lock.
  static AppendFile create(const std::filesystem::path& path);
  static AppendFile reopen(const std::filesystem::path& path, std::uint64_t size_bytes);
  AppendFile(AppendFile&& other) noexcept;
  AppendFile& operator=(AppendFile&&) = delete;
  ~AppendFile();

  // Throws std::system_error, for example if the disk is full; the file then keeps its previous
  // end. It also does if `stop` ends the call, which then returns false.
  bool append(ByteView bytes, const StopCondition& stop = {});
  // Returns true when all appended bytes are on the disk and survive a power cut, false if `stop`
  // ends the call before. Throws std::system_error if the disk fails.
  bool sync(const StopCondition& stop = {});
  // The byte must be in the file. Throws std::system_error if the disk fails.
  void overwrite(std::uint64_t byte, std::byte value);
  std::uint64_t size_bytes() const { return size_bytes_; }
  // CRC-32 of the bytes that were appended since create() or reopen().
  std::uint32_t crc() const { return crc_; }
  // CRC-32 of the whole file, which it reads. Throws std::system_error if the disk fails.
  std::uint32_t crc_of_whole_file() const;

 private:
  AppendFile(std::filesystem::path path, int flags);
  [[noreturn]] void fail(const char* what) const;  // throws std::system_error with errno
  bool write_all(ByteView bytes, std::uint64_t at, const StopCondition& stop) const;
  void remove_after_end() const;
  bool sync_piece(std::uint64_t at) const;

  std::filesystem::path path_;
  int file_;
  std::uint64_t size_bytes_ = 0, synced_bytes_ = 0;
  std::uint32_t crc_ = 0;
};

}  // namespace fivepipe::mcap
