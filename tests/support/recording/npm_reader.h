// Runs tests/npm/read_mcap.mjs, which reads MCAP files by independent libraries.
#pragma once
#include <filesystem>
#include <string>

#include "tests/support/process/shell.h"

namespace fivepipe::test {

// Installs the reader into the build folder unless it is installed. Exit code 77: it cannot be
// installed on this machine; the text states why.
inline ShellAnswer install_npm_reader() {
  return shell(FIVEPIPE_SOURCE_DIR "/tests/npm/install " FIVEPIPE_BINARY_DIR "/../npm 2>&1");
}

// Returns the reader's output, including stderr, for a file whose name contains no quotes.
inline ShellAnswer read_with_npm(const std::filesystem::path& file,
                                 const std::string& options = "") {
  return shell("node " FIVEPIPE_BINARY_DIR "/../npm/read_mcap.mjs " + options + " '" +
               file.string() + "' 2>&1");
}

}  // namespace fivepipe::test
