// fivepipe study what-if on a recorded session of the scene payload: its speed, and that it finds
// what single replays find. With FIVEPIPE_LONG, the whole session and all layouts.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <random>

#include "common/collision/proximity/proximity.h"
#include "launch/study/what_if/what_if.h"
#include "tests/study/speed/recorded_session.h"
#include "tests/support/hull/test_pool.h"
#include "tests/support/sanitizer.h"
#include "tests/support/test_folder.h"

namespace fivepipe::test {
namespace {

using collision::CollisionVerdict;
using study::Bracket;
using study::WhatIf;

bool is_long() { return std::getenv("FIVEPIPE_LONG") != nullptr; }

// The criterion: 60 s at 30 Hz.
constexpr int kLongFrames = 1800, kLayouts = 1000, kDistances = 25, kSampled = 50;
constexpr double kMaxDistances_s = 30, kMaxVerdicts_s = 120, kMaxRatio = 40;
constexpr double kMaxBracket_m = 2e-3;
// The clearance that the study measures at most.
constexpr double kCap_m = 0.1;
// Layouts whose clearance the exact reference measures, and frames of each of them.
std::size_t references() { return is_long() ? 4 : 2; }
int random_frames() { return is_long() ? 3 : 2; }

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// One recording for all tests.
class WhatIfSpeed : public testing::Test {
 protected:
  struct Recorded {
    TestFolder folder;
    Session session = payload_session({});
    std::filesystem::path file = folder.path / "session.mcap";
    RecordedMaps maps;
    Recorded() {
      const auto start = std::chrono::steady_clock::now();
      // The quick run has the frames in which the pipe passes below payload A.
      record_session(session, file, is_long() ? kLongFrames : 48 / kSlowdown, is_long() ? 0 : 2);
      maps = maps_of(file, session.deployment);
      fmt::print("recorded {} frames, {} different, {:.1f} MB, in {:.1f} s\n", maps.frames.size(),
                 maps.different.size(), 1e-6 * double(std::filesystem::file_size(file)),
                 seconds_since(start));
    }
  };
  static Recorded& recorded() {
    static Recorded all;
    return all;
  }

  static study::WhatIfOptions options_of(int layouts, bool with_distances) {
    study::WhatIfOptions options;
    options.recording = recorded().file;
    options.parts = {
        {.name = "payload_a", .axis_of_scene = true, .at_of_scene = true, .range_of_scene = true}};
    options.layouts = layouts;
    options.with_distances = with_distances;
    return options;
  }

