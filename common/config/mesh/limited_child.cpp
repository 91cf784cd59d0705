#include "common/config/mesh/limited_child.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <fstream>
#include <new>
#include <system_error>

namespace fivepipe::config {

namespace {

// Exit codes, apart from those that a sanitizer uses.
constexpr int kOutOfMemory = 101, kException = 102, kNotWritten = 103, kOrphaned = 104;

std::size_t own_address_space_bytes() {
  std::size_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * std::size_t(sysconf(_SC_PAGESIZE));
}

void set_soft_limit(__rlimit_resource resource, rlim_t value) {
  rlimit limit{};
  getrlimit(resource, &limit);
  limit.rlim_cur = std::min(value, limit.rlim_max);
  setrlimit(resource, &limit);
}

rlim_t soft_limit(__rlimit_resource resource) {
  rlimit limit{};
  getrlimit(resource, &limit);
  return limit.rlim_cur;
}

// A crash or a limit ends the child at once, without the handlers of the caller or of a sanitizer.
// Ctrl-C does not end it, which would look like a crash: the caller decides what it interrupts, and
// the child ends with the caller.
void reset_signals() {
  for (const int signal : {SIGABRT, SIGALRM, SIGBUS, SIGFPE, SIGILL, SIGPIPE, SIGSEGV, SIGXCPU})
    std::signal(signal, SIG_DFL);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, SIG_IGN);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
}

bool write_all(int fd, const std::string& bytes) {
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t count = write(fd, bytes.data() + done, bytes.size() - done);
    if (count < 0 && errno != EINTR) return false;
    if (count > 0) done += std::size_t(count);
  }
  return true;
}

std::string read_all(int fd) {
  std::string bytes;
  std::array<char, 1 << 16> block;
  while (true) {
    const ssize_t count = read(fd, block.data(), block.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return bytes;
    bytes.append(block.data(), std::size_t(count));
  }
}

[[noreturn]] void run_child(const std::function<std::string()>& function, const ChildLimits& limits,
                            pid_t parent, int result_fd) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(kOrphaned);  // the parent died before the prctl call
  reset_signals();
  if (const int null = open("/dev/null", O_WRONLY | O_CLOEXEC); null >= 0) {
    dup2(null, STDOUT_FILENO);
    dup2(null, STDERR_FILENO);
  }
  set_soft_limit(RLIMIT_CORE, 0);
  set_soft_limit(RLIMIT_CPU, limits.cpu_s);
  set_soft_limit(RLIMIT_AS, own_address_space_bytes() + limits.memory_bytes);
  alarm(limits.elapsed_s);
  try {
    _exit(write_all(result_fd, function()) ? 0 : kNotWritten);
  } catch (const std::bad_alloc&) {
    _exit(kOutOfMemory);
  } catch (const std::exception& error) {
    write_all(result_fd, error.what());
    _exit(kException);
  }
}

ChildResult result_of(int status, std::string bytes) {
  if (WIFSIGNALED(status)) {
    const int signal = WTERMSIG(status);
    if (signal == SIGXCPU || signal == SIGALRM) return {"", "takes too long"};
    return {"", "crashes (signal " + std::to_string(signal) + ')'};
  }
  switch (WEXITSTATUS(status)) {
    case 0: return {std::move(bytes), ""};
    case kOutOfMemory: return {"", "needs too much memory"};
    case kException: return {"", "fails: " + bytes};
    default: return {"", "ends with exit code " + std::to_string(WEXITSTATUS(status))};
  }
}

}  // namespace

ChildResult call_in_child(const std::function<std::string()>& function, const ChildLimits& limits) {
  std::array<int, 2> pipe_fds{};
  if (pipe2(pipe_fds.data(), O_CLOEXEC) != 0)
    throw std::system_error(errno, std::generic_category(), "pipe");
  const pid_t parent = getpid(), child = fork();
  if (child == 0) run_child(function, limits, parent, pipe_fds[1]);
  const int fork_error = errno;
  close(pipe_fds[1]);
  std::string bytes = child < 0 ? "" : read_all(pipe_fds[0]);
  close(pipe_fds[0]);
  if (child < 0) throw std::system_error(fork_error, std::generic_category(), "fork");
  int status = 0;
  while (waitpid(child, &status, 0) < 0)
    if (errno != EINTR) throw std::system_error(errno, std::generic_category(), "waitpid");
  return result_of(status, std::move(bytes));
}

void raise_own_limits(const ChildLimits& by) {
  set_soft_limit(RLIMIT_CPU, soft_limit(RLIMIT_CPU) + by.cpu_s);
  set_soft_limit(RLIMIT_AS, soft_limit(RLIMIT_AS) + by.memory_bytes);
  alarm(alarm(0) + by.elapsed_s);
}

}  // namespace fivepipe::config
