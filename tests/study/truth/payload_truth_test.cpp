// The spacing study against ground truth: sessions of the deployments payload and engine, whose
// free spacings follow from the actors' geometry and from the exact cones of their silhouettes.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/study/truth/session.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;
using Settings = std::map<std::string, std::string>;

constexpr double kRounding_m = 1e-9;
// Of the end of the exact cones' hull: kConeTolerance_m, or more if the hull ends in a thin wedge.
constexpr double kMaxConeError_m = 0.5e-3;
// Of the criterion.
constexpr double kMaxFootprints = 2;

struct Result {
  double true_m, hull_m, studied_m, footprint_m;  // least free spacings
  // What is neither the task nor the hull of the exact cones.
  double else_m() const { return studied_m - hull_m; }
};

void expect_within_criterion(const Result& r, const std::string& what) {
  SCOPED_TRACE(
      fmt::format("{}: true {:.2f} cm, hull {:.2f} cm, study {:.2f} cm, footprint {:.2f} mm", what,
                  100 * r.true_m, 100 * r.hull_m, 100 * r.studied_m, 1000 * r.footprint_m));
  // The exact cones contain the objects.
  EXPECT_GE(r.hull_m, r.true_m - kConeTolerance_m);
  EXPECT_LE(std::abs(r.else_m()), kMaxFootprints * r.footprint_m);
  EXPECT_GE(r.studied_m, r.true_m - kMaxFootprints * r.footprint_m) << "unsafe";
}

struct Sessions {
  Session session;
  std::vector<double> times_s;
  double true_m;
  HullEnd hull;

  Sessions(Session s, int step, int critical)
      : session(std::move(s)), times_s(session_times(session, step, critical)) {
    const std::vector<SpacingInterval> free = truly_free(session, times_s);
    true_m = free.back().low_m;
    hull = hull_end_below(session, times_s, free.back().high_m);
    EXPECT_LE(hull.error_m, kMaxConeError_m);
  }

  Result studied(const std::vector<std::vector<hull::Silhouette>>& maps) const {
    const std::vector<SpacingInterval> free = studied_free(session, maps);
    return {true_m, hull.gap_m, free.empty() ? 1.0 : free.back().low_m,
            footprint_m(session, hull.at_world_m)};
  }
};

double least_free_m(const Session& session) {
  return truly_free(session, session_times(session, 1, 0)).back().low_m;
}

// The pipe is 14 cm long and passes 1 cm above the PMT box. By hand, the fingertips hold the cord
// 5 cm above the box, and the wrist is above them; the wrist of a large hand needs more than the
// pipe. The plug in the tongs passes 0.5 cm above the box, and the tongs end 22 cm above its lower
// end; the thumb around them is higher, if the hand is not small.
TEST(PayloadTruth, TheTaskNeedsTheSpacingOfItsGeometry) {
  for (const char* hand : {"0.165", "0.19", "0.21"}) {
    const double scale = std::stod(hand) / 0.19;
    const double wrist_m = 0.05 + (0.075 + 0.026) * scale,
                 thumb_m = 0.005 + 0.17 + (0.040 + 0.0105) * scale;
    EXPECT_NEAR(least_free_m(payload_session({{"hand_length_m", hand}})), std::max(0.15, wrist_m),
                kRounding_m)
        << hand;
    EXPECT_NEAR(least_free_m(payload_session({{"hand_length_m", hand}, {"tool", "tongs"}})),
                std::max(0.225, thumb_m), kRounding_m)
        << hand;
  }
}

// Distance from the PMT box with its shaft; negative inside.
double clearance_from_pmt_m(const Vector3d& p) {
  constexpr double kHalf_m = 0.13, kTop_m = 0.16, kShaft_m = 0.060;
  const double beside_m = p.head<2>().cwiseAbs().maxCoeff() - kHalf_m, above_m = p.z() - kTop_m,
               in_shaft_m = kShaft_m - p.head<2>().norm();
  if (in_shaft_m > 0) return std::hypot(in_shaft_m, std::max(0.0, above_m));
  const double outside_m = std::hypot(std::max(0.0, beside_m), std::max(0.0, above_m));
  return outside_m > 0 ? outside_m : -std::min({-beside_m, -above_m, -in_shaft_m});
}

