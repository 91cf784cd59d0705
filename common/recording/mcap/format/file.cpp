#include "common/recording/mcap/format/file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "common/recording/mcap/format/records.h"

namespace fivepipe::mcap {

// O_NONBLOCK: opening a pipe does not wait for its writer. It has no effect on regular files.
File::File(const std::filesystem::path& path)
    : name_(path.string()), file_(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {
  if (file_ < 0)
    throw std::system_error(errno, std::generic_category(), name_ + ": cannot be opened");
  struct stat status {};
  if (fstat(file_, &status) != 0 || !S_ISREG(status.st_mode)) {
    const int error = S_ISREG(status.st_mode) ? errno : EINVAL;
    close(file_);
    throw std::system_error(error, std::generic_category(), name_ + ": not a regular file");
  }
  size_bytes_ = std::uint64_t(status.st_size);
}

File::~File() { close(file_); }

Buffer File::read(std::uint64_t byte, std::uint64_t size_bytes) const {
  if (byte > size_bytes_ || size_bytes > size_bytes_ - byte)
    FileOffset{name_, byte}.fail("the file ends before the record");
  Buffer buffer(size_bytes);
  for (std::span<std::byte> rest = buffer.all(); !rest.empty();) {
    const ssize_t read =
        pread(file_, rest.data(), rest.size(), off_t(byte + size_bytes - rest.size()));
    if (read < 0 && errno == EINTR) continue;
    if (read < 0)
      throw std::system_error(errno, std::generic_category(), name_ + ": cannot be read");
    if (read == 0) FileOffset{name_, byte}.fail("the file was truncated while it was read");
    rest = rest.subspan(std::size_t(read));
  }
  return buffer;
}

void check_magic(const File& file) {
  const FileOffset location{file.name(), 0};
  if (file.size_bytes() < kMagic.size()) location.fail("not an MCAP file");
  const Buffer magic = file.read(0, kMagic.size());
  if (std::memcmp(magic.view().data(), kMagic.data(), kMagic.size()) != 0)
    location.fail("not an MCAP file");
}

}  // namespace fivepipe::mcap
