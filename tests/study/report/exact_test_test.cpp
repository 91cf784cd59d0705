// The exact tests against all sign patterns, published values and the paper's Table 1.
#include "common/study/report/exact_test.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>
#include <vector>

#include "tests/support/not_finite.h"

namespace fivepipe::study::report {
namespace {

// By the definition: the rank of each size is the mean rank of all that are equal to it.
double rank_of(const std::vector<double>& sizes, std::size_t i) {
  double less = 0, equal = 0;
  for (const double size : sizes) {
    less += size < sizes[i] - kTie_m;
    equal += std::abs(size - sizes[i]) <= kTie_m;
  }
  return less + (equal + 1) / 2;
}

// The fraction of all 2^n assignments of signs whose statistic is at least as far from its mean.
double enumerated_p(const std::vector<double>& differences, bool with_ranks) {
  std::vector<double> sizes, scores;
  std::vector<bool> positive;
  for (const double d : differences)
    if (d != 0) {
      sizes.push_back(std::abs(d));
      positive.push_back(d > 0);
    }
  double mean = 0, statistic = 0;
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    scores.push_back(with_ranks ? rank_of(sizes, i) : 1);
    mean += scores[i] / 2;
    if (positive[i]) statistic += scores[i];
  }
  const std::size_t patterns = std::size_t(1) << sizes.size();
  std::size_t extreme = 0;
  for (std::size_t pattern = 0; pattern < patterns; ++pattern) {
    double sum = 0;
    for (std::size_t i = 0; i < sizes.size(); ++i)
      if (pattern >> i & 1) sum += scores[i];
    extreme += std::abs(sum - mean) >= std::abs(statistic - mean) - 1e-9;
  }
  return double(extreme) / double(patterns);
}

TEST(ExactTest, EqualsTheEnumerationOfAllSigns) {
  std::mt19937 random(7);
  std::uniform_int_distribution<int> size(-6, 6), count(0, 11);  // ties and zeros are frequent
  for (int run = 0; run < 400; ++run) {
    std::vector<double> differences(std::size_t(count(random)));
    for (double& d : differences) d = 0.01 * size(random);
    EXPECT_NEAR(wilcoxon_test(differences).p, enumerated_p(differences, true), 1e-12);
    EXPECT_NEAR(sign_test(differences).p, enumerated_p(differences, false), 1e-12);
  }
}

// Hollander and Wolfe (1973), p. 29: depression scales of nine patients, V = 40. R 4.2 prints
// p = 0.01953 for one side.
TEST(ExactTest, SignedRankOfHollanderAndWolfe) {
  const std::vector<double> x{1.83, 0.50, 1.62, 2.48, 1.68, 1.88, 1.55, 3.06, 1.30},
      y{0.878, 0.647, 0.598, 2.05, 1.06, 1.29, 1.06, 3.14, 1.29};
  std::vector<double> differences;
  for (std::size_t i = 0; i < x.size(); ++i) differences.push_back(x[i] - y[i]);
  const ExactTest test = wilcoxon_test(differences);
  EXPECT_EQ(test.statistic, 40);
  EXPECT_DOUBLE_EQ(test.p, 0.0390625);
}

TEST(ExactTest, SignTestOfEightInTenIsTheBinomial) {
  std::vector<double> differences(10, 1.0);
  differences[2] = differences[5] = -1;
  EXPECT_DOUBLE_EQ(sign_test(differences).p, 2.0 * (1 + 10 + 45) / 1024);
}

// Table 1: found 15, 22.5, 22.3, 23; necessary 14, 14.2, 15-16, 15; allocated 21, 16, 20, 15.
TEST(ExactTest, FourParticipantsOfThePaperDoNotReach5Percent) {
  const std::vector<double> necessary{0.01, 0.083, 0.068, 0.08},
      allocated{-0.06, 0.065, 0.023, 0.08};
  EXPECT_EQ(wilcoxon_test(necessary).p, 0.125);
  EXPECT_EQ(sign_test(necessary).p, 0.125);
  EXPECT_EQ(wilcoxon_test(allocated).p, 0.375);
  EXPECT_EQ(sign_test(allocated).p, 0.625);
  EXPECT_EQ(min_p(4), 0.125);
}

TEST(ExactTest, SmallestPIsThatOfEqualSigns) {
  for (std::size_t n = 1; n <= 60; ++n) {
    std::vector<double> differences(n);
    for (std::size_t i = 0; i < n; ++i) differences[i] = 0.01 * double(i + 1);
    EXPECT_DOUBLE_EQ(wilcoxon_test(differences).p, min_p(n)) << n;
    EXPECT_DOUBLE_EQ(sign_test(differences).p, min_p(n)) << n;
  }
}

TEST(ExactTest, ZerosAreDroppedAndRoundingMakesNoDifference) {
  const std::vector<double> differences{0.225 - 0.16 - 0.065, 0.0, 0.3 - 0.1, 0.1 - 0.3, 0.2};
  const ExactTest test = wilcoxon_test(differences);
  EXPECT_EQ(test.zero, 2u);
  EXPECT_EQ(test.positive, 2u);
  EXPECT_EQ(test.negative, 1u);
  EXPECT_EQ(test.statistic, 4);  // three tied sizes of rank 2
  EXPECT_EQ(test.p, 1);
  EXPECT_EQ(wilcoxon_test(std::vector<double>{0, 0}).p, 1);
  EXPECT_EQ(sign_test({}).p, 1);
  EXPECT_EQ(min_p(0), 1);
}

TEST(ExactTest, RefusesWhatIsNoNumber) {
  for (const double bad : {test::kNaN, test::kInfinity, -test::kInfinity}) {
    const std::vector<double> differences{0.1, bad};
    EXPECT_THROW(wilcoxon_test(differences), std::invalid_argument);
    EXPECT_THROW(sign_test(differences), std::invalid_argument);
  }
  const std::vector<double> many(kMaxDifferences + 1, 0.1);
  EXPECT_THROW(wilcoxon_test(many), std::invalid_argument);
}

}  // namespace
}  // namespace fivepipe::study::report
