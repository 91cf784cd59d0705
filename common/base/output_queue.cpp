#include "common/base/output_queue.h"

#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <string_view>

namespace fivepipe::base {
namespace {

// 0, or the error number.
int write_all(int file, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = write(file, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return errno;
    text.remove_prefix(std::size_t(written));
  }
  return 0;
}

}  // namespace

OutputQueue::OutputQueue(int file) : file_(file) {
  signal(SIGPIPE, SIG_IGN);  // a closed pipe is seen by its error
  thread_ = std::thread([this] { write_until_closed(); });
}

OutputQueue::~OutputQueue() { finish(); }

int OutputQueue::finish() {
  {
    const std::scoped_lock lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
  return error_;
}

bool OutputQueue::offer(std::string text) {
  {
    const std::scoped_lock lock(mutex_);
    if (queued_bytes_ >= kMaxQueuedBytes) return false;
    queued_bytes_ += text.size();
    queue_.push_back(std::move(text));
  }
  changed_.notify_all();
  return true;
}

void OutputQueue::put(std::string text) {
  {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return queued_bytes_ < kMaxQueuedBytes || closed_; });
    queued_bytes_ += text.size();
    queue_.push_back(std::move(text));
  }
  changed_.notify_all();
}

bool OutputQueue::closed() const {
  pollfd polled{file_, 0, 0};
  return closed_ || (poll(&polled, 1, 0) == 1 && (polled.revents & POLLERR));
}

void OutputQueue::write_until_closed() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return ending_ || !queue_.empty(); });
    if (queue_.empty()) return;
    const std::string text = std::move(queue_.front());
    queue_.pop_front();
    lock.unlock();
    if (const int error = closed_ ? 0 : write_all(file_, text)) {
      closed_ = true;
      if (error != EPIPE) error_ = error;
    }
    lock.lock();
    queued_bytes_ -= text.size();
    changed_.notify_all();
  }
}

}  // namespace fivepipe::base
