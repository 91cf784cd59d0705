// What a test does if an optional package of this machine is missing.
#pragma once
#include <gtest/gtest.h>

#include <cstdlib>

// Skips the test. CI sets FIVEPIPE_REQUIRE_OPTIONAL=1: there the test fails instead, so that no
// test silently stops running.
#define FIVEPIPE_SKIP_WITHOUT_PACKAGE(reason)                                                 \
  do {                                                                                        \
    if (const char* required = std::getenv("FIVEPIPE_REQUIRE_OPTIONAL");                      \
        required != nullptr && *required == '1')                                              \
      FAIL() << "FIVEPIPE_REQUIRE_OPTIONAL=1 and an optional package is missing: " << reason; \
    GTEST_SKIP() << reason;                                                                   \
  } while (false)
