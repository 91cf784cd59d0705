#include "launch/study/folder/study_lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <iostream>
#include <sstream>
#include <system_error>
#include <thread>

#include "common/base/usage_error.h"

namespace fivepipe::study {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr auto kMaxWait = 1s;
constexpr auto kPoll = 20ms;

// Whether the open file still has this path: `new` removes the files of a study that it cannot
// make.
bool has_path(int open_file, const fs::path& path) {
  struct stat of_file {
  }, of_path{};
  return fstat(open_file, &of_file) == 0 && stat(path.c_str(), &of_path) == 0 &&
         of_file.st_dev == of_path.st_dev && of_file.st_ino == of_path.st_ino;
}

void write_holder(int file, const std::string& command) {
  const std::string text = fmt::format("{} {}\n", getpid(), command);
  // Only a message to others would lack it.
  if (ftruncate(file, 0) == 0 && pwrite(file, text.data(), text.size(), 0) < 0) return;
}

// "`fivepipe study run` (process 4711)"
std::string holder_of(int file) {
  std::array<char, 64> text{};
  if (pread(file, text.data(), text.size() - 1, 0) < 0) return "another command";
  std::istringstream words(text.data());
  std::string process, command;
  if (!(words >> process >> command)) return "another command";
  return fmt::format("`fivepipe study {}` (process {})", command, process);
}

}  // namespace

fs::path lock_file(const fs::path& folder, StudyPart part) {
  switch (part) {
    case StudyPart::run: return folder / "run.lock";
    case StudyPart::report: return folder / "report.lock";
    case StudyPart::trials: break;
  }
  return folder / "trials.lock";
}

StudyLock::StudyLock(const fs::path& folder, const std::string& command,
                     const std::vector<StudyPart>& parts) {
  try {
    for (const StudyPart part : parts) lock(folder, command, part);
  } catch (...) {
    release();
    throw;
  }
}

StudyLock::~StudyLock() { release(); }

void StudyLock::lock(const fs::path& folder, const std::string& command, StudyPart part) {
  const fs::path path = lock_file(folder, part);
  const auto start = std::chrono::steady_clock::now();
  for (;;) {
    const int file = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (file < 0)
      throw std::system_error(errno, std::generic_category(), "cannot open " + path.string());
    if (flock(file, LOCK_EX | LOCK_NB) == 0) {
      if (has_path(file, path)) {
        write_holder(file, command);
        files_.push_back(file);
        return;
      }
      close(file);
      continue;
    }
    const int error = errno;
    const std::string holder = holder_of(file);
    close(file);
    if (error == EINTR) continue;
    if (error != EWOULDBLOCK) {
      std::cerr << fmt::format(
          "warning: cannot lock {} ({}): start no other command with this study\n", path.string(),
          std::strerror(error));
      return;
    }
    const auto waited = std::chrono::steady_clock::now() - start;
    if (part != StudyPart::trials || waited >= kMaxWait)
      throw base::UsageError(
          fmt::format("{} is in use by {}; wait until it has ended, or end it, then repeat this "
                      "command",
                      folder.string(), holder));
    std::this_thread::sleep_for(kPoll);
  }
}

void StudyLock::release() {
  for (const int file : files_) {
    // The lock ends in any case; the text would name a process that has it no longer.
    if (ftruncate(file, 0) != 0) errno = 0;
    close(file);
  }
  files_.clear();
}

}  // namespace fivepipe::study
