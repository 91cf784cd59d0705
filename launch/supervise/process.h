// One child process of the supervisor: started, read from, ended. Linux only.
#pragma once
#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

namespace fivepipe::launch {

struct ProcessExit {
  bool by_signal = false;
  int number = 0;  // the signal, or the exit code
};
// "killed by signal 9 (SIGKILL)", "exit code 3 (hardware or peer missing)".
std::string to_string(const ProcessExit& exit);

// A process in a process group of its own, so that whatever it starts ends with it. Its stdin is
// /dev/null; stdout and stderr are one pipe, in the order written. The kernel kills it when the
// thread that started it dies (PR_SET_PDEATHSIG): start children from the main thread only. The
// destructor kills the group and reaps.
class ChildProcess {
 public:
  // argv[0] is the path of the program. Pinned to `cores` unless empty. Throws std::system_error
  // where it can't be executed.
  ChildProcess(const std::vector<std::string>& argv, const std::vector<int>& cores);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  pid_t pid() const { return pid_; }
  int output_fd() const { return output_fd_; }  // for poll(); -1 after its end

  // Whole lines written since the last call, without their ends. `flush` also gives an unfinished
  // last line.
  std::vector<std::string> read_lines(bool flush = false);
  // Set once it has ended; never blocks.
  std::optional<ProcessExit> ended();
  void signal_group(int signal) const;

 private:
  pid_t pid_ = -1;
  int output_fd_ = -1;
  std::string unfinished_;
  std::optional<ProcessExit> exit_;
};

}  // namespace fivepipe::launch
