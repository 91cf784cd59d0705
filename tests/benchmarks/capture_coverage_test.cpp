// Depth with sub-pixel silhouettes against depth with binary maps: what docs/hull.md promises.
#include <gtest/gtest.h>

#include <cstdio>

#include "benchmarks/capture/coverage_accuracy.h"
#include "common/base/timing.h"
#include "tests/support/scene_files.h"

namespace fivepipe::capture_bench {
namespace {

class CoverageOfRig : public testing::TestWithParam<const char*> {};

TEST_P(CoverageOfRig, IsNearerToTheTruthThanBinaryMaps) {
  const config::Rig rig =
      test::load_rig(std::string(FIVEPIPE_SOURCE_DIR "/scenes/rigs/") + GetParam());
  const CoverageAccuracy all = measure_coverage(rig, 3, 5);
  std::vector<double> median_mm, median_ms;
  for (const CoverageRow& row : all.rows) {
    median_mm.push_back(base::percentile(row.error_mm, 0.5));
    median_ms.push_back(base::percentile(row.time_ms, 0.5));
    std::printf("%-26s %6zu of %zu rays, depth error median %.3f mm, p95 %.3f mm, %.2f ms\n",
                name_of(row.maps).c_str(), row.error_mm.size(), all.rays, median_mm.back(),
                base::percentile(row.error_mm, 0.95), median_ms.back());
  }
  EXPECT_GT(all.rows[0].error_mm.size(), 3000u);
  const double centre_mm = median_mm[std::size_t(Maps::centre)];
  EXPECT_LE(median_mm[std::size_t(Maps::exact_coverage)], centre_mm / 3);
  EXPECT_LE(median_mm[std::size_t(Maps::estimated_coverage)], centre_mm / 2);
  // The aim is 4; it is 3.4. A busy machine disturbs the times.
  for (const Maps maps : {Maps::exact_coverage, Maps::estimated_coverage})
    EXPECT_LE(median_ms[std::size_t(maps)], 6 * median_ms[std::size_t(Maps::centre)]);
}

INSTANTIATE_TEST_SUITE_P(Rigs, CoverageOfRig, testing::Values("table4.yaml", "table6.yaml"),
                         [](const auto& rig) { return std::string(rig.param, 6); });

}  // namespace
}  // namespace fivepipe::capture_bench
