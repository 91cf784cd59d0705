// Runs a command of the shell and reads what it writes, for tests.
#pragma once
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <string>

namespace fivepipe::test {

struct ShellAnswer {
  int exit_code = -1;  // -1: it did not start, or a signal killed it
  std::string text;    // stdout; with "2>&1" at the end of the command, stderr too
};

inline ShellAnswer shell(const std::string& command) {
  ShellAnswer answer;
  std::FILE* const pipe = popen(command.c_str(), "r");
  if (!pipe) return answer;
  for (std::array<char, 4096> piece;
       const std::size_t size_bytes = std::fread(piece.data(), 1, piece.size(), pipe);)
    answer.text.append(piece.data(), size_bytes);
  const int status = pclose(pipe);
  // A shell that runs several commands reports 128 and the signal that killed the last one.
  if (WIFEXITED(status) && WEXITSTATUS(status) < 128) answer.exit_code = WEXITSTATUS(status);
  return answer;
}

}  // namespace fivepipe::test
