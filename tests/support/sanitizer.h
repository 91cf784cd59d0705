// Which sanitizer of the compiler checks this build.
#pragma once

namespace fivepipe::test {

#if defined(__has_feature)  // Clang
inline constexpr bool kHasAddressSanitizer = __has_feature(address_sanitizer);
inline constexpr bool kHasThreadSanitizer = __has_feature(thread_sanitizer);
#elif defined(__SANITIZE_ADDRESS__)  // GCC
inline constexpr bool kHasAddressSanitizer = true, kHasThreadSanitizer = false;
#elif defined(__SANITIZE_THREAD__)
inline constexpr bool kHasAddressSanitizer = false, kHasThreadSanitizer = true;
#else
inline constexpr bool kHasAddressSanitizer = false, kHasThreadSanitizer = false;
#endif
inline constexpr bool kHasSanitizer = kHasAddressSanitizer || kHasThreadSanitizer;

// A sanitizer needs up to this many times the time and the memory. `tests/run` also runs several
// tests at once there. Tests that compute for long divide their number of samples by it.
inline constexpr int kSlowdown = kHasSanitizer ? 5 : 1;

}  // namespace fivepipe::test