  struct Timed {
    WhatIf found;
    double time_s, cpu_s;  // the latter of all threads
  };
  static Timed timed(const study::WhatIfOptions& options) {
    const auto start = std::chrono::steady_clock::now();
    const std::clock_t cpu_start = std::clock();
    WhatIf found = study::what_if(options, [](double) {});
    return {std::move(found), seconds_since(start),
            double(std::clock() - cpu_start) / CLOCKS_PER_SEC};
  }
  // Computed once.
  static const Timed& verdicts() {
    static const Timed all = timed(options_of(kLayouts, false));
    return all;
  }
  static const Timed& distances() {
    static const Timed all = timed(options_of(kDistances, true));
    return all;
  }
  static collision::MovablePart part() {
    const Session& session = recorded().session;
    for (const config::SceneObject& object : session.deployment.scene.objects)
      if (object.name == "payload_a") {
        Eigen::Isometry3d at_0 = object.world_from_object;
        at_0.translation() += object.spacing->move_world_m(0);
        return {config::mesh_of(object), at_0, object.spacing->axis_world};
      }
    throw std::logic_error("no payload A");
  }
};

TEST_F(WhatIfSpeed, MeetsTheCriterion) {
  const Session& session = recorded().session;
  EXPECT_GE(part().tree().mesh().triangles.size(), 5000u);
  EXPECT_EQ(session.cameras.size(), 4u);
  for (const geometry::Camera& camera : session.cameras)
    EXPECT_EQ(std::pair(camera.pinhole.width_px, camera.pinhole.height_px), std::pair(720, 486));
  const Timed& all = verdicts();
  study::WhatIfOptions at_one_place = options_of(1, false);
  at_one_place.parts[0].range_of_scene = false;
  at_one_place.parts[0].range = {0.18, 0.18};
  const Timed one = timed(at_one_place);
  fmt::print("{} frames, {} triangles, 2 threads:\n", all.found.frames,
             part().tree().mesh().triangles.size());
  const auto print = [](const std::string& what, const Timed& timed) {
    fmt::print("  {:<28} {:7.2f} s, {:7.2f} s of CPU\n", what, timed.time_s, timed.cpu_s);
  };
  print(fmt::format("{} spacings with distances", kDistances), distances());
  print(fmt::format("{} layouts, verdicts", kLayouts), all);
  print("1 layout, verdict", one);
  fmt::print("  {} layouts take {:.1f} times as long as one\n", kLayouts, all.time_s / one.time_s);
  if (!is_long()) return;
  EXPECT_EQ(all.found.frames, std::size_t(kLongFrames));
  EXPECT_LE(distances().time_s, kMaxDistances_s);
  EXPECT_LE(all.time_s, kMaxVerdicts_s);
  EXPECT_LE(all.time_s, kMaxRatio * one.time_s);
}

// The quick run compares layouts drawn by a seed, the long one all of them, and the penetrations.
TEST_F(WhatIfSpeed, VerdictsEqualThoseOfSingleReplays) {
  const study::LineResult& result = verdicts().found.parts[0].result;
  ASSERT_EQ(result.layouts.size(), std::size_t(kLayouts));
  std::vector<std::size_t> compared;
  for (std::size_t i = 0; i < std::size_t(kLayouts); ++i) compared.push_back(i);
  if (!is_long()) {
    std::ranges::shuffle(compared, std::mt19937(18));
    compared.resize(kSampled);
    std::ranges::sort(compared);
  }
  std::vector<double> spacings_m;
  for (const std::size_t i : compared) spacings_m.push_back(result.layouts[i].spacing_m);
  const auto start = std::chrono::steady_clock::now();
  const config::Deployment& deployment = recorded().session.deployment;
  const SingleReplays single = single_replays(recorded().maps, part(), spacings_m,
                                              deployment.hull_rule, verdicts().found.eps_m);
  fmt::print("single replays of {} layouts: {:.1f} s\n", compared.size(), seconds_since(start));
  std::size_t colliding = 0, free = 0;
  for (std::size_t i = 0; i < compared.size(); ++i) {
    const study::LayoutResult& layout = result.layouts[compared[i]];
    const SingleReplays::Layout& expected = single.layouts[i];
    EXPECT_EQ(layout.colliding_frames, expected.colliding_frames) << layout.spacing_m;
    EXPECT_EQ(layout.undecided_frames, expected.undecided_frames) << layout.spacing_m;
    EXPECT_EQ(layout.collision_s, expected.collision_s) << layout.spacing_m;
    ++(expected.colliding_frames > 0 ? colliding : free);
  }
  EXPECT_GE(colliding, 5u);
  EXPECT_GE(free, 5u);
  if (!is_long()) return;

  // Penetration: the nearest spacing of the single replays that is free in the frame.
  const double step_m = spacings_m[1] - spacings_m[0];
  double widest_m = 0;
  for (const study::LayoutResult& layout : distances().found.parts[0].result.layouts) {
    double reference_m = 0;
    for (const std::vector<CollisionVerdict>& of_frame : single.verdicts) {
      const std::size_t at = std::size_t(std::lround((layout.spacing_m - spacings_m[0]) / step_m));
      if (of_frame[at] != CollisionVerdict::colliding) continue;
      double nearest_m = HUGE_VAL;
      for (std::size_t i = 0; i < of_frame.size(); ++i)
        if (of_frame[i] == CollisionVerdict::free)
          nearest_m = std::min(nearest_m, std::abs(spacings_m[i] - layout.spacing_m));
      reference_m = std::max(reference_m, nearest_m);
    }
    const Bracket& penetration = layout.penetration;
    EXPECT_LE(penetration.min_m, reference_m + step_m) << layout.spacing_m;
    EXPECT_GE(penetration.max_m, reference_m - 2 * step_m) << layout.spacing_m;
    if (std::isinf(reference_m)) continue;
    widest_m = std::max(widest_m, penetration.max_m - penetration.min_m);
  }
  fmt::print("penetration: brackets of at most {:.2f} mm\n", 1e3 * widest_m);
  EXPECT_LE(widest_m, kMaxBracket_m);
}

// The frame with the smallest clearance is measured again, by the exact reference, and so are
// frames drawn by a seed, none of which may be nearer.
TEST_F(WhatIfSpeed, ClearanceContainsTheReference) {
  const collision::MovablePart moved = part();
  const config::Deployment& deployment = recorded().session.deployment;
  std::vector<const study::LayoutResult*> measured;
  double widest_m = 0;
  for (const study::LayoutResult& layout : distances().found.parts[0].result.layouts) {
    if (layout.clearance.max_m == 0 || std::isinf(layout.clearance.max_m)) continue;
    measured.push_back(&layout);
    widest_m = std::max(widest_m, layout.clearance.max_m - layout.clearance.min_m);
  }
  fmt::print("clearance: {} brackets of at most {:.2f} mm\n", measured.size(), 1e3 * widest_m);
  ASSERT_FALSE(measured.empty());
  EXPECT_LE(widest_m, kMaxBracket_m);
  std::mt19937 random(19);
  int below_cap = 0;
  for (std::size_t i = 0; i < measured.size();
       i += (measured.size() + references() - 1) / references()) {
    const auto start = std::chrono::steady_clock::now();
    const study::LayoutResult& layout = *measured[i];
    std::vector<double> nearest_m(recorded().maps.different.size(), HUGE_VAL);
    test_pool().run(int(nearest_m.size()), [&](int index, int) {
      base::WorkerPool one(1);
      hull::CpuHull hull(one);
      hull.assign(recorded().maps.different[std::size_t(index)], deployment.hull_rule);
      const hull::HullQuery query(hull);
      if (hull.empty()) return;
      nearest_m[std::size_t(index)] =
          collision::HullProximity(query, {kCap_m, 1e-3})
              .of_part(moved.tree(), moved.pose(layout.spacing_m), layout.clearance.max_m + 1e-3)
              .min_m;
    });
    const std::size_t nearest =
        std::size_t(std::ranges::min_element(nearest_m) - nearest_m.begin());
    const Bracket reference =
        reference_clearance_m(recorded().maps.different[nearest], moved, layout.spacing_m, kCap_m);
    fmt::print("  at {:.1f} cm: {:.2f} to {:.2f} mm, reference {:.2f} to {:.2f} mm ({:.1f} s)\n",
               100 * layout.spacing_m, 1e3 * layout.clearance.min_m, 1e3 * layout.clearance.max_m,
               1e3 * reference.min_m, 1e3 * reference.max_m, seconds_since(start));
    EXPECT_LT(reference.max_m, kCap_m);
    EXPECT_LE(layout.clearance.min_m, reference.max_m);
    EXPECT_GE(layout.clearance.max_m, reference.min_m);
    for (int k = 0; k < random_frames(); ++k) {
      const std::size_t frame = random() % recorded().maps.different.size();
      const Bracket of_frame =
          reference_clearance_m(recorded().maps.different[frame], moved, layout.spacing_m, kCap_m);
      EXPECT_LE(layout.clearance.min_m, of_frame.max_m) << "frame " << frame;
      below_cap += of_frame.max_m < kCap_m;
    }
  }
  EXPECT_GT(below_cap, 0) << "no frame drawn by the seed is near the part";
}

}  // namespace
}  // namespace fivepipe::test
