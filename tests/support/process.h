// Runs programs for tests and ends them in the destructor. Runs deployments with the real `fivepipe
// up`.
#pragma once
#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/pipeline/bus/bus.h"

namespace fivepipe::test {

class Program {
 public:
  // Starts the program. Its stdout and stderr go to the file `log`. Its stdin is /dev/null, or the
  // keys of type() if `typed_to`.
  Program(std::vector<std::string> words, const std::filesystem::path& log, bool typed_to = false);
  ~Program();  // sends SIGTERM, then SIGKILL after 5 s
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  pid_t pid() const { return pid_; }
  // Writes the keys to the program's stdin; requires typed_to.
  void type(const std::string& keys) const;
  void signal(int number) const;  // SIGSTOP: returns when the program has stopped
  // Returns the exit code, or 128 plus the signal; nullopt if the program still runs after
  // `timeout`.
  std::optional<int> wait_for_end(std::chrono::milliseconds timeout);
  std::string said() const;  // the text in `log`

 private:
  std::filesystem::path log_;
  int keyboard_ = -1;
  pid_t pid_ = -1;
  std::optional<int> exit_code_;
};

class Deployed {
 public:
  // Starts `fivepipe up DEPLOYMENT --domain DOMAIN --out OUT` and the arguments in `more`.
  Deployed(const std::string& deployment, std::uint32_t domain, const std::filesystem::path& out,
           const std::vector<std::string>& more = {});

  // Returns the node's current process; nullopt if there is none.
  std::optional<pid_t> pid_of(const std::string& node) const;
  // Returns the child processes of `fivepipe up` that have not ended.
  std::vector<pid_t> all_children() const;
  pid_t pid() const { return program_.pid(); }

  void signal(int number) const { program_.signal(number); }
  std::string said() const { return program_.said(); }
  std::optional<int> wait_for_end(std::chrono::milliseconds timeout) {
    return program_.wait_for_end(timeout);
  }

 private:
  Program program_;
};

// Waits on the bus until the condition holds. Returns false after `timeout`.
bool eventually(bus::Bus& bus, std::chrono::milliseconds timeout,
                const std::function<bool()>& condition);

bool is_alive(pid_t pid);  // false for a zombie

}  // namespace fivepipe::test
