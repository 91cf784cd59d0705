// Ends a process before its keys expire. Internal to bus.
#pragma once
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

#include "common/pipeline/security/role_files.h"

namespace fivepipe::bus::detail {

// When a certificate expires, Cyclone DDS deletes the participant under its readers and writers,
// and the process crashes. kMargin before that time, the watch writes the reason to stderr and
// sends SIGTERM to this process, as to an operator's request: nodes, recordings and `fivepipe up`
// end cleanly. The margin is longer than `up` waits for its nodes.
class ExpiryWatch {
 public:
  static constexpr std::chrono::seconds kMargin{15};

  explicit ExpiryWatch(const security::Credentials& credentials);
  ~ExpiryWatch();
  ExpiryWatch(const ExpiryWatch&) = delete;
  ExpiryWatch& operator=(const ExpiryWatch&) = delete;

 private:
  void wait();

  const std::int64_t end_s_;  // seconds since 1970
  const std::string reason_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool stopped_ = false;
  std::thread thread_;
};

}  // namespace fivepipe::bus::detail
