// Assigns each test process its own DDS domains, so that concurrent tests do not see each other.
#pragma once
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>

namespace fivepipe::test {

// Locks the file of a domain until this process ends. Programs that it starts do not inherit the
// lock. Returns false if another process holds it.
inline bool claim_domain(std::uint32_t domain) {
  const std::string file =
      std::filesystem::temp_directory_path() / ("fivepipe_test_domain_" + std::to_string(domain));
  int lock = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (lock < 0) lock = open(file.c_str(), O_RDONLY | O_CREAT | O_CLOEXEC, 0644);
  if (lock < 0) throw std::system_error(errno, std::generic_category(), file);
  if (flock(lock, LOCK_EX | LOCK_NB) == 0) return true;
  close(lock);
  return false;
}

inline std::uint32_t new_domain() {
  // Their UDP ports are below the kernel's ephemeral ports; `fivepipe bench` uses domains from 60
  // on.
  constexpr std::uint32_t kFirst = 10, kCount = 50;
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  for (std::uint32_t i = 0; std::chrono::steady_clock::now() < deadline; ++i) {
    const std::uint32_t domain = kFirst + (std::uint32_t(getpid()) + i) % kCount;
    if (claim_domain(domain)) return domain;
    if (i % kCount == kCount - 1) std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  throw std::runtime_error("other tests use all " + std::to_string(kCount) + " DDS domains");
}

// The same in each call. No other test process with the same temporary folder claims it.
inline std::uint32_t own_domain() {
  static const std::uint32_t domain = new_domain();
  return domain;
}

// Another one of this process.
inline std::uint32_t own_second_domain() {
  static const std::uint32_t domain = new_domain();
  return domain;
}

}  // namespace fivepipe::test
