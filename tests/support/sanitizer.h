// Whether a sanitizer of the compiler checks this build.
#pragma once

namespace fivepipe::test {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kHasSanitizer = true;
#else
inline constexpr bool kHasSanitizer = false;
#endif

// A sanitizer needs up to this many times the time and the memory. `tests/run` also runs several
// tests at once there. Tests that compute for long divide their number of samples by it.
inline constexpr int kSlowdown = kHasSanitizer ? 5 : 1;

}  // namespace fivepipe::test
