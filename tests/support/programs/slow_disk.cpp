// A slow or failing disk for tests: replaces the calls by which fivepipe writes a recording. Linked
// into a test or preloaded into a program (LD_PRELOAD). The environment sets the speed in bytes per
// second: FIVEPIPE_TEST_WRITE_SPEED of pwrite(), as of a disk whose cache is full,
// FIVEPIPE_TEST_SYNC_SPEED of sync_file_range() and fdatasync(). Without a variable there is no
// delay. If FIVEPIPE_TEST_SYNC_ERROR is a number from 1 on, the first sync_file_range() with this
// number fails with EIO. As in the kernel, only the call that reports the error fails, and later
// ones succeed. If
// FIVEPIPE_TEST_EMPTY_WRITE is set, the first pwrite() writes nothing, without an error; errno is
// then EINTR, as an earlier call may leave it.
#include <sys/syscall.h>
#include <sys/types.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <ctime>

namespace {

std::atomic<std::int64_t> unsynced_bytes = 0;
std::atomic<int> reported_sync_error = 0;
std::atomic<bool> wrote_nothing = false;

void wait_for(const char* speed_variable, std::int64_t bytes) {
  const char* text = std::getenv(speed_variable);
  const double bytes_per_s = text ? std::atof(text) : 0;
  if (!(bytes_per_s > 0) || bytes <= 0) return;
  const double s = double(bytes) / bytes_per_s;
  timespec rest{std::time_t(s), long(1e9 * (s - double(std::time_t(s))))};
  nanosleep(&rest, nullptr);
}

}  // namespace

// The definitions precede those of the C library.
extern "C" ssize_t pwrite(int file, const void* bytes, std::size_t size, off_t at) {
  if (std::getenv("FIVEPIPE_TEST_EMPTY_WRITE") && !wrote_nothing.exchange(true)) {
    errno = EINTR;
    return 0;
  }
  wait_for("FIVEPIPE_TEST_WRITE_SPEED", std::int64_t(size));
  unsynced_bytes += std::int64_t(size);
  return syscall(SYS_pwrite64, file, bytes, size, at);
}

extern "C" int sync_file_range(int file, off64_t at, off64_t size, unsigned flags) {
  unsynced_bytes -= size;
  wait_for("FIVEPIPE_TEST_SYNC_SPEED", size);
  const char* const error = std::getenv("FIVEPIPE_TEST_SYNC_ERROR");
  const int number = error ? std::atoi(error) : 0;
  if (number > 0 && reported_sync_error.exchange(number) != number) {
    errno = EIO;
    return -1;
  }
  return int(syscall(SYS_sync_file_range, file, at, size, flags));
}

extern "C" int fdatasync(int file) {
  wait_for("FIVEPIPE_TEST_SYNC_SPEED", unsynced_bytes.exchange(0));
  return int(syscall(SYS_fdatasync, file));
}
