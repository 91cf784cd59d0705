#include "tests/support/process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <sstream>

#include "tests/support/process/stat.h"

namespace fivepipe::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

// Returns an empty text if the file does not exist, or if it is in /proc and the process ends.
std::string file_text(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

Stat stat_of(pid_t pid) { return stat_in("/proc/" + std::to_string(pid) + "/stat"); }

}  // namespace

Program::Program(std::vector<std::string> words, const std::filesystem::path& log, bool typed_to)
    : log_(log) {
  std::filesystem::create_directories(log.parent_path());
  std::filesystem::remove(log);  // said() must not return the text of an earlier program
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  int input[2] = {-1, -1};
  if (typed_to && pipe2(input, O_CLOEXEC) != 0) return;
  keyboard_ = input[1];
  pid_ = fork();
  if (pid_ == 0) {
    // A shell starts background jobs with SIGINT ignored, which exec() keeps.
    ::signal(SIGINT, SIG_DFL);
    const int file = open(log_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    dup2(typed_to ? input[0] : open("/dev/null", O_RDONLY), 0);
    dup2(file, 1);
    dup2(file, 2);
    execv(argv[0], argv.data());
    _exit(127);
  }
  if (typed_to) close(input[0]);
}

Program::~Program() {
  if (keyboard_ >= 0) close(keyboard_);
  if (exit_code_) return;
  kill(pid_, SIGCONT);
  kill(pid_, SIGTERM);
  if (!wait_for_end(5s)) {
    kill(pid_, SIGKILL);
    wait_for_end(2s);
  }
}

void Program::type(const std::string& keys) const {
  if (write(keyboard_, keys.data(), keys.size()) != ssize_t(keys.size())) perror("typing");
}

void Program::signal(int number) const {
  kill(pid_, number);
  siginfo_t info{};
  // The threads stop one after the other. waitid() also returns if the program has ended.
  if (number == SIGSTOP) waitid(P_PID, id_t(pid_), &info, WSTOPPED | WEXITED | WNOWAIT);
}

std::string Program::said() const { return file_text(log_); }

std::optional<int> Program::wait_for_end(std::chrono::milliseconds timeout) {
  const auto deadline = Clock::now() + timeout;
  while (!exit_code_) {
    int status = 0;
    if (waitpid(pid_, &status, WNOHANG) == pid_)
      exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    if (Clock::now() >= deadline) break;
    if (!exit_code_) usleep(5000);
  }
  return exit_code_;
}

namespace {

std::vector<std::string> up_words(const std::string& deployment, std::uint32_t domain,
                                  const std::filesystem::path& out,
                                  const std::vector<std::string>& more) {
  std::vector<std::string> words = {std::string(FIVEPIPE_BINARY_DIR) + "/fivepipe",
                                    "up",
                                    deployment,
                                    "--domain",
                                    std::to_string(domain),
                                    "--out",
                                    out.string()};
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

}  // namespace

Deployed::Deployed(const std::string& deployment, std::uint32_t domain,
                   const std::filesystem::path& out, const std::vector<std::string>& more)
    : program_(up_words(deployment, domain, out, more), out / "up.log") {}

std::vector<pid_t> Deployed::all_children() const {
  std::vector<pid_t> children;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    const std::string name = entry.path().filename();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    const pid_t pid = std::stoi(name);
    const Stat stat = stat_of(pid);
    if (stat.parent == program_.pid() && stat.state != 'Z') children.push_back(pid);
  }
  return children;
}

std::optional<pid_t> Deployed::pid_of(const std::string& node) const {
  const std::string argument = std::string("--node") + '\0' + node + '\0';
  for (const pid_t child : all_children())
    if (file_text("/proc/" + std::to_string(child) + "/cmdline").find(argument) !=
        std::string::npos)
      return child;
  return std::nullopt;
}

bool eventually(bus::Bus& bus, std::chrono::milliseconds timeout,
                const std::function<bool()>& condition) {
  const auto deadline = Clock::now() + timeout;
  while (!condition()) {
    if (Clock::now() > deadline) return false;
    bus.wait(20ms);
  }
  return true;
}

bool is_alive(pid_t pid) {
  const char state = stat_of(pid).state;
  return state != 'X' && state != 'Z';
}

}  // namespace fivepipe::test
