// When a process warns before its keys expire.
#include "common/pipeline/bus/secured/expiry_watch.h"

#include <gtest/gtest.h>

#include "common/pipeline/security/role_check.h"

namespace fivepipe::bus::detail {
namespace {

using security::kDay_s;

TEST(ExpiryWatch, WarnsFourTimesAndOnlyInTheFuture) {
  constexpr std::int64_t kEnd_s = 1'800'000'000;
  std::vector<std::int64_t> before_s;
  for (std::int64_t now_s = kEnd_s - 365 * kDay_s;;) {
    now_s = ExpiryWatch::next_warning_s(now_s, kEnd_s);
    if (now_s == INT64_MAX) break;
    before_s.push_back(kEnd_s - now_s);
  }
  EXPECT_EQ(before_s, (std::vector<std::int64_t>{30 * kDay_s, 7 * kDay_s, kDay_s, 3600}));
  EXPECT_EQ(ExpiryWatch::next_warning_s(kEnd_s - 2 * kDay_s, kEnd_s), kEnd_s - kDay_s);
  EXPECT_EQ(ExpiryWatch::next_warning_s(kEnd_s - 60, kEnd_s), INT64_MAX);
}

}  // namespace
}  // namespace fivepipe::bus::detail
