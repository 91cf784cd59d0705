// Runs the built `fivepipe study`.
#pragma once
#include <string>

#include "tests/support/process/shell.h"

namespace fivepipe::study {

enum class Output { all, errors };

inline test::ShellAnswer study_command(const std::string& arguments, Output output = Output::all) {
  return test::shell(FIVEPIPE_BINARY_DIR "/fivepipe study " + arguments +
                     (output == Output::all ? " 2>&1" : " 2>&1 >/dev/null"));
}

}  // namespace fivepipe::study
