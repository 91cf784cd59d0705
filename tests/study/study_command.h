// Runs the built `fivepipe study`.
#pragma once
#include <sys/wait.h>

#include <cstdio>
#include <string>

namespace fivepipe::study {

struct StudyAnswer {
  int exit_code = -1;  // -1: killed by a signal
  std::string text;    // stdout and stderr, or stderr alone
};

enum class Output { all, errors };

inline StudyAnswer study_command(const std::string& arguments, Output output = Output::all) {
  StudyAnswer answer;
  const std::string command = FIVEPIPE_BINARY_DIR "/fivepipe study " + arguments +
                              (output == Output::all ? " 2>&1" : " 2>&1 >/dev/null");
  std::FILE* pipe = popen(command.c_str(), "r");
  if (!pipe) return answer;
  char piece[4096];
  while (const std::size_t n = std::fread(piece, 1, sizeof piece, pipe))
    answer.text.append(piece, n);
  const int status = pclose(pipe);
  if (WIFEXITED(status)) answer.exit_code = WEXITSTATUS(status);
  return answer;
}

}  // namespace fivepipe::study