// The person, the pipe, the cord and the tongs do not pass through the virtual PMT box and payload
// B, and the hand not through the real connector.
TEST(PayloadTruth, RealObjectsKeepOutOfTheOtherParts) {
  const Eigen::AlignedBox3d payload_b(Vector3d(-0.36, -0.15, 0), Vector3d(-0.20, 0.15, 0.36)),
      connector(Vector3d(-0.034, -0.034, 0), Vector3d(0.034, 0.034, 0.04));
  for (const char* tool : {"none", "tongs"})
    for (const char* hand : {"0.165", "0.19", "0.21"}) {
      const Session session = payload_session({{"tool", tool}, {"hand_length_m", hand}});
      for (const double t_s : session_times(session, 2, 0))
        for (const capture::SyntheticPart& part : session.parts_at(t_s)) {
          const auto* capsule = std::get_if<hull::Capsule>(&part.shape);
          if (capsule == nullptr) continue;
          for (int i = 0; i <= 10; ++i) {
            const Vector3d p =
                capsule->a_world_m + 0.1 * i * (capsule->b_world_m - capsule->a_world_m);
            const auto where = [&] {
              return fmt::format("{} {} at {} s: {} {} {} mm, radius {} mm, material {}", tool,
                                 hand, t_s, 1000 * p.x(), 1000 * p.y(), 1000 * p.z(),
                                 1000 * capsule->radius_m, int(part.material));
            };
            ASSERT_GT(clearance_from_pmt_m(p), capsule->radius_m - 1e-9) << where();
            ASSERT_GT(payload_b.exteriorDistance(p), capsule->radius_m) << where();
            if (part.material == capture::Material::skin) {
              ASSERT_GT(connector.exteriorDistance(p), capsule->radius_m) << where();
            }
          }
        }
    }
}

// No place of the part is outside of an image, where there is no hull.
TEST(PayloadTruth, EachCameraSeesThePartAtAllSpacings) {
  for (const char* rig : {"table3", "table4", "table8"})
    for (const Session& session : {payload_session({{"rig", rig}}), engine_session({{"rig", rig}})})
      for (const geometry::Camera& camera : session.cameras)
        for (const double moved_m : {session.moved_range.low_m, session.moved_range.high_m})
          for (int corner = 0; corner < 8; ++corner) {
            const Vector3d p =
                session.box.world_from_box *
                (session.box.half_m.cwiseProduct(
                     Vector3d(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1)) +
                 Vector3d(0, 0, moved_m));
            const auto uv_px = geometry::project(camera, p);
            ASSERT_TRUE(uv_px);
            EXPECT_TRUE(uv_px->x() > 0 && uv_px->x() < camera.pinhole.width_px - 1 &&
                        uv_px->y() > 0 && uv_px->y() < camera.pinhole.height_px - 1)
                << rig << ' ' << uv_px->transpose();
          }
}

TEST(PayloadTruth, TheStudyFindsTheHullOfTheExactCones) {
  for (const char* tool : {"none", "tongs"}) {
    const Sessions s(payload_session({{"tool", tool}}), 0, 4);
    const Result result = s.studied(exact_maps(s.session, s.times_s));
    expect_within_criterion(result, tool);
  }
}

