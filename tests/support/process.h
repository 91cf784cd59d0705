// Programs run for tests, always ended; and a deployment run by the real `fivepipe up`, in a domain
// of its own, watched through the bus.
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
  // Starts it; standard output and errors go into the file `log`. It reads from nowhere, unless it
  // is to be typed to.
  Program(std::vector<std::string> words, const std::filesystem::path& log, bool typed_to = false);
  ~Program();  // ends it, hard if need be
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  pid_t pid() const { return pid_; }
  void type(const std::string& keys) const;
  void signal(int number) const;
  // Exit code once it has ended, within the time; nothing otherwise.
  std::optional<int> wait_for_end(std::chrono::milliseconds timeout);
  std::string said() const;

 private:
  std::filesystem::path log_;
  int keyboard_ = -1;
  pid_t pid_ = -1;
  std::optional<int> exit_code_;
};

class Deployed {
 public:
  // Starts `fivepipe up DEPLOYMENT --domain DOMAIN --out OUT` with more arguments.
  Deployed(const std::string& deployment, std::uint32_t domain, const std::filesystem::path& out,
           const std::vector<std::string>& more = {});

  // The node's process now; nothing while it is down.
  std::optional<pid_t> pid_of(const std::string& node) const;
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

// Waits on the bus until the condition holds; false when the time is up.
bool eventually(bus::Bus& bus, std::chrono::milliseconds timeout,
                const std::function<bool()>& condition);

bool is_alive(pid_t pid);  // exists and is no zombie

}  // namespace fivepipe::test
