// What the hosts of one deployment say about each other.
#include "launch/supervise/hosts/host_checks.h"

#include <gtest/gtest.h>

#include "tests/support/text.h"

namespace fivepipe::launch {
namespace {

using test::contains;

constexpr std::int64_t kMs = 1'000'000;

HostState state(const std::string& host) {
  return {{host, "up"}, host + ".lab", "1.2 (abc)", {{"lab.yaml", 1}, {"../rig.yaml", 2}}, {}};
}

std::vector<std::string> checked(HostChecks& checks, std::optional<ClockOffset> clock,
                                 bool is_starting = true) {
  return checks.check(state("beta"), {{state("alpha"), clock}}, is_starting);
}

TEST(Checksum, IsFnv1a) {
  // http://www.isthe.com/chongo/tech/comp/fnv/: test vectors for 64 bits.
  EXPECT_EQ(checksum_of(""), 0xcbf29ce484222325u);
  EXPECT_EQ(checksum_of("a"), 0xaf63dc4c8601ec8cu);
  EXPECT_EQ(checksum_of("foobar"), 0x85944171f73967e8u);
}

TEST(HostDifferences, AreNamedWithBothSides) {
  const HostState own = state("beta");
  HostState other = state("alpha");
  EXPECT_TRUE(differences(own, other).empty());
  other.version = "1.1 (def)";
  other.files["../rig.yaml"] = 3;
  other.files.erase("lab.yaml");
  other.files["hand.obj"] = 9;
  const std::vector<std::string> texts = differences(own, other);
  ASSERT_EQ(texts.size(), 4u);
  for (const std::string& text : texts) {
    EXPECT_TRUE(contains(text, "host alpha (machine alpha.lab)")) << text;
    EXPECT_TRUE(contains(text, "host beta (machine beta.lab)")) << text;
  }
  EXPECT_TRUE(contains(texts[0], "1.1 (def)") && contains(texts[0], "1.2 (abc)")) << texts[0];
  EXPECT_TRUE(contains(texts[1], "../rig.yaml is not the same")) << texts[1];
  EXPECT_TRUE(contains(texts[1], "checksum 0000000000000003")) << texts[1];
  EXPECT_TRUE(contains(texts[1], "checksum 0000000000000002")) << texts[1];
  EXPECT_TRUE(contains(texts[2], "hand.obj") && contains(texts[2], "not read")) << texts[2];
  EXPECT_TRUE(contains(texts[3], "lab.yaml") && contains(texts[3], "not read")) << texts[3];
}

TEST(HostChecks, AnEqualHostIsNotWorthALine) {
  HostChecks checks(false);
  EXPECT_TRUE(checked(checks, std::nullopt).empty());
  EXPECT_TRUE(checked(checks, ClockOffset{kMs, kMs / 10}).empty());
  EXPECT_EQ(checks.refusal(), "");
}

TEST(HostChecks, ADifferenceIsLoggedOnce) {
  HostChecks checks(false);
  HostState other = state("alpha");
  other.version = "1.1\x1b (def)";
  const auto texts = checks.check(state("beta"), {{other, std::nullopt}}, true);
  ASSERT_EQ(texts.size(), 1u);
  EXPECT_TRUE(contains(texts[0], "1.1? (def)")) << texts[0];
  EXPECT_TRUE(checks.check(state("beta"), {{other, std::nullopt}}, true).empty());
}

TEST(HostChecks, AClockIsLoggedWhenItBecomesWorse) {
  HostChecks checks(true);
  const auto texts = checked(checks, ClockOffset{5 * kMs, kMs / 10});
  ASSERT_EQ(texts.size(), 1u);
  EXPECT_TRUE(
      contains(texts[0], "the clock of host alpha is 5.00 ms ahead (error at most 0.10 ms)"))
      << texts[0];
  EXPECT_TRUE(checked(checks, ClockOffset{6 * kMs, kMs / 10}).empty());
  EXPECT_EQ(checked(checks, ClockOffset{-150 * kMs, kMs / 10}).size(), 1u);
  EXPECT_TRUE(checked(checks, ClockOffset{5 * kMs, kMs / 10}).empty());
  // The known offset is less certain, or near the limit.
  EXPECT_TRUE(checked(checks, ClockOffset{5 * kMs, 9 * kMs}).empty());
  EXPECT_TRUE(checked(checks, ClockOffset{2 * kMs, kMs / 10}).empty());
  EXPECT_TRUE(checked(checks, ClockOffset{5 * kMs, kMs / 10}).empty());
  EXPECT_TRUE(checked(checks, ClockOffset{0, kMs / 10}).empty());
  EXPECT_EQ(checked(checks, ClockOffset{5 * kMs, kMs / 10}).size(), 1u);
  EXPECT_EQ(checks.refusal(), "");
}

TEST(HostChecks, ALargeOffsetEndsARunThatStarts) {
  HostChecks starts(false), runs(false), accepts(true);
  checked(starts, ClockOffset{150 * kMs, kMs / 10});
  EXPECT_TRUE(contains(starts.refusal(), "150.00 ms ahead")) << starts.refusal();
  EXPECT_TRUE(contains(starts.refusal(), "--allow-clock-offset")) << starts.refusal();
  EXPECT_EQ(checked(runs, ClockOffset{150 * kMs, kMs / 10}, false).size(), 1u);
  EXPECT_EQ(runs.refusal(), "");
  checked(accepts, ClockOffset{150 * kMs, kMs / 10});
  EXPECT_EQ(accepts.refusal(), "");
}

// `fivepipe doctor` speaks for the same host.
TEST(HostChecks, TheOwnClockIsNotJudged) {
  HostChecks checks(false);
  HostState doctor = state("beta");
  doctor.speaker.program = "doctor";
  EXPECT_TRUE(checks.check(state("beta"), {{doctor, ClockOffset{90 * kMs, 0}}}, true).empty());
  EXPECT_EQ(checks.refusal(), "");
}

TEST(HostsTable, ComparesWithTheFirstHostThatMeasures) {
  HostState alpha = state("alpha"), beta = state("beta");
  EXPECT_EQ(hosts_table({}), "");
  EXPECT_TRUE(contains(hosts_table({{alpha}, {beta}}), "not compared"));
  alpha.clocks[beta.speaker] = {5 * kMs, kMs / 10};
  beta.clocks[alpha.speaker] = {-5 * kMs, kMs / 10};
  beta.files["lab.yaml"] = 7;
  EXPECT_EQ(hosts_table({{alpha}, {beta}}),
            "host   state         machine    version    clock                                  "
            "files\n"
            "alpha  running       alpha.lab  1.2 (abc)  reference                              the "
            "same\n"
            "beta   running       beta.lab   1.2 (abc)  5.00 ms ahead (error at most 0.10 ms)  "
            "differ\n");
}

// A silent host compares no clocks, and those of the others with it are of the time before.
TEST(HostsTable, ShowsSilentAndMissingHosts) {
  HostState alpha = state("alpha"), beta = state("beta");
  alpha.clocks[beta.speaker] = {5 * kMs, kMs / 10};
  beta.clocks[alpha.speaker] = {-5 * kMs, kMs / 10};
  EXPECT_EQ(hosts_table({{alpha, 5.4}, {beta, 5}}, {"alpha", "beta", "gamma"}),
            "host   state         machine    version    clock         files\n"
            "alpha  silent 5 s    alpha.lab  1.2 (abc)  not compared  the same\n"
            "beta   running       beta.lab   1.2 (abc)  reference     the same\n"
            "gamma  missing       -          -          -             -\n");
  EXPECT_EQ(hosts_table({}, {"gamma"}),
            "host   state         machine  version  clock  files\n"
            "gamma  missing       -        -        -      -\n");
}

}  // namespace
}  // namespace fivepipe::launch