// A flexible cord with tongs needs 7.45 cm more than a stiff one by hand. The excess of both hulls
// is at most a footprint, and so is what else the study adds.
TEST(PayloadTruth, TongsNeedMoreThanAHandByWhatTheGeometryDemands) {
  const auto result_of = [](const char* tool) {
    const Sessions s(payload_session({{"tool", tool}}), 0, 4);
    return s.studied(exact_maps(s.session, s.times_s));
  };
  const Result hand = result_of("none"), tongs = result_of("tongs");
  const double true_m = tongs.true_m - hand.true_m, studied_m = tongs.studied_m - hand.studied_m;
  fmt::print(
      "tongs need {:.2f} cm more than a hand, by the study {:.2f} cm; a footprint is {:.2f} "
      "mm\n",
      100 * true_m, 100 * studied_m, 1e3 * hand.footprint_m);
  EXPECT_NEAR(true_m, 0.0745, 0.001);
  EXPECT_NEAR(studied_m, true_m, kMaxFootprints * std::min(hand.footprint_m, tongs.footprint_m));
}

// The rule of the deployment limits the hull to the rig's volume, and so does the study.
TEST(PayloadTruth, TheSpacingStudyAppliesTheHullRuleOfTheDeployment) {
  for (Session session : {payload_session({}), engine_session({})}) {
    const hull::HullRule& rule = session.deployment.hull_rule;
    EXPECT_EQ(rule.limits, hull::Limits::all) << "as the cones";
    ASSERT_TRUE(rule.is_bounded());
    EXPECT_TRUE(rule.within_world_m.isApprox(session.deployment.rig.volume_m));
    const std::vector<double> times_s = session_times(session, 0, 1);
    const auto maps = exact_maps(session, times_s);
    const std::vector<SpacingInterval> free = studied_free(session, maps);
    EXPECT_GT(free.back().low_m, session.gap_of(session.moved_range.low_m)) << "it collides";
    // In a volume without the person, there is no hull.
    const Vector3d far_m(5, 5, 5);
    session.deployment.hull_rule.within_world_m = {far_m, far_m + Vector3d::Ones()};
    EXPECT_EQ(studied_free(session, maps).front().low_m, session.gap_of(session.moved_range.low_m));
  }
}

TEST(PayloadTruth, TheStudyFindsItOnMapsWithNoise) {
  const Sessions s(payload_session({{"tool", "tongs"}}), 0, 2);
  expect_within_criterion(s.studied(segmented_maps(s.session, s.times_s, 2)), "noise 2");
}

// The other arm is behind the battery: there is a free interval between both arms, and one beyond
// both. Bisection between 5 and 60 cm would find only one of them.
TEST(PayloadTruth, AnArmBehindThePartLimitsItFromBehind) {
  const Session session = engine_session({{"actor", "reaching_and_leaning"}});
  const std::vector<double> times_s{0, 3, 4};
  const std::vector<SpacingInterval> truth = truly_free(session, times_s);
  ASSERT_EQ(truth.size(), 2u);
  const std::vector<SpacingInterval> studied = studied_free(session, exact_maps(session, times_s));
  ASSERT_EQ(studied.size(), 2u);
  const double between_m = 0.5 * (truth[0].low_m + truth[0].high_m);
  const HullEnd before = hull_end_below(session, times_s, between_m),
                behind = hull_end_above(session, times_s, between_m),
                beyond = hull_end_below(session, times_s, truth[1].high_m);
  const struct {
    const char* what;
    double true_m, studied_m;
    HullEnd end;
    double towards_free;
  } ends[] = {{"before", truth[0].low_m, studied[0].low_m, before, 1},
              {"behind", truth[0].high_m, studied[0].high_m, behind, -1},
              {"beyond", truth[1].low_m, studied[1].low_m, beyond, 1}};
  for (const auto& end : ends) {
    SCOPED_TRACE(fmt::format("{}: true {:.2f} cm, hull {:.2f} cm, study {:.2f} cm", end.what,
                             100 * end.true_m, 100 * end.end.gap_m, 100 * end.studied_m));
    const double footprint = footprint_m(session, end.end.at_world_m);
    EXPECT_LE(end.end.error_m, kMaxConeError_m);
    EXPECT_GE(end.towards_free * (end.end.gap_m - end.true_m), -kConeTolerance_m);
    EXPECT_LE(std::abs(end.studied_m - end.end.gap_m), kMaxFootprints * footprint);
    EXPECT_GE(end.towards_free * (end.studied_m - end.true_m), -kMaxFootprints * footprint);
  }
}

