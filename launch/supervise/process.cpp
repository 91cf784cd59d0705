#include "launch/supervise/process.h"

#include <fcntl.h>
#include <sched.h>
#include <signal.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>

namespace fivepipe::launch {
namespace {

// Bounds the memory that a child's output needs: a longer line is split.
constexpr std::size_t kMaxLineBytes = 64 * 1024;

struct Pipe {
  int read_fd = -1, write_fd = -1;
  Pipe() {
    std::array<int, 2> fds;
    if (pipe2(fds.data(), O_CLOEXEC) != 0)
      throw std::system_error(errno, std::generic_category(), "pipe");
    read_fd = fds[0];
    write_fd = fds[1];
  }
  ~Pipe() {
    close_read();
    close_write();
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  void close_read() { close_once(read_fd); }
  void close_write() { close_once(write_fd); }
  int release_read() { return std::exchange(read_fd, -1); }

 private:
  static void close_once(int& fd) {
    if (fd >= 0) close(fd);
    fd = -1;
  }
};

// Runs in the child between fork and exec. It makes async-signal-safe calls only, because a DDS
// thread may have held a lock at the fork.
[[noreturn]] void exec_program(char* const* argv, char* const* environment, const cpu_set_t* cores,
                               pid_t parent, int output_fd, int error_fd, int heartbeat_fd) {
  setpgid(0, 0);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);  // the parent died before the prctl call
  if (cores) sched_setaffinity(0, sizeof *cores, cores);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  for (const int number : {SIGINT, SIGTERM, SIGPIPE}) signal(number, SIG_DFL);
  const int null_fd = open("/dev/null", O_RDONLY | O_CLOEXEC);
  dup2(null_fd, STDIN_FILENO);
  dup2(output_fd, STDOUT_FILENO);
  dup2(output_fd, STDERR_FILENO);
  close_range(3, ~0U, CLOSE_RANGE_CLOEXEC);  // sockets that libraries opened without O_CLOEXEC
  if (heartbeat_fd >= 0) fcntl(heartbeat_fd, F_SETFD, 0);
  execve(argv[0], argv, environment);
  const int error = errno;
  (void)!write(error_fd, &error, sizeof error);
  _exit(127);
}

}  // namespace

std::string to_string(const ProcessExit& exit) {
  if (exit.by_signal) {
    const char* name = sigabbrev_np(exit.number);
    return "killed by signal " + std::to_string(exit.number) +
           (name ? " (SIG" + std::string(name) + ")" : "");
  }
  const std::string code = "exit code " + std::to_string(exit.number);
  switch (exit.number) {
    case 0: return code + " (exited cleanly)";
    case 1: return code + " (failed)";
    case 2: return code + " (usage or configuration)";
    case 3: return code + " (hardware or peer missing)";
    case 130: return code + " (interrupted)";
    default: return code;
  }
}

ChildProcess::ChildProcess(const std::vector<std::string>& argv, const std::vector<int>& cores,
                           const base::Heartbeat* heartbeat) {
  std::vector<char*> raw_argv;
  for (const std::string& word : argv) raw_argv.push_back(const_cast<char*>(word.c_str()));
  raw_argv.push_back(nullptr);
  std::string heartbeat_variable = std::string(base::kHeartbeatVariable) + "=";
  std::vector<char*> environment;
  for (char** variable = environ; *variable; ++variable)
    if (!std::string_view(*variable).starts_with(heartbeat_variable))
      environment.push_back(*variable);
  if (heartbeat) {
    heartbeat_variable += std::to_string(heartbeat->file());
    environment.push_back(heartbeat_variable.data());
  }
  environment.push_back(nullptr);
  cpu_set_t core_set;
  CPU_ZERO(&core_set);
  for (const int core : cores)
    if (core >= 0 && core < CPU_SETSIZE) CPU_SET(core, &core_set);

  Pipe output, exec_error;
  const pid_t parent = getpid();
  pid_ = fork();
  if (pid_ < 0) throw std::system_error(errno, std::generic_category(), "fork");
  if (pid_ == 0)
    exec_program(raw_argv.data(), environment.data(), cores.empty() ? nullptr : &core_set, parent,
                 output.write_fd, exec_error.write_fd, heartbeat ? heartbeat->file() : -1);

  // Parent and child both make the group, so that it exists before the parent signals it.
  setpgid(pid_, pid_);
  exec_error.close_write();
  int error = 0;
  ssize_t got;
  while ((got = read(exec_error.read_fd, &error, sizeof error)) < 0 && errno == EINTR) {
  }
  if (got == ssize_t(sizeof error)) {
    waitpid(pid_, nullptr, 0);
    throw std::system_error(error, std::generic_category(), "cannot execute " + argv[0]);
  }
  output_fd_ = output.release_read();
  fcntl(output_fd_, F_SETFL, O_NONBLOCK);
}

ChildProcess::~ChildProcess() {
  signal_group(SIGKILL);
  if (!abandoned_) wait_for_end(kKillTimeout);
  if (output_fd_ >= 0) close(output_fd_);
}

std::vector<std::string> ChildProcess::read_lines(bool flush) {
  std::array<char, 16 * 1024> buffer;
  std::vector<std::string> lines;
  // The limit keeps a child with much output from delaying the others.
  for (int chunk = 0; chunk < 16 && output_fd_ >= 0; ++chunk) {
    const ssize_t got = read(output_fd_, buffer.data(), buffer.size());
    if (got > 0) {
      unfinished_.append(buffer.data(), std::size_t(got));
    } else if (got < 0 && (errno == EAGAIN || errno == EINTR)) {
      break;
    } else {
      close(output_fd_);
      output_fd_ = -1;
      flush = true;
    }
    std::size_t begin = 0;
    for (std::size_t end; (end = unfinished_.find('\n', begin)) != std::string::npos;
         begin = end + 1)
      lines.push_back(unfinished_.substr(begin, end - begin));
    unfinished_.erase(0, begin);
    if (unfinished_.size() > kMaxLineBytes) lines.push_back(std::exchange(unfinished_, {}));
  }
  if (flush && !unfinished_.empty()) lines.push_back(std::exchange(unfinished_, {}));
  return lines;
}

std::optional<ProcessExit> ChildProcess::ended() {
  int status = 0;
  // A process that this one traces also reports its stops.
  if (!exit_ && waitpid(pid_, &status, WNOHANG) == pid_ && !WIFSTOPPED(status))
    exit_ = WIFSIGNALED(status) ? ProcessExit{true, WTERMSIG(status)}
                                : ProcessExit{false, WEXITSTATUS(status)};
  return exit_;
}

bool ChildProcess::wait_for_end(std::chrono::milliseconds timeout) {
  const auto until = std::chrono::steady_clock::now() + timeout;
  while (!ended() && std::chrono::steady_clock::now() < until)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  return ended().has_value();
}

void ChildProcess::signal_group(int signal) const { kill(-pid_, signal); }

bool ChildProcess::is_held() const {
  std::ifstream status("/proc/" + std::to_string(pid_) + "/status");
  for (std::string line; std::getline(status, line);)
    for (const std::string_view key : {"TracerPid:", "CoreDumping:"})
      if (line.starts_with(key) && std::atoi(line.c_str() + key.size()) != 0) return true;
  return false;
}

}  // namespace fivepipe::launch
