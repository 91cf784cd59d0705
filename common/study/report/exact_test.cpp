#include "common/study/report/exact_test.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

namespace fivepipe::study::report {
namespace {

// The differences that are not 0, ascending by size.
std::vector<double> sorted_nonzero(std::span<const double> differences_m, ExactTest& test) {
  if (differences_m.size() > kMaxDifferences)
    throw std::invalid_argument("an exact test of too many differences");
  std::vector<double> sorted;
  for (const double difference : differences_m) {
    if (!std::isfinite(difference))
      throw std::invalid_argument("an exact test of a difference that is not finite");
    if (std::abs(difference) <= kTie_m) {
      ++test.zero;
    } else {
      ++(difference > 0 ? test.positive : test.negative);
      sorted.push_back(difference);
    }
  }
  std::ranges::sort(sorted, {}, [](double d) { return std::abs(d); });
  return sorted;
}

// Twice the rank of each, so that the mean of tied ranks is whole.
std::vector<std::size_t> doubled_ranks(const std::vector<double>& sorted) {
  std::vector<std::size_t> ranks(sorted.size());
  for (std::size_t first = 0; first < sorted.size();) {
    std::size_t end = first + 1;
    while (end < sorted.size() && std::abs(sorted[end]) - std::abs(sorted[end - 1]) <= kTie_m)
      ++end;
    for (std::size_t i = first; i < end; ++i) ranks[i] = first + 1 + end;
    first = end;
  }
  return ranks;
}

// The probability of a sum of at most min(sum, total - sum), or of at least the other, if each
// value counts with probability 1/2. The distribution is symmetric about total / 2.
double two_sided_p(const std::vector<std::size_t>& values, std::size_t sum) {
  std::size_t total = 0;
  for (const std::size_t value : values) total += value;
  std::vector<double> probability(total + 1, 0.0);
  probability[0] = 1;
  std::size_t largest = 0;
  for (const std::size_t value : values) {
    largest += value;
    for (std::size_t s = largest + 1; s-- > 0;)
      probability[s] = 0.5 * (probability[s] + (s >= value ? probability[s - value] : 0));
  }
  double tail = 0;
  for (std::size_t s = 0; s <= std::min(sum, total - sum); ++s) tail += probability[s];
  return std::min(1.0, 2 * tail);
}

}  // namespace

ExactTest sign_test(std::span<const double> differences_m) {
  ExactTest test;
  const std::vector<double> sorted = sorted_nonzero(differences_m, test);
  test.statistic = double(test.positive);
  test.p = two_sided_p(std::vector<std::size_t>(sorted.size(), 1), test.positive);
  return test;
}

ExactTest wilcoxon_test(std::span<const double> differences_m) {
  ExactTest test;
  const std::vector<double> sorted = sorted_nonzero(differences_m, test);
  const std::vector<std::size_t> ranks = doubled_ranks(sorted);
  std::size_t positive_ranks = 0;
  for (std::size_t i = 0; i < sorted.size(); ++i)
    if (sorted[i] > 0) positive_ranks += ranks[i];
  test.statistic = 0.5 * double(positive_ranks);
  test.p = two_sided_p(ranks, positive_ranks);
  return test;
}

double min_p(std::size_t n) { return n == 0 ? 1 : std::ldexp(1.0, 1 - int(n)); }

}  // namespace fivepipe::study::report
