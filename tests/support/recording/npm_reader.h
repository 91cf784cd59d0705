// Runs tests/npm/read_mcap.mjs, which reads MCAP files by independent libraries.
#pragma once
#include <sys/wait.h>

#include <cstdio>
#include <filesystem>
#include <string>
#include <utility>

namespace fivepipe::test {

struct CommandOutput {
  int exit_code = -1;
  std::string text;
};

inline CommandOutput output_of(const std::string& command) {
  CommandOutput output;
  FILE* pipe = popen(command.c_str(), "r");
  if (!pipe) return output;
  char piece[4096];
  while (const std::size_t size_bytes = std::fread(piece, 1, sizeof piece, pipe))
    output.text.append(piece, size_bytes);
  const int status = pclose(pipe);
  if (WIFEXITED(status)) output.exit_code = WEXITSTATUS(status);
  return output;
}

// Installs the reader into the build folder unless it is installed. Exit code 77: it cannot be
// installed on this machine; the text states why.
inline CommandOutput install_npm_reader() {
  return output_of(FIVEPIPE_SOURCE_DIR "/tests/npm/install " FIVEPIPE_BINARY_DIR "/../npm 2>&1");
}

// Returns the reader's output, including stderr, for a file whose name contains no quotes.
inline CommandOutput read_with_npm(const std::filesystem::path& file,
                                   const std::string& options = "") {
  return output_of("node " FIVEPIPE_BINARY_DIR "/../npm/read_mcap.mjs " + options + " '" +
                   file.string() + "' 2>&1");
}

}  // namespace fivepipe::test
