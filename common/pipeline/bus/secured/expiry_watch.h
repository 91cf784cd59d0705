// Warns before the keys of a process expire, and ends it. Internal to bus.
#pragma once
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>

#include "common/pipeline/security/role_files.h"

namespace fivepipe::bus::detail {

// When a certificate expires, Cyclone DDS deletes the participant under its readers and writers,
// and the process crashes. security::expiry_margin_s() before that time, the watch writes the
// reason to stderr and sends SIGTERM to this process, as to an operator's request: nodes,
// recordings and `fivepipe up` end cleanly, with code 2. The watch also warns 30, 7 and 1 days and
// 1 hour before.
class ExpiryWatch {
 public:
  explicit ExpiryWatch(const security::Credentials& credentials);
  ~ExpiryWatch();
  ExpiryWatch(const ExpiryWatch&) = delete;
  ExpiryWatch& operator=(const ExpiryWatch&) = delete;

  // Returns whether a watch of this process has ended it.
  static bool has_ended_process();
  // Returns the time of the first warning after now_s [s since 1970]; INT64_MAX: there is none.
  static std::int64_t next_warning_s(std::int64_t now_s, std::int64_t expires_s);

 private:
  void wait();

  const std::int64_t expires_s_;  // seconds since 1970
  const std::int64_t margin_s_;
  const std::string keys_, remedy_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool stopped_ = false;
  std::thread thread_;
};

}  // namespace fivepipe::bus::detail
