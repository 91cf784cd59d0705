// Contact of a cloth with itself.
#include "sim_node/cloth/cloth_self_contact.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "sim_node/simulation/simulation.h"
#include "tests/support/sim_scene.h"

namespace fivepipe::sim {
namespace {

using Eigen::Vector3d;

constexpr int kSheetColumns = 17, kSheetRows = 6;  // of vertices
constexpr double kLength_m = 0.2, kWidth_m = 0.1, kApart_m = 0.03, kThickness_m = 0.004;

// A sheet that is folded once: a lower layer at z = 0, which is pinned, and an upper one above it.
//
//   z = kApart_m  +------------------
//                 |
//   z = 0         +=================   pinned
//               x = 0            kLength_m
geometry::Mesh folded_sheet() {
  geometry::Mesh mesh;
  for (int column = 0; column < kSheetColumns; ++column)
    for (int row = 0; row < kSheetRows; ++row) {
      const int from_fold = std::abs(column - kSheetColumns / 2);
      const bool is_upper = column > kSheetColumns / 2;
      // The upper layer's vertices are between the lower ones, so that they meet triangles.
      const double x_m = kLength_m * (from_fold - (is_upper ? 0.37 : 0)) / (kSheetColumns / 2);
      mesh.vertices_m.push_back({x_m, kWidth_m * row / (kSheetRows - 1), is_upper ? kApart_m : 0});
    }
  for (int column = 0; column + 1 < kSheetColumns; ++column)
    for (int row = 0; row + 1 < kSheetRows; ++row) {
      const auto a = std::uint32_t(column * kSheetRows + row), b = a + 1, c = a + kSheetRows,
                 d = c + 1;
      mesh.triangles.push_back({a, c, b});
      mesh.triangles.push_back({b, c, d});
    }
  return mesh;
}

config::Scene folded(bool self_collision) {
  config::SceneObject sheet;
  sheet.name = "sheet";
  sheet.shape = config::MeshShape{"", 1, folded_sheet()};
  sheet.motion = config::Motion::cloth;
  sheet.reaction = config::Reaction::none;
  sheet.cloth.emplace();
  sheet.cloth->thickness_m = kThickness_m;
  sheet.cloth->self_collision = self_collision;
  sheet.cloth->pins = {{{Vector3d(-1, -1, -1e-6), Vector3d(1, 1, 1e-6)}}};
  return test::scene_of({sheet});
}

struct Fallen {
  double lowest_m = 1;      // of the upper layer's vertices, in any step
  double lowest_end_m = 1;  // at the end
  double fastest_m_s = 0;   // at the end
  std::uint64_t contacts = 0;
};

Fallen fall(bool self_collision) {
  const config::Scene scene = folded(self_collision);
  ClothObjects cloths(scene);
  CurrentHull hull(scene, {}, true, {});
  Fallen result;
  const auto lowest_m = [&] {
    double z_m = 1;
    for (int v = (kSheetColumns / 2 + 1) * kSheetRows; v < kSheetColumns * kSheetRows; ++v)
      z_m = std::min(z_m, cloths.cloth(0).vertices_world_m()[std::size_t(v)].z());
    return z_m;
  };
  for (int step = 0; step < 2 * 240; ++step) {
    cloths.step(test::kStep_s, 1, hull, 0);
    result.lowest_m = std::min(result.lowest_m, lowest_m());
  }
  result.lowest_end_m = lowest_m();
  for (const Vector3d& v : cloths.cloth(0).velocities_world_m_s())
    result.fastest_m_s = std::max(result.fastest_m_s, v.norm());
  result.contacts = cloths.counters().self_contacts;
  return result;
}

TEST(ClothSelfContact, AFoldedSheetLiesOnItself) {
  const Fallen fallen = fall(true);
  std::printf("upper layer: lowest %.3f mm, at the end %.3f mm, fastest %.4f m/s\n",
              1e3 * fallen.lowest_m, 1e3 * fallen.lowest_end_m, fallen.fastest_m_s);
  EXPECT_GT(fallen.lowest_m, 0);
  EXPECT_NEAR(fallen.lowest_end_m, kThickness_m, 0.1 * kThickness_m);
  EXPECT_LT(fallen.fastest_m_s, 0.02);
  EXPECT_GT(fallen.contacts, 1000u);
}

TEST(ClothSelfContact, WithoutTheKeyItFallsThrough) {
  const Fallen fallen = fall(false);
  EXPECT_LT(fallen.lowest_end_m, -0.05);
  EXPECT_EQ(fallen.contacts, 0u);
}

// Vertices that are nearer to triangles than the thickness at the start keep their distance.
TEST(ClothSelfContact, AThicknessAboveTheMeshSizeDoesNotBlowTheClothUp) {
  config::Scene scene = folded(true);
  scene.gravity_m_s2 = 0;
  scene.objects[0].cloth->thickness_m = 0.05;
  ClothObjects cloths(scene);
  CurrentHull hull(scene, {}, true, {});
  const std::vector<Vector3d> start_m = cloths.cloth(0).vertices_world_m();
  for (int step = 0; step < 60; ++step) cloths.step(test::kStep_s, 1, hull, 0);
  for (std::size_t v = 0; v < start_m.size(); ++v)
    EXPECT_LT((cloths.cloth(0).vertices_world_m()[v] - start_m[v]).norm(), 1e-6) << v;
}

// The upper layer moves farther within a step than the layers are apart.
TEST(ClothSelfContact, AFastVertexStaysOnItsSide) {
  const geometry::Mesh mesh = folded_sheet();
  config::ClothSettings settings = *folded(true).objects[0].cloth;
  Cloth cloth(mesh, Eigen::Isometry3d::Identity(), settings);
  ClothSelfContact self(mesh, cloth.vertices_world_m(), kThickness_m);
  // 60 m/s downwards: 0.25 m per step, and the upper layer is 3 cm above the lower one.
  cloth.step(test::kStep_s, Vector3d(0, 0, -60 / test::kStep_s), {}, 1, 1e9);
  const auto upper = [&] {
    double z_m = 1;
    for (int v = (kSheetColumns - 3) * kSheetRows; v < kSheetColumns * kSheetRows; ++v)
      z_m = std::min(z_m, cloth.vertices_world_m()[std::size_t(v)].z());
    return z_m;
  };
  ASSERT_LT(upper(), 0);
  EXPECT_GT(self.separate(cloth), 0u);
  EXPECT_GT(upper(), 0);
}

// A real ball presses the upper layer through the lower one. When it leaves, each vertex is back on
// its side.
TEST(ClothSelfContact, LayersKeepTheirSidesAfterTheHullHasPressedThemTogether) {
  config::Scene scene = folded(true);
  scene.objects[0].reaction = config::Reaction::yield;
  scene.objects[0].cloth->v_rec_world = Vector3d(0, 0, -1);
  Simulation simulation(scene, {});
  // Of the vertices inside the upper layer: one of its border may slip over that of the lower one.
  const auto lowest_m = [&] {
    const ObjectState state = simulation.states()[0];
    double z_m = 1;
    for (int column = kSheetColumns / 2 + 1; column < kSheetColumns - 1; ++column)
      for (int row = 1; row < kSheetRows - 1; ++row) {
        const auto v = std::size_t(column * kSheetRows + row);
        z_m = std::min(z_m, (state.world_from_object * state.vertices_m[v]).z());
      }
    return z_m;
  };
  double pressed_m = 1;
  for (int frame = 0; frame < 60; ++frame) {
    // Its lower end moves from 20 mm above the lower layer to 10 mm below it, and up again.
    const double z_m = 0.05 + 0.005 + 0.015 * std::cos(2 * M_PI * frame / 60);
    simulation.advance_to(frame * test::kFrame_s, test::seen({test::ball({0.1, 0.05, z_m}, 0.05)}));
    pressed_m = std::min(pressed_m, lowest_m());
  }
  EXPECT_LT(pressed_m, -0.003);
  for (int frame = 60; frame < 90; ++frame)
    simulation.advance_to(frame * test::kFrame_s, test::seen({}));
  EXPECT_GT(lowest_m(), 0);
}

}  // namespace
}  // namespace fivepipe::sim
