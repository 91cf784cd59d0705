# Runs at build time: writes the version, the commit and the build type to OUT if they changed.
execute_process(COMMAND git -C ${SOURCE} rev-parse --short=12 HEAD
  OUTPUT_VARIABLE COMMIT OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE FAILED)
if(FAILED)
  set(COMMIT unknown)
else()
  execute_process(COMMAND git -C ${SOURCE} status --porcelain --untracked-files=no
    OUTPUT_VARIABLE CHANGES OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  if(CHANGES)
    string(APPEND COMMIT "+")
  endif()
endif()
file(CONFIGURE OUTPUT ${OUT} CONTENT [[#include "common/base/version.h"

namespace fivepipe::base {
const char* version() { return "@VERSION@"; }
const char* commit() { return "@COMMIT@"; }
const char* build_type() { return "@BUILD_TYPE@"; }
}  // namespace fivepipe::base
]] @ONLY)
