// The state of a process or a thread.
#pragma once
#include <sys/types.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace fivepipe::test {

struct Stat {
  char state = 'X';  // dead: there is no such process
  pid_t parent = 0;
};

// Reads the file `stat` of a process or a thread, proc(5). The name before the state may contain
// spaces and parentheses. A process may end while its file is read: operator<< then stops, where an
// iterator would throw.
inline Stat stat_in(const std::filesystem::path& file) {
  std::ostringstream content;
  content << std::ifstream(file).rdbuf();
  const std::string text = content.str();
  Stat stat;
  if (const std::size_t name_end = text.rfind(')'); name_end != std::string::npos)
    std::istringstream(text.substr(name_end + 1)) >> stat.state >> stat.parent;
  return stat;
}
inline char state_in(const std::filesystem::path& file) { return stat_in(file).state; }

}  // namespace fivepipe::test
