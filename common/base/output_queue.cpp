#include "common/base/output_queue.h"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include "common/base/containers/bounded_queue.h"

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

// A pipe reports POLLERR, a socket POLLHUP.
bool is_broken_pipe(int file) {
  pollfd polled{file, 0, 0};
  return poll(&polled, 1, 0) == 1 && (polled.revents & (POLLERR | POLLHUP));
}

struct OutputQueue::State {
  explicit State(int of) : file(fcntl(of, F_DUPFD_CLOEXEC, 0)) {
    if (file < 0) throw std::system_error(errno, std::generic_category(), "output");
  }
  ~State() { close(file); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  void write_until_closed() {
    while (const std::optional<std::string> text = queue.pop()) {
      // After a failure the loop only drains the queue, so that put() does not wait forever.
      if (const int failed = closed ? 0 : write_all(file, *text)) {
        closed = true;
        if (failed != EPIPE) error = failed;
      }
    }
    ended.set_value();
  }

  const int file;
  BoundedQueue<std::string> queue{kMaxQueuedBytes};  // its cost is in bytes
  std::atomic<bool> closed{false};
  std::atomic<int> error{0};
  std::promise<void> ended;
};

OutputQueue::OutputQueue(int file)
    : state_(std::make_shared<State>(file)), ended_(state_->ended.get_future()) {
  signal(SIGPIPE, SIG_IGN);  // write() reports a closed pipe as EPIPE
  thread_ = std::thread([state = state_] { state->write_until_closed(); });
}

OutputQueue::~OutputQueue() { finish(); }

int OutputQueue::finish() {
  state_->queue.close();
  if (thread_.joinable()) thread_.join();
  return state_->error;
}

int OutputQueue::finish(std::chrono::nanoseconds timeout) {
  state_->queue.close();
  if (!thread_.joinable() || ended_.wait_for(timeout) == std::future_status::ready) return finish();
  state_->closed = true;  // the thread drops the queued text
  thread_.detach();
  return ETIMEDOUT;
}

bool OutputQueue::offer(std::string text) {
  const std::size_t bytes = text.size();
  return state_->queue.try_push(std::move(text), bytes);
}

void OutputQueue::put(std::string text) {
  const std::size_t bytes = text.size();
  state_->queue.push(std::move(text), bytes);
}

bool OutputQueue::closed() const { return state_->closed || is_broken_pipe(state_->file); }

}  // namespace fivepipe::base
