// Exact two-sided tests of paired differences, for few participants.
//
// Both return the probability, if each difference were positive or negative with probability 1/2
// independently of the others, of a result at least as far from balance. The p-value of n
// differences that are not 0 is at least 2^(1-n): 0.125 for four.
#pragma once
#include <cstddef>
#include <optional>
#include <span>

namespace fivepipe::study::report {

struct ExactTest {
  std::size_t positive = 0, negative = 0, zero = 0;
  // Sum of the ranks of the positive differences (wilcoxon_test), or their number (sign_test).
  double statistic = 0;
  double p = 1;  // two-sided; 1 if all differences are 0
};

// Differences are in metres. One of at most kTie_m counts as 0, and two sizes that differ by at
// most that are tied: people answer in millimetres, and 0.225 - 0.16 is not 0.065 in binary.
inline constexpr double kTie_m = 1e-6;
inline constexpr std::size_t kMaxDifferences = 1000;  // 2^-1000 is a normal double

// Both drop the differences that are 0, and throw std::invalid_argument for NaN, infinity, or more
// than kMaxDifferences.

// The sign test: number of positive differences against Binomial(n, 1/2).
ExactTest sign_test(std::span<const double> differences_m);

// The signed-rank test (Wilcoxon, Individual Comparisons by Ranking Methods, 1945). Tied sizes get
// the mean of their ranks, and the distribution is that of these ranks (the permutation
// distribution), so the test stays exact. It assumes that the differences are symmetric about their
// median.
ExactTest wilcoxon_test(std::span<const double> differences_m);

// Returns 2^(1-n), the smallest p-value that n differences can reach; 1 if n is 0.
double min_p(std::size_t n);

}  // namespace fivepipe::study::report
