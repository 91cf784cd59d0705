#include "common/base/process/heartbeat.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <system_error>

namespace fivepipe::base {
namespace {

constexpr std::chrono::milliseconds kPeriod{100};

// Returns nullptr if the memory cannot be mapped.
Beats* map(int file) {
  void* const memory = mmap(nullptr, sizeof(Beats), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  return memory == MAP_FAILED ? nullptr : static_cast<Beats*>(memory);
}

// Of the supervisor that started this process; nullptr: there is none.
Beats* own_beats() {
  static Beats* const beats = []() -> Beats* {
    const char* const text = std::getenv(kHeartbeatVariable);
    if (text == nullptr) return nullptr;
    const int file = std::atoi(text);
    // Another file of this number is not the memory.
    if (fcntl(file, F_GET_SEALS) < 0 || lseek(file, 0, SEEK_END) != off_t(sizeof(Beats)))
      return nullptr;
    Beats* const mapped = map(file);
    close(file);
    unsetenv(kHeartbeatVariable);  // children of this process have no part in it
    return mapped;
  }();
  return beats;
}

}  // namespace

Heartbeat::Heartbeat() {
  file_ = memfd_create("fivepipe heartbeat", MFD_CLOEXEC | MFD_ALLOW_SEALING);
  // Without the seals, a process that truncates the memory would end its supervisor.
  if (file_ < 0 || ftruncate(file_, sizeof(Beats)) != 0 ||
      fcntl(file_, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW) != 0 ||
      (beats_ = map(file_)) == nullptr) {
    const int error = errno;
    if (file_ >= 0) close(file_);
    throw std::system_error(error, std::generic_category(), "memory of a heartbeat");
  }
}

Heartbeat::~Heartbeat() {
  munmap(beats_, sizeof(Beats));
  close(file_);
}

void beat_loop() {
  if (Beats* const beats = own_beats()) beats->loop.fetch_add(1, std::memory_order_relaxed);
}

BeatingThread::BeatingThread() {
  Beats* const beats = own_beats();
  if (!beats) return;
  thread_ = std::thread([this, beats] {
    std::unique_lock lock(mutex_);
    do {
      beats->process.fetch_add(1, std::memory_order_relaxed);
    } while (!changed_.wait_for(lock, kPeriod, [this] { return done_; }));
  });
}

BeatingThread::~BeatingThread() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    done_ = true;
  }
  changed_.notify_all();
  thread_.join();
  own_beats()->process.store(Beats::kEnding, std::memory_order_relaxed);
}

}  // namespace fivepipe::base
