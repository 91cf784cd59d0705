#include "common/base/output_queue.h"

#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <string_view>

namespace fivepipe::base {
namespace {

// Returns 0 or the errno.
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

bool is_broken_pipe(int file) {
  pollfd polled{file, 0, 0};
  return poll(&polled, 1, 0) == 1 && (polled.revents & POLLERR);
}

OutputQueue::OutputQueue(int file) : file_(file) {
  signal(SIGPIPE, SIG_IGN);  // write() reports a closed pipe as EPIPE
  thread_ = std::thread([this] { write_until_closed(); });
}

OutputQueue::~OutputQueue() { finish(); }

int OutputQueue::finish() {
  queue_.close();
  if (thread_.joinable()) thread_.join();
  return error_;
}

bool OutputQueue::offer(std::string text) {
  const std::size_t bytes = text.size();
  return queue_.try_push(std::move(text), bytes);
}

void OutputQueue::put(std::string text) {
  const std::size_t bytes = text.size();
  queue_.push(std::move(text), bytes);
}

bool OutputQueue::closed() const { return closed_ || is_broken_pipe(file_); }

void OutputQueue::write_until_closed() {
  while (const std::optional<std::string> text = queue_.pop()) {
    // After a failure the loop only drains the queue, so that put() does not wait forever.
    if (const int error = closed_ ? 0 : write_all(file_, *text)) {
      closed_ = true;
      if (error != EPIPE) error_ = error;
    }
  }
}

}  // namespace fivepipe::base
