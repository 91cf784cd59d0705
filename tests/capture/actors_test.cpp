// The real objects that synthetic cameras see: their parts, paths and periods.
#include <array>
#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <map>

#include "tests/support/capture/capture_rig.h"

namespace fivepipe::capture {
namespace {

using test::capsule_of;

TEST(SyntheticWorld, RepeatsExactlyWithItsPeriod) {
  config::SyntheticWorld world;
  world.period_s = 4.0;
  for (int i = 0; i < 64; ++i) {  // multiples of 1/16 s, so that adding the period is exact
    const auto one = test::synthetic_object(world, i / 16.0),
               later = test::synthetic_object(world, i / 16.0 + 12.0);
    ASSERT_EQ(one.size(), later.size());
    for (std::size_t k = 0; k < one.size(); ++k) {
      EXPECT_EQ(one[k].a_world_m, later[k].a_world_m);
      EXPECT_EQ(one[k].b_world_m, later[k].b_world_m);
    }
  }
}

TEST(SyntheticWorld, MovesAtMost1500MmPerSecondInsideItsBox) {
  const config::SyntheticWorld world;
  Eigen::AlignedBox3d reached;
  std::vector<hull::Capsule> before = test::synthetic_object(world, 0);
  for (int i = 0; i <= 400; ++i) {
    const std::vector<hull::Capsule> object = test::synthetic_object(world, 0.01 * i);
    for (std::size_t k = 0; k < object.size(); ++k) {
      EXPECT_GT(std::min(object[k].a_world_m.z(), object[k].b_world_m.z()) - object[k].radius_m,
                0.0)
          << "the part intersects the table";
      // The palm moves at most 2 pi (0.25, 0.15, 2 x 0.14) m / 4 s and also rotates; 1.5 m/s bounds
      // both.
      EXPECT_LT((object[k].a_world_m - before[k].a_world_m).norm(), 0.015);
    }
    before = object;
    reached.extend(0.5 * (object[0].a_world_m + object[0].b_world_m));
  }
  EXPECT_NEAR(reached.max().x(), 0.25, 0.04);
  EXPECT_NEAR(reached.min().x(), -0.25, 0.04);
  EXPECT_NEAR(reached.max().y(), 0.20, 0.02);
  EXPECT_NEAR(reached.min().z(), 0.12, 0.03);
  EXPECT_NEAR(reached.max().z(), 0.40, 0.03);
}

TEST(SyntheticWorld, TwoHandsReachInPartAndReturn) {
  config::SyntheticWorld world;
  world.actor = config::SyntheticActor::parting_hands;
  const std::size_t hand = synthetic_parts(world, 0).size() / 2;
  double nearest_m = 1, farthest_m = 0, deepest_m = -1;
  for (double t_s = 0; t_s < world.period_s; t_s += 0.01) {
    const std::vector<SyntheticPart> parts = synthetic_parts(world, t_s);
    ASSERT_EQ(parts.size(), 2 * hand);
    for (std::size_t i = 0; i < hand; ++i) {
      const hull::Capsule &right = capsule_of(parts[i]), &left = capsule_of(parts[hand + i]);
      EXPECT_EQ(left.a_world_m, right.a_world_m.cwiseProduct(Eigen::Vector3d(-1, 1, 1)));
      EXPECT_EQ(left.b_world_m, right.b_world_m.cwiseProduct(Eigen::Vector3d(-1, 1, 1)));
      EXPECT_EQ(left.radius_m, right.radius_m);
      deepest_m = std::max(deepest_m, right.b_world_m.y());
    }
    nearest_m = std::min(nearest_m, capsule_of(parts[0]).a_world_m.x());
    farthest_m = std::max(farthest_m, capsule_of(parts[0]).a_world_m.x());
    const std::vector<SyntheticPart> next = synthetic_parts(world, t_s + 0.001);
    for (std::size_t i = 0; i < parts.size(); ++i)
      EXPECT_LT((capsule_of(next[i]).a_world_m - capsule_of(parts[i]).a_world_m).norm(), 1.5e-3)
          << "a part jumps, or is faster than 1.5 m/s";
  }
  EXPECT_NEAR(nearest_m, 0.022, 0.002);
  EXPECT_NEAR(farthest_m, 0.215, 0.002);
  EXPECT_NEAR(deepest_m, 0.144, 0.002);  // the middle fingers' tips, beyond the curtain at 0.06
  EXPECT_EQ(capsule_of(synthetic_parts(world, 1.0)[0]).a_world_m,
            capsule_of(synthetic_parts(world, 1.0 + 2 * world.period_s)[0]).a_world_m);
}

// A point that moves with each part.
Eigen::Vector3d place_of(const SyntheticPart& part) {
  if (const auto* capsule = std::get_if<hull::Capsule>(&part.shape)) return capsule->a_world_m;
  return std::get<geometry::OrientedBox>(part.shape).world_from_box.translation();
}

double lowest_m(const SyntheticPart& part) {
  if (const auto* capsule = std::get_if<hull::Capsule>(&part.shape))
    return std::min(capsule->a_world_m.z(), capsule->b_world_m.z()) - capsule->radius_m;
  const auto& box = std::get<geometry::OrientedBox>(part.shape);
  return box.world_from_box.translation().z() -
         box.world_from_box.linear().row(2).cwiseAbs().dot(box.half_m);
}

// Returns the largest speed of a part [m/s].
double check_motion(const config::SyntheticWorld& world) {
  double fastest_m_s = 0;
  const std::size_t count = synthetic_parts(world, 0).size();
  for (double t_s = 0; t_s < world.period_s; t_s += 0.005) {
    const std::vector<SyntheticPart> parts = synthetic_parts(world, t_s),
                                     next = synthetic_parts(world, t_s + 0.001);
    EXPECT_EQ(parts.size(), count);
    for (std::size_t i = 0; i < parts.size(); ++i) {
      fastest_m_s = std::max(fastest_m_s, (place_of(next[i]) - place_of(parts[i])).norm() / 0.001);
      EXPECT_GE(lowest_m(parts[i]), -1e-12) << "part " << i << " is in the table at " << t_s;
    }
  }
  return fastest_m_s;
}

TEST(SyntheticWorld, AHandThrowsUpWhatLiesOnItsTray) {
  config::SyntheticWorld world;
  world.actor = config::SyntheticActor::hand_with_tray;
  world.period_s = 8;
  EXPECT_NEAR(check_motion(world), 1.4, 0.01);
  const auto parts = synthetic_parts(world, 0), thrown = synthetic_parts(world, 4.15);
  EXPECT_EQ(place_of(parts[0]), place_of(thrown[0])) << "the blocks stand";
  EXPECT_EQ(place_of(parts[1]), place_of(thrown[1])) << "the blocks stand";
  EXPECT_NEAR(lowest_m(parts[0]), 0, 1e-12);
  EXPECT_NEAR(lowest_m(parts[1]), 0, 1e-12);
  EXPECT_NEAR(place_of(thrown[2]).z() - place_of(parts[2]).z(), 0.09, 0.001);
  // No part of the hand is above the tray, where the objects lie.
  const auto& tray = std::get<geometry::OrientedBox>(parts[2].shape);
  for (std::size_t i = 3; i < parts.size(); ++i) {
    const hull::Capsule& part = capsule_of(parts[i]);
    for (const Eigen::Vector3d& end : {part.a_world_m, part.b_world_m})
      if ((end - place_of(parts[2])).head<2>().cwiseAbs().maxCoeff() < tray.half_m.x()) {
        EXPECT_LE(end.z() + part.radius_m, place_of(parts[2]).z());
      }
  }
}

TEST(SyntheticWorld, AHandPushesAndReturns) {
  config::SyntheticWorld world;
  world.actor = config::SyntheticActor::pushing_hand;
  EXPECT_NEAR(check_motion(world), 0.565, 0.005);  // on its return, with a period of 4 s
  double nearest_m = 1, farthest_m = -1;
  for (double t_s = 0; t_s < world.period_s; t_s += 0.01)
    for (const SyntheticPart& part : synthetic_parts(world, t_s))
      if (part.material == Material::skin) {
        nearest_m = std::min(nearest_m, place_of(part).y());
        farthest_m = std::max(farthest_m, place_of(part).y());
      }
  EXPECT_NEAR(farthest_m, 0.166, 0.003);  // the thumb
  EXPECT_NEAR(nearest_m, -0.15, 0.001);
}

TEST(SyntheticWorld, AHandCatchesAndThrows) {
  config::SyntheticWorld world;
  world.actor = config::SyntheticActor::catching_hand;
  world.period_s = 8;
  EXPECT_NEAR(check_motion(world), 1.1, 0.02);
  // The fingers and the palm are below the spout, then beside it.
  const auto over_center = [&](double t_s) {
    const std::vector<SyntheticPart> parts = synthetic_parts(world, t_s);
    return std::any_of(parts.begin(), parts.end(), [](const SyntheticPart& part) {
      return part.material == Material::skin && place_of(part).head<2>().norm() < 0.06;
    });
  };
  EXPECT_FALSE(over_center(0));
  EXPECT_TRUE(over_center(3));
  EXPECT_TRUE(over_center(4.4));
  EXPECT_FALSE(over_center(7));
}

config::SyntheticWorld world_of(config::SyntheticActor actor, double period_s) {
  config::SyntheticWorld world;
  world.actor = actor;
  world.period_s = period_s;
  return world;
}

Eigen::AlignedBox3d bounds_of(const config::SyntheticWorld& world, double t_s, Material material) {
  Eigen::AlignedBox3d bounds_m;
  for (const SyntheticPart& part : synthetic_parts(world, t_s))
    if (part.material == material)
      for (const Eigen::Vector3d& end : {capsule_of(part).a_world_m, capsule_of(part).b_world_m}) {
        const Eigen::Vector3d radius_m = Eigen::Vector3d::Constant(capsule_of(part).radius_m);
        bounds_m.extend(end - radius_m).extend(end + radius_m);
      }
  return bounds_m;
}

TEST(SyntheticWorld, ThePipeTaskScrewsThePipeInAndPlugsTheCord) {
  config::SyntheticWorld world = world_of(config::SyntheticActor::pipe_task, 33);
  for (const config::SyntheticTool tool :
       {config::SyntheticTool::none, config::SyntheticTool::tongs}) {
    world.tool = tool;
    EXPECT_LT(check_motion(world), 1.1);  // m/s
    // The pipe of the paper, 14 cm long and 4 cm wide, between the payloads.
    const Eigen::AlignedBox3d carried = bounds_of(world, 2.6, Material::pipe),
                              screwed_in = bounds_of(world, 9.5, Material::pipe);
    EXPECT_NEAR(carried.sizes().z(), 0.14, 1e-12);
    EXPECT_NEAR(carried.sizes().x(), 0.04, 1e-12);
    EXPECT_NEAR(carried.min().z(), 0.17, 1e-12);
    EXPECT_NEAR(screwed_in.min().z(), 0.02, 1e-12);
    EXPECT_NEAR(screwed_in.center().head<2>().norm(), 0, 1e-9);
    // The lower end of the plug is in the outlet; the second half of the period undoes the task.
    const auto plug_m = [&](double t_s) {
      std::vector<SyntheticPart> parts = synthetic_parts(world, t_s);
      const auto last = std::find_if(parts.rbegin(), parts.rend(), [](const SyntheticPart& part) {
        return part.material == Material::connector;
      });
      return Eigen::Vector3d(capsule_of(*last).a_world_m - Eigen::Vector3d(0, 0, 0.008));
    };
    EXPECT_NEAR((plug_m(16) - Eigen::Vector3d(0, 0, 0.035)).norm(), 0, 1e-12);
    EXPECT_NEAR((plug_m(1) - Eigen::Vector3d(0.36, -0.12, 0.04)).norm(), 0, 1e-12);
    EXPECT_NEAR((plug_m(13) - plug_m(20)).norm(), 0, 1e-12);
  }
  EXPECT_TRUE(
      bounds_of(world_of(config::SyntheticActor::pipe_task, 33), 1, Material::tongs).isEmpty());
  EXPECT_NEAR(bounds_of(world, 13.1, Material::tongs).max().z(), 0.16 + 0.225, 1e-12);
}

// The skin's extent, from the wrist to the fingertips, of a straight hand.
TEST(SyntheticWorld, AHandHasItsLength) {
  for (const double length_m : {0.165, 0.19, 0.21}) {
    config::SyntheticWorld world = world_of(config::SyntheticActor::reaching_and_leaning, 8);
    world.hand_length_m = length_m;
    // The leaning hand, which points along y, and its wrist.
    double front_m = -1, wrist_m = 1;
    for (const SyntheticPart& part : synthetic_parts(world, 0)) {
      const hull::Capsule& c = capsule_of(part);
      if (part.material != Material::skin || c.a_world_m.x() < 0.2) continue;
      front_m = std::max(front_m, c.b_world_m.y() + c.radius_m);
      if (c.radius_m < 0.02 * length_m / 0.19)  // not the forearm
        wrist_m = std::min({wrist_m, c.a_world_m.y() - c.radius_m, c.b_world_m.y() - c.radius_m});
    }
    EXPECT_NEAR((front_m - wrist_m) / length_m, 1, 0.03) << length_m;
  }
}

TEST(SyntheticWorld, AnArmReachesAsFarAsItIsLong) {
  std::map<double, double> deepest_m;
  for (const double length_m : {0.165, 0.19, 0.21}) {
    config::SyntheticWorld world = world_of(config::SyntheticActor::reaching_arm, 8);
    world.hand_length_m = length_m;
    EXPECT_LT(check_motion(world), 0.4);  // m/s
    deepest_m[length_m] = bounds_of(world, 4, Material::skin).max().y();
    EXPECT_LT(bounds_of(world, 0, Material::skin).max().y(), -0.15);
    EXPECT_EQ(bounds_of(world, 4, Material::skin).min(),
              bounds_of(world, 4.5, Material::skin).min());
    // The leaning hand does not change the reaching one.
    const std::size_t reaching = synthetic_parts(world, 3).size();
    config::SyntheticWorld leaning = world;
    leaning.actor = config::SyntheticActor::reaching_and_leaning;
    const auto both = synthetic_parts(leaning, 3), one = synthetic_parts(world, 3);
    ASSERT_EQ(both.size(), 2 * reaching);
    for (std::size_t i = 0; i < reaching; ++i) EXPECT_EQ(place_of(both[i]), place_of(one[i]));
  }
  EXPECT_LT(deepest_m[0.165] + 0.05, deepest_m[0.19]);
  EXPECT_NEAR(deepest_m[0.19], deepest_m[0.21], 0.005) << "both reach the filter";
}

TEST(SyntheticWorld, HasThePipeOfThePaper) {
  for (const SyntheticPart& part : synthetic_parts({}, 1.3))
    if (part.material == Material::pipe) {
      EXPECT_NEAR((capsule_of(part).a_world_m - capsule_of(part).b_world_m).norm() +
                      2 * capsule_of(part).radius_m,
                  0.14, 1e-12);
      EXPECT_DOUBLE_EQ(capsule_of(part).radius_m, 0.02);
    }
}

// Every part at two times, for two seeds: the material, the ends and the radius.
TEST(SyntheticWorld, HasThePartsOfTheGoldenFile) {
  constexpr double kRounding_m = 1e-9;  // of libm, and of the file's 12 decimals
  const std::string file = FIVEPIPE_SOURCE_DIR "/tests/golden/synthetic_parts.txt";
  std::vector<std::array<double, 8>> found;
  for (const auto& [seed, t_s] : {std::pair{1u, 0.4}, {2u, 7.1}}) {
    config::SyntheticWorld world;
    world.seed = seed;
    for (const SyntheticPart& part : synthetic_parts(world, t_s)) {
      const Eigen::Vector3d &a = capsule_of(part).a_world_m, &b = capsule_of(part).b_world_m;
      found.push_back({double(part.material), a.x(), a.y(), a.z(), b.x(), b.y(), b.z(),
                       capsule_of(part).radius_m});
    }
  }
  if (std::getenv("FIVEPIPE_WRITE_GOLDEN")) {
    std::ofstream golden(file);
    golden << std::fixed << std::setprecision(12);
    for (const auto& row : found)
      for (std::size_t i = 0; i < row.size(); ++i) golden << row[i] << (i < 7 ? ' ' : '\n');
  }
  std::ifstream golden(file);
  for (std::size_t row = 0; row < found.size(); ++row)
    for (std::size_t i = 0; i < 8; ++i) {
      double expected = NAN;
      golden >> expected;
      EXPECT_NEAR(found[row][i], expected, kRounding_m) << "part " << row << ", number " << i;
    }
  std::string more;
  EXPECT_FALSE(golden >> more) << "parts are missing";
}

}  // namespace
}  // namespace fivepipe::capture
