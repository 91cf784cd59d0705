#include "common/pipeline/bus/secured/expiry_watch.h"

#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <ctime>
#include <iostream>

#include "common/pipeline/security/role_check.h"

namespace fivepipe::bus::detail {
namespace {

// Polls, because the clock may be set while the watch waits.
constexpr std::chrono::seconds kPollPeriod{1};
constexpr std::int64_t kWarnings_s[] = {30 * security::kDay_s, 7 * security::kDay_s,
                                        security::kDay_s, 3600};

std::atomic<bool> has_ended = false;

}  // namespace

ExpiryWatch::ExpiryWatch(const security::Credentials& credentials)
    : expires_s_(credentials.expires_s),
      margin_s_(security::expiry_margin_s(credentials.files.role)),
      keys_("the keys in " + credentials.files.folder.string()),
      remedy_(credentials.remedy + " makes new ones"),
      thread_([this] { wait(); }) {}

ExpiryWatch::~ExpiryWatch() {
  {
    const std::scoped_lock lock(mutex_);
    stopped_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

bool ExpiryWatch::has_ended_process() { return has_ended; }

std::int64_t ExpiryWatch::next_warning_s(std::int64_t now_s, std::int64_t expires_s) {
  for (const std::int64_t before_s : kWarnings_s)
    if (expires_s - before_s > now_s) return expires_s - before_s;
  return INT64_MAX;
}

void ExpiryWatch::wait() {
  std::unique_lock lock(mutex_);
  std::int64_t now_s = std::time(nullptr), warning_s = next_warning_s(now_s, expires_s_);
  for (; !stopped_ && now_s < expires_s_ - margin_s_; now_s = std::time(nullptr)) {
    if (now_s >= warning_s) {
      warning_s = next_warning_s(now_s, expires_s_);
      std::cerr << keys_ << " expire at " << security::utc_text(expires_s_) << ": " << remedy_
                << std::endl;
    }
    changed_.wait_for(lock, kPollPeriod, [this] { return stopped_; });
  }
  if (stopped_) return;
  std::cerr << keys_ << " expire within " << margin_s_ << " s: this process ends. " << remedy_
            << std::endl;
  has_ended = true;
  kill(getpid(), SIGTERM);
}

}  // namespace fivepipe::bus::detail
