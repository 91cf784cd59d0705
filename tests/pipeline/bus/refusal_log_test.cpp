// Messages of Cyclone DDS about refused peers.
#include "common/pipeline/bus/secured/refusal_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace fivepipe::bus::detail {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

TEST(RefusalLog, ARepeatedTextIsLoggedOncePerMinute) {
  RefusalLog log;
  const RefusalLog::Clock::time_point start{};
  const std::string first = "Remote secure participant 998a2c1d:cc219f99:9eba539e:1c1 not allowed",
                    second = "Remote secure participant f2e5aceb:9aaaf3c4:1a0c7ade:1c1 not allowed";
  EXPECT_THAT(*log.line_for(first, start), HasSubstr(first));
  EXPECT_EQ(log.line_for(first, start + 1s), std::nullopt);
  EXPECT_EQ(log.line_for(second, start + 59s), std::nullopt) << "of another participant";
  EXPECT_THAT(*log.line_for(second, start + 60s),
              HasSubstr("(2 messages before it are not shown)"));
  EXPECT_EQ(log.line_for("another text", start + 60s), "another text");
}

TEST(RefusalLog, KnownReasonsAreExplained) {
  RefusalLog log;
  EXPECT_THAT(*log.line_for("match a with b security_attributes mismatch: 0x1 - 0x2", {}),
              HasSubstr("the keys of one process sign, those of the other encrypt"));
  EXPECT_THAT(*log.line_for("Begin handshake reply failed: Certificate not valid: error", {}),
              HasSubstr("keys of another CA, or with expired ones"));
}

// A peer chooses the subject of its certificate.
TEST(RefusalLog, InventedTextsAreBounded) {
  RefusalLog log;
  std::size_t lines = 0;
  for (char c = 'a'; c <= 'z'; ++c)
    for (char d = 'a'; d <= 'z'; ++d)
      lines += log.line_for("subject: /CN=" + std::string{c, d}, {}).has_value();
  EXPECT_EQ(lines, RefusalLog::kMaxTexts);
  const auto later = log.line_for("subject", RefusalLog::Clock::time_point(60s));
  ASSERT_TRUE(later) << "a minute later";
  EXPECT_THAT(*later, HasSubstr("(" + std::to_string(26 * 26 - RefusalLog::kMaxTexts) +
                                " messages before it are not shown)"));
}

}  // namespace
}  // namespace fivepipe::bus::detail
