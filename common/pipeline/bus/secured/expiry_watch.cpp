#include "common/pipeline/bus/secured/expiry_watch.h"

#include <unistd.h>

#include <csignal>
#include <ctime>
#include <iostream>

namespace fivepipe::bus::detail {
namespace {

// The clock of the machine may be set meanwhile.
constexpr std::chrono::seconds kLookPeriod{1};

}  // namespace

ExpiryWatch::ExpiryWatch(const security::Credentials& credentials)
    : end_s_(credentials.expires_s - kMargin.count()),
      reason_("the keys in " + credentials.files.folder.string() +
              " expire within 15 s: this process ends. " + credentials.remedy + " makes new ones"),
      thread_([this] { wait(); }) {
  static_assert(kMargin == std::chrono::seconds(15), "the text names it");
}

ExpiryWatch::~ExpiryWatch() {
  {
    const std::scoped_lock lock(mutex_);
    stopped_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void ExpiryWatch::wait() {
  std::unique_lock lock(mutex_);
  while (!stopped_ && std::time(nullptr) < end_s_)
    changed_.wait_for(lock, kLookPeriod, [this] { return stopped_; });
  if (stopped_) return;
  std::cerr << reason_ << std::endl;
  kill(getpid(), SIGTERM);
}

}  // namespace fivepipe::bus::detail