// A short arm does not reach the filter; a long one does, and needs more space.
TEST(EngineTruth, ALongArmReachesTheFilterAndNeedsMoreSpace) {
  const Eigen::AlignedBox3d filter(Vector3d(-0.016, 0.072, 0.04), Vector3d(0.060, 0.148, 0.14));
  std::map<std::string, double> spacing_m;
  for (const auto& [hand, reaches] : {std::pair{"0.165", false}, {"0.19", true}, {"0.21", true}}) {
    const Session session = engine_session({{"hand_length_m", hand}});
    bool reached = false;
    for (const capture::SyntheticPart& part : session.parts_at(0.5 * session.world.period_s)) {
      const auto& capsule = std::get<hull::Capsule>(part.shape);
      reached = reached || filter.exteriorDistance(capsule.b_world_m) < capsule.radius_m;
    }
    EXPECT_EQ(reached, reaches) << hand;
    spacing_m[hand] = least_free_m(session);
  }
  EXPECT_LT(spacing_m["0.165"] + 0.005, spacing_m["0.19"]);
  EXPECT_LT(spacing_m["0.19"] + 0.003, spacing_m["0.21"]);
}

// Pixels per map in which a map differs from that of the exact silhouettes.
double differing_pixels(const std::vector<std::vector<hull::Silhouette>>& maps,
                        const std::vector<std::vector<hull::Silhouette>>& exact) {
  std::size_t count = 0, differ = 0;
  for (std::size_t frame = 0; frame < maps.size(); ++frame)
    for (std::size_t camera = 0; camera < maps[frame].size(); ++camera, ++count) {
      const hull::ObjectPixels &a = maps[frame][camera].pixels, &b = exact[frame][camera].pixels;
      differ += a.count() + b.count() - 2 * a.count_common(b);
    }
  return double(differ) / double(count);
}

// Prints the table of docs/payload.md.
TEST(PayloadTruth, TableOverHandsToolsCamerasAndNoise) {
  if (!std::getenv("FIVEPIPE_LONG")) GTEST_SKIP() << "set FIVEPIPE_LONG=1";
  fmt::print("{:5} {:>5} {:>7} {:>8} {:>6} {:>9} {:>11} {:>9} {:>8} {:>9}\n", "tool", "hand",
             "cameras", "maps", "wrong", "true, cm", "excess, cm", "study, cm", "else, mm",
             "pixel, mm");
  for (const char* tool : {"none", "tongs"})
    for (const char* hand : {"0.165", "0.19", "0.21"})
      for (const char* rig : {"table3", "table4", "table8"}) {
        const Sessions s(payload_session({{"tool", tool}, {"hand_length_m", hand}, {"rig", rig}}),
                         15, 8);
        const std::vector<std::vector<hull::Silhouette>> exact = exact_maps(s.session, s.times_s);
        const auto row = [&](const std::string& maps_name,
                             const std::vector<std::vector<hull::Silhouette>>& maps) {
          const Result r = s.studied(maps);
          fmt::print(
              "{:5} {:>5} {:>7} {:>8} {:>6.1f} {:>9.2f} {:>11.2f} {:>9.2f} {:>8.2f} {:>9.2f}\n",
              tool, hand, s.session.cameras.size(), maps_name, differing_pixels(maps, exact),
              100 * r.true_m, 100 * (r.hull_m - r.true_m), 100 * r.studied_m, 1000 * r.else_m(),
              1000 * r.footprint_m);
          std::fflush(stdout);
          if (s.session.cameras.size() > 3)
            expect_within_criterion(r, fmt::format("{} {} {} {}", tool, hand, rig, maps_name));
        };
        row("exact", exact);
        for (const int noise : {0, 2, 5, 10})
          row(fmt::format("noise {}", noise), segmented_maps(s.session, s.times_s, noise));
      }
}

}  // namespace
}  // namespace fivepipe::test
