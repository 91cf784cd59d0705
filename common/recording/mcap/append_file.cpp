#include "common/recording/mcap/append_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

namespace fivepipe::mcap {

AppendFile::AppendFile(std::filesystem::path path, int flags)
    : path_(std::move(path)), file_(open(path_.c_str(), flags | O_CLOEXEC, 0666)) {
  if (file_ < 0) fail("cannot be opened for writing");
  // A file system without locks refuses with another error.
  if (flock(file_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return;
  close(file_);
  errno = EBUSY;
  fail("another process writes to it");
}

AppendFile::AppendFile(AppendFile&& other) noexcept
    : path_(std::move(other.path_)),
      file_(std::exchange(other.file_, -1)),
      size_bytes_(other.size_bytes_),
      crc_(other.crc_) {}

AppendFile::~AppendFile() {
  if (file_ >= 0) close(file_);
}

AppendFile AppendFile::create(const std::filesystem::path& path) {
  AppendFile file(path, O_RDWR | O_CREAT);
  // EINVAL: a device or a pipe has no size.
  if (ftruncate(file.file_, 0) != 0 && errno != EINVAL) file.fail("cannot be truncated");
  return file;
}

AppendFile AppendFile::reopen(const std::filesystem::path& path, std::uint64_t size_bytes) {
  AppendFile file(path, O_RDWR);
  if (ftruncate(file.file_, off_t(size_bytes)) != 0) file.fail("cannot be truncated");
  file.size_bytes_ = size_bytes;
  return file;
}

void AppendFile::fail(const char* what) const {
  throw std::system_error(errno, std::generic_category(), path_.string() + ": " + what);
}

// Returns false if `stop` ends the call before all bytes are written.
bool AppendFile::write_all(ByteView bytes, std::uint64_t at, const StopCondition& stop) const {
  while (!bytes.empty()) {
    if (stop && stop()) return false;
    const ssize_t written =
        pwrite(file_, bytes.data(), std::min<std::size_t>(bytes.size(), kPieceBytes), off_t(at));
    if (written < 0 && errno == EINTR) continue;
    if (written == 0) errno = ENOSPC;
    if (written <= 0) fail("cannot be written");
    at += std::uint64_t(written);
    bytes = bytes.subspan(std::size_t(written));
  }
  return true;
}

// A reader would take the bytes of an incomplete append() for a damaged end. If ftruncate fails,
// the next append() overwrites them and readers skip them.
void AppendFile::remove_after_end() const {
  [[maybe_unused]] const int cut = ftruncate(file_, off_t(size_bytes_));
}

bool AppendFile::append(ByteView bytes, const StopCondition& stop) {
  try {
    if (!write_all(bytes, size_bytes_, stop)) {
      remove_after_end();
      return false;
    }
  } catch (const std::system_error&) {
    remove_after_end();
    throw;
  }
  size_bytes_ += bytes.size();
  crc_ = crc32_of(bytes, crc_);
  return true;
}

// Returns false if the file or the kernel does not support the call.
bool AppendFile::sync_piece(std::uint64_t at) const {
  if (sync_file_range(
          file_, off_t(at), off_t(kPieceBytes),
          SYNC_FILE_RANGE_WAIT_BEFORE | SYNC_FILE_RANGE_WRITE | SYNC_FILE_RANGE_WAIT_AFTER) == 0)
    return true;
  if (errno == ENOSYS || errno == EINVAL || errno == ESPIPE || errno == EOPNOTSUPP) return false;
  // The kernel reports a failed write to one call only: fdatasync() would return 0 afterwards.
  fail("cannot be synchronised with the disk");
}

bool AppendFile::sync(const StopCondition& stop) {
  // fdatasync() waits for everything at once. If the data are written before, piece by piece, a
  // slow disk keeps it waiting for one piece at most.
  for (; stop && synced_bytes_ < size_bytes_; synced_bytes_ += kPieceBytes) {
    if (stop()) return false;
    if (!sync_piece(synced_bytes_)) break;
  }
  if (stop && stop()) return false;
  int result;
  while ((result = fdatasync(file_)) != 0 && errno == EINTR) {
  }
  // EINVAL and EROFS mean that the file (a device or a pipe) cannot be synchronised.
  if (result != 0 && errno != EINVAL && errno != EROFS)
    fail("cannot be synchronised with the disk");
  synced_bytes_ = size_bytes_;
  return true;
}

void AppendFile::overwrite(std::uint64_t byte, std::byte value) {
  write_all(ByteView(&value, 1), byte, {});
}

std::uint32_t AppendFile::crc_of_whole_file() const {
  constexpr std::size_t kBlockBytes = 1 << 20;
  Buffer piece(kBlockBytes);
  std::uint32_t crc = 0;
  for (std::uint64_t at = 0; at < size_bytes_;) {
    const ssize_t read = pread(file_, piece.all().data(),
                               std::min<std::uint64_t>(kBlockBytes, size_bytes_ - at), off_t(at));
    if (read < 0 && errno == EINTR) continue;
    if (read == 0) errno = EIO;
    if (read <= 0) fail("cannot be read");
    crc = crc32_of(piece.view().first(std::size_t(read)), crc);
    at += std::uint64_t(read);
  }
  return crc;
}

}  // namespace fivepipe::mcap
