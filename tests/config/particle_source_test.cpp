// Sources of particles in scene files.
#include "common/config/scene.h"
#include "tests/support/scene_files.h"

namespace fivepipe::config {
namespace {

using ::testing::ElementsAre;

class ParticleSources : public test::SceneFiles {
 protected:
  Scene load(const std::string& particles) {
    return test::load_scene(write("scene.yaml", R"(name: rain
objects:
  - {name: floor, box: {size_m: [1, 1, 1]}, position_m: [0, 0, 0]}
particles:
)" + particles));
  }
};

TEST_F(ParticleSources, ReadsEveryKey) {
  const Scene scene = load(R"(  - name: grains
    from_m: [1, 2, 3]
    to_m: [0, 4, 3]
    velocity_m_s: [0.1, -0.2, 0.3]
    spread_m_s: 0.4
    rate_hz: 500
    lifetime_s: 6
    drag_1_s: 0.7
    radius_m: 0.008
    restitution: 0.9
    friction: 1.1
    colour_rgb: [0.1, 0.2, 0.3]
  - {name: drops, from_m: [0, 0, 0], to_m: [0, 0, 0], rate_hz: 1, lifetime_s: 1}
)");
  ASSERT_EQ(scene.particles.size(), 2u);
  const ParticleSource &grains = scene.particles[0], &drops = scene.particles[1];
  EXPECT_EQ(grains.name, "grains");
  EXPECT_EQ(grains.from_world_m.min(), Eigen::Vector3d(0, 2, 3));
  EXPECT_EQ(grains.from_world_m.max(), Eigen::Vector3d(1, 4, 3));
  EXPECT_EQ(grains.velocity_world_m_s, Eigen::Vector3d(0.1, -0.2, 0.3));
  EXPECT_EQ(grains.spread_m_s, 0.4);
  EXPECT_EQ(grains.rate_hz, 500);
  EXPECT_EQ(grains.lifetime_s, 6);
  EXPECT_EQ(grains.drag_1_s, 0.7);
  EXPECT_EQ(grains.radius_m, 0.008);
  EXPECT_EQ(grains.restitution, 0.9);
  EXPECT_EQ(grains.friction, 1.1);
  EXPECT_EQ(grains.colour_rgb, (std::array{0.1, 0.2, 0.3}));
  EXPECT_EQ(drops.velocity_world_m_s, Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(drops.spread_m_s, 0);
  EXPECT_EQ(drops.drag_1_s, 0.1);
  EXPECT_EQ(drops.radius_m, 0.003);
  EXPECT_EQ(drops.restitution, 0.3);
  EXPECT_EQ(drops.friction, 0.4);
}

TEST_F(ParticleSources, AreRefusedWithFileLineAndValue) {
  const auto problems = problems_of([&] {
    load(R"(  - {name: floor, from_m: [0, 0, 0], to_m: [0, 0, 0], rate_hz: 1, lifetime_s: 1}
  - {name: a, from_m: [0, 0, 0], to_m: [0, 0, 0], rate_hz: 1e5, lifetime_s: 3}
  - {name: b, from_m: [0, 0, .nan], to_m: [0, 0, 0], rate_hz: 1, lifetime_s: 1}
  - {name: c, from_m: [0, 0, 0], to_m: [0, 0, 0], rate_hz: 0, lifetime_s: 1, radius_m: 0.02}
  - {name: d, from_m: [0, 0, 0], to_m: [0, 0, 0], rate: 1, lifetime_s: 1}
)");
  });
  EXPECT_THAT(
      problems,
      ElementsAre(
          "scene.yaml:5:12: source name floor is already used in line 3",
          "scene.yaml:6:60: rate_hz x lifetime_s is 300000 particles, at most 200000 are possible: "
          "decrease one of them",
          "scene.yaml:7:30: from_m[2] must be finite, is .nan",
          "scene.yaml:8:60: rate_hz must be greater than 0 and at most 1000000, is 0",
          "scene.yaml:8:88: radius_m must be greater than 0 and at most 0.016, is 0.02",
          "scene.yaml:9:51: unknown key rate: use rate_hz"));
}

}  // namespace
}  // namespace fivepipe::config
