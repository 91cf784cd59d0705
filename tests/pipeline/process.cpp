#include "tests/pipeline/process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <sstream>

namespace fivepipe::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

std::string file_text(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

struct Stat {
  char state = 'X';
  pid_t parent = 0;
};
Stat stat_of(pid_t pid) {
  const std::string text = file_text("/proc/" + std::to_string(pid) + "/stat");
  Stat stat;
  if (const std::size_t name_end = text.rfind(')'); name_end != std::string::npos) {
    std::istringstream rest(text.substr(name_end + 1));
    rest >> stat.state >> stat.parent;
  }
  return stat;
}

}  // namespace

Deployed::Deployed(const std::string& deployment, std::uint32_t domain, const std::filesystem::path& out, const std::vector<std::string>& more) {
  std::vector<std::string> words = {std::string(FIVEPIPE_BINARY_DIR) + "/fivepipe", "up", deployment, "--domain", std::to_string(domain), "--out", out.string()};
  words.insert(words.end(), more.begin(), more.end());
  std::filesystem::create_directories(out);
  const std::string log = (out / "up.log").string();
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  pid_ = fork();
  if (pid_ == 0) {
    const int file = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    dup2(file, 1);
    dup2(file, 2);
    execv(argv[0], argv.data());
    _exit(127);
  }
}

Deployed::~Deployed() {
  if (exit_code_) return;
  kill(pid_, SIGTERM);
  if (!wait_for_end(5s)) {
    kill(pid_, SIGKILL);
    wait_for_end(2s);
  }
}

std::vector<pid_t> Deployed::all_children() const {
  std::vector<pid_t> children;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    const std::string name = entry.path().filename();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    const pid_t pid = std::stoi(name);
    const Stat stat = stat_of(pid);
    if (stat.parent == pid_ && stat.state != 'Z') children.push_back(pid);
  }
  return children;
}

std::optional<pid_t> Deployed::pid_of(const std::string& node) const {
  const std::string argument = std::string("--node") + '\0' + node + '\0';
  for (const pid_t child : all_children())
    if (file_text("/proc/" + std::to_string(child) + "/cmdline").find(argument) != std::string::npos) return child;
  return std::nullopt;
}

void Deployed::signal(int number) const { kill(pid_, number); }

std::optional<int> Deployed::wait_for_end(std::chrono::milliseconds timeout) {
  const auto deadline = Clock::now() + timeout;
  while (!exit_code_) {
    int status = 0;
    if (waitpid(pid_, &status, WNOHANG) == pid_) exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    if (Clock::now() >= deadline) break;
    if (!exit_code_) usleep(5000);
  }
  return exit_code_;
}

bool eventually(Bus& bus, std::chrono::milliseconds timeout, const std::function<bool()>& condition) {
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
