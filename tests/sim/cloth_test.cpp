// The motion of a cloth without the hull, and of given contacts.
#include "sim_node/cloth/cloth.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "tests/support/sanitizer.h"

namespace fivepipe::sim {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

const Vector3d kGravity_m_s2(0, 0, -9.80665);
constexpr double kStep_s = 1.0 / 240;
constexpr double kNoLimit_m_s = 1e9;

// Fixes the upper edge of a curtain.
config::ClothPin upper_edge() { return {{Vector3d(-9, -9, -1e-6), Vector3d(9, 9, 1e-6)}}; }

Cloth hanging_curtain(config::ClothSettings settings, int columns = 10, int rows = 12,
                      double fold_depth_m = 0.0) {
  settings.pins = {upper_edge()};
  return Cloth(geometry::curtain_mesh(0.4, 0.6, columns, rows, fold_depth_m, 3),
               Isometry3d::Identity(), settings);
}

void run(Cloth& cloth, double seconds, double step_s = kStep_s,
         const Vector3d& gravity_m_s2 = kGravity_m_s2) {
  for (int i = 0; i < int(std::round(seconds / step_s)); ++i)
    cloth.step(step_s, gravity_m_s2, {}, 1, kNoLimit_m_s);
}

double lowest_m(const Cloth& cloth) {
  double z_m = 0;
  for (const Vector3d& p : cloth.vertices_world_m()) z_m = std::min(z_m, p.z());
  return z_m;
}

double fastest_m_s(const Cloth& cloth) {
  double speed_m_s = 0;
  for (const Vector3d& v : cloth.velocities_world_m_s()) speed_m_s = std::max(speed_m_s, v.norm());
  return speed_m_s;
}

double kinetic_energy_j(const Cloth& cloth) {
  double energy_j = 0;
  for (std::size_t i = 0; i < cloth.velocities_world_m_s().size(); ++i)
    if (const double inverse = cloth.model().vertices[i].inverse_mass_1_kg; inverse > 0)
      energy_j += 0.5 * cloth.velocities_world_m_s()[i].squaredNorm() / inverse;
  return energy_j;
}

double farthest_apart_m(const Cloth& a, const Cloth& b) {
  double distance_m = 0;
  for (std::size_t i = 0; i < a.vertices_world_m().size(); ++i)
    distance_m = std::max(distance_m, (a.vertices_world_m()[i] - b.vertices_world_m()[i]).norm());
  return distance_m;
}

// --- Bending -----------------------------------------------------------------------------------

const std::array<Vector3d, 4> kFlatHinge = {Vector3d(0, 0, 0), Vector3d(2, 0, 0),
                                            Vector3d(0.5, 1, 0), Vector3d(1.2, -0.7, 0)};

std::array<Vector3d, 4> folded_by(double angle_rad) {
  std::array<Vector3d, 4> p = kFlatHinge;
  p[2] = Eigen::AngleAxisd(angle_rad, Vector3d::UnitX()) * p[2];
  return p;
}

TEST(ClothBend, IsTwiceTheSineOfHalfTheAngleBetweenTheNormals) {
  for (const double angle_rad : {-3.0, -1.5, -0.2, 0.0, 1e-5, 0.7, 2.0, 3.1})
    EXPECT_NEAR(bend(folded_by(-angle_rad))->value, 2 * std::sin(0.5 * angle_rad), 1e-12)
        << angle_rad;
}

TEST(ClothBend, GradientEqualsFiniteDifferences) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 0.4);
  for (int i = 0; i < 200; ++i) {
    std::array<Vector3d, 4> p = kFlatHinge;
    for (Vector3d& corner : p) corner += Vector3d{noise(random), noise(random), noise(random)};
    const Bend at = *bend(p);
    if (std::abs(at.value) > 1.9) continue;  // the gradient of a closed hinge is not smooth
    for (std::size_t k = 0; k < 4; ++k)
      for (int axis = 0; axis < 3; ++axis) {
        constexpr double kDelta_m = 1e-6;
        std::array<Vector3d, 4> after = p, before = p;
        after[k][axis] += kDelta_m;
        before[k][axis] -= kDelta_m;
        EXPECT_NEAR(at.gradient_1_m[k][axis],
                    (bend(after)->value - bend(before)->value) / (2 * kDelta_m), 1e-5)
            << "case " << i << ", corner " << k << ", axis " << axis;
      }
  }
}

TEST(ClothBend, NeitherMovesNorTurnsTheHingeAsAWhole) {
  const std::array<Vector3d, 4> p = folded_by(0.8);
  const Bend at = *bend(p);
  Vector3d force = Vector3d::Zero(), torque = Vector3d::Zero();
  for (std::size_t k = 0; k < 4; ++k) {
    force += at.gradient_1_m[k];
    torque += p[k].cross(at.gradient_1_m[k]);
  }
  EXPECT_LT(force.norm(), 1e-13);
  EXPECT_LT(torque.norm(), 1e-13);
}

// A sheet on a cylinder of radius R has the energy area / (2 compliance R^2) of a plate. The hinges
// between the rows bend; there is one fewer than rows.
TEST(ClothBend, ACylinderHasTheEnergyOfAPlate) {
  constexpr int kRows = 12;
  constexpr double kRadius_m = 0.3, kHeight_m = 0.6;
  const geometry::Mesh flat = geometry::curtain_mesh(0.4, kHeight_m, 10, kRows, 0, 0);
  const ClothModel model = cloth_model(flat, Isometry3d::Identity(), {});
  // Chords of the circle are as long as the rows are high.
  const double turn_rad = 2 * std::asin(0.5 * kHeight_m / kRows / kRadius_m);
  double energy_times_compliance = 0;
  for (const ClothHinge& hinge : model.hinges) {
    std::array<Vector3d, 4> p;
    for (std::size_t k = 0; k < 4; ++k) {
      const Vector3d& at = flat.vertices_m[hinge.vertices[k]];
      const double angle_rad = -at.z() / kHeight_m * kRows * turn_rad;
      p[k] = {at.x(), kRadius_m * std::cos(angle_rad), kRadius_m * std::sin(angle_rad)};
    }
    const double value = bend(p)->value;
    energy_times_compliance += value * value / (2 * hinge.shape);
  }
  EXPECT_NEAR(energy_times_compliance,
              0.4 * kHeight_m / (2 * kRadius_m * kRadius_m) * (kRows - 1) / kRows, 1e-9);
}

TEST(ClothBend, ATriangleWithoutAreaHasNone) {
  std::array<Vector3d, 4> p = kFlatHinge;
  p[2] = 0.3 * p[1];
  EXPECT_FALSE(bend(p));
  p = kFlatHinge;
  p[3] = p[0];
  EXPECT_FALSE(bend(p));
  p[3].x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(bend(p));
}

// --- The model ---------------------------------------------------------------------------------

TEST(ClothModel, HasTheMassOfItsArea) {
  const config::ClothSettings settings{.density_kg_m2 = 0.3};
  const ClothModel model =
      cloth_model(geometry::curtain_mesh(0.4, 0.6, 7, 5, 0, 0), Isometry3d::Identity(), settings);
  double mass_kg = 0;
  for (const ClothVertex& vertex : model.vertices) mass_kg += 1 / vertex.inverse_mass_1_kg;
  EXPECT_NEAR(mass_kg, 0.3 * 0.4 * 0.6, 1e-12);
}

TEST(ClothModel, AtRestNoConstraintIsStrained) {
  const Isometry3d pose =
      Eigen::Translation3d(1, 2, 3) * Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized());
  Cloth cloth(geometry::curtain_mesh(0.4, 0.6, 10, 12, 0.02, 3), pose, {});
  cloth.step(0.1, Vector3d::Zero(), {}, 1, kNoLimit_m_s);
  EXPECT_LT(fastest_m_s(cloth), 1e-9);
}

TEST(ClothModel, TethersAreAsLongAsTheWayAlongTheMesh) {
  config::ClothSettings settings;
  settings.pins = {upper_edge()};
  const ClothModel model =
      cloth_model(geometry::curtain_mesh(0.4, 0.6, 10, 12, 0, 0), Isometry3d::Identity(), settings);
  EXPECT_EQ(model.tethers.size(), 11u * 12u);
  EXPECT_NEAR(model.longest_tether_m, 0.6, 1e-12);
  for (const ClothTether& tether : model.tethers) {
    const Vector3d& p = model.start_world_m[tether.vertex];
    EXPECT_NEAR(tether.length_m, -p.z(), 1e-12);  // straight up
    EXPECT_EQ(model.start_world_m[tether.pin].x(), p.x());
  }
}

TEST(ClothModel, RefusesATriangleWithoutAreaAndAPinOnNothing) {
  geometry::Mesh mesh = geometry::curtain_mesh(0.4, 0.6, 2, 2, 0, 0);
  config::ClothSettings settings;
  settings.pins = {{{Vector3d(5, 5, 5), Vector3d(6, 6, 6)}}};
  EXPECT_THROW(cloth_model(mesh, Isometry3d::Identity(), settings), std::invalid_argument);
  settings.pins.clear();
  mesh.vertices_m[mesh.triangles[0][1]] = mesh.vertices_m[mesh.triangles[0][0]];
  EXPECT_THROW(cloth_model(mesh, Isometry3d::Identity(), settings), std::invalid_argument);
}

// --- Motion ------------------------------------------------------------------------------------

TEST(Cloth, FallsFreelyWithoutPins) {
  Cloth cloth(geometry::curtain_mesh(0.4, 0.6, 5, 5, 0.02, 2), Isometry3d::Identity(),
              {.air_drag_1_s = 0});
  run(cloth, 0.5);
  for (std::size_t i = 0; i < cloth.vertices_world_m().size(); ++i) {
    const Vector3d moved = cloth.vertices_world_m()[i] - cloth.model().start_world_m[i];
    // Semi-implicit Euler falls farther by half a substep's final speed: g t h / 2.
    EXPECT_NEAR(moved.z(), -0.5 * 9.80665 * 0.25, 9.80665 * 0.5 * kMaxClothSubstep_s);
    EXPECT_NEAR(moved.head<2>().norm(), 0, 1e-9);
  }
}

TEST(Cloth, AirSlowsItToTheTerminalVelocity) {
  Cloth cloth(geometry::curtain_mesh(0.4, 0.6, 3, 3, 0, 0), Isometry3d::Identity(),
              {.air_drag_1_s = 10});
  run(cloth, 2);
  EXPECT_NEAR(fastest_m_s(cloth), 9.80665 / 10, 1e-3);
}

TEST(Cloth, HangsAtItsLengthHoweverManyRowsItHas) {
  for (const int rows : {4, 12, 60}) {
    Cloth cloth = hanging_curtain({.stretch_compliance_m_n = 0}, 10, rows);
    run(cloth, 2);
    EXPECT_NEAR(lowest_m(cloth), -0.6, 1e-4) << rows << " rows";
    EXPECT_LT(fastest_m_s(cloth), 1e-3) << rows << " rows";
  }
}

// A strip that hangs by its own weight is longer by compliance * density * g * length^2 / 2.
TEST(Cloth, AnElasticOneExtendsByItsWeight) {
  const double compliance_m_n = 0.05;
  Cloth cloth = hanging_curtain({.stretch_compliance_m_n = compliance_m_n}, 4, 12);
  run(cloth, 8);
  const double extension_m = 0.5 * compliance_m_n * 0.2 * 9.80665 * 0.36;
  EXPECT_NEAR(lowest_m(cloth), -0.6 - extension_m, 0.1 * extension_m);
}

TEST(Cloth, DoesNotGainEnergyAsAPendulum) {
  config::ClothSettings settings{.damping_s = 0, .air_drag_1_s = 0};
  settings.pins = {upper_edge()};
  // Starts level, so that it swings down.
  Cloth cloth(geometry::curtain_mesh(0.4, 0.6, 6, 8, 0, 0),
              Isometry3d(Eigen::AngleAxisd(0.5 * M_PI, Vector3d::UnitX())), settings);
  const auto energy_j = [&] {
    double sum_j = kinetic_energy_j(cloth);
    for (std::size_t i = 0; i < cloth.vertices_world_m().size(); ++i)
      if (const double inverse = cloth.model().vertices[i].inverse_mass_1_kg; inverse > 0)
        sum_j += 9.80665 / inverse * cloth.vertices_world_m()[i].z();
    return sum_j;
  };
  const double start_j = energy_j(), fall_j = 0.2 * 0.4 * 0.6 * 9.80665 * 0.6;
  double most_kinetic_j = 0;
  for (int i = 0; i < 10 * 240; ++i) {
    cloth.step(kStep_s, kGravity_m_s2, {}, 1, kNoLimit_m_s);
    ASSERT_LT(energy_j(), start_j + 0.01 * fall_j) << "step " << i;
    most_kinetic_j = std::max(most_kinetic_j, kinetic_energy_j(cloth));
  }
  // Its centre falls by up to half its height, and it keeps most of that in the first swing.
  EXPECT_GT(most_kinetic_j, 0.3 * fall_j);
  EXPECT_LT(most_kinetic_j, 0.51 * fall_j);
}

// Steps of 1/240 s and longer have substeps of 1/960 s; a step that is 16 times shorter has one.
TEST(Cloth, RestsInTheSamePlaceWithStepsSixteenTimesShorter) {
  Cloth cloth = hanging_curtain({}, 10, 12, 0.02), finer = cloth, coarser = cloth;
  run(cloth, 12, 1.0 / 240);
  run(finer, 12, 1.0 / (test::kHasSanitizer ? 1920 : 3840));
  run(coarser, 12, 1.0 / 7);
  EXPECT_GT(farthest_apart_m(cloth, finer), 0) << "the runs had the same substeps";
  EXPECT_GT(farthest_apart_m(cloth, coarser), 0) << "the runs had the same substeps";
  EXPECT_LT(farthest_apart_m(cloth, finer), 1e-3);
  EXPECT_LT(farthest_apart_m(cloth, coarser), 1e-3);
}

TEST(Cloth, KeepsAPinnedCornerAndHangsFromItAlone) {
  config::ClothSettings settings;
  settings.pins = {{{Vector3d(-0.21, -1, -0.001), Vector3d(-0.19, 1, 0.001)}}};
  Cloth cloth(geometry::curtain_mesh(0.4, 0.6, 8, 12, 0, 0), Isometry3d::Identity(), settings);
  run(cloth, 10);
  const auto pinned = std::min_element(
      cloth.model().vertices.begin(), cloth.model().vertices.end(),
      [](const auto& a, const auto& b) { return a.inverse_mass_1_kg < b.inverse_mass_1_kg; });
  EXPECT_EQ(pinned->inverse_mass_1_kg, 0);
  const auto index = std::size_t(pinned - cloth.model().vertices.begin());
  EXPECT_EQ(cloth.vertices_world_m()[index], cloth.model().start_world_m[index]);
  for (const Vector3d& p : cloth.vertices_world_m()) ASSERT_TRUE(p.allFinite());
  EXPECT_LT(lowest_m(cloth), -0.6);  // the diagonal is longer than the edge
  EXPECT_GT(lowest_m(cloth), -std::hypot(0.4, 0.6) - 0.005);
}

TEST(Cloth, SlidesAlongARail) {
  config::ClothSettings settings{.air_drag_1_s = 0};
  settings.pins = {upper_edge()};
  settings.pins[0].slides_along = Vector3d(3, 0, 0);
  Cloth cloth(geometry::curtain_mesh(0.4, 0.6, 8, 12, 0, 0), Isometry3d::Identity(), settings);
  run(cloth, 1, kStep_s, Vector3d(1, 0, -9.80665));  // a rail that is a little tilted
  for (std::size_t i = 0; i < cloth.vertices_world_m().size(); ++i) {
    if (cloth.model().vertices[i].slides_along_world.isZero()) continue;
    const Vector3d moved = cloth.vertices_world_m()[i] - cloth.model().start_world_m[i];
    EXPECT_NEAR(moved.x(), 0.5, 0.01);
    EXPECT_EQ(moved.tail<2>(), Eigen::Vector2d::Zero());
  }
}

TEST(Cloth, GivesTheSameBitsAgain) {
  Cloth a = hanging_curtain({}, 10, 12, 0.02), b = a;
  run(a, 1);
  run(b, 1);
  EXPECT_EQ(a.vertices_world_m(), b.vertices_world_m());
  a.reset();
  EXPECT_EQ(a.vertices_world_m(), a.model().start_world_m);
  EXPECT_EQ(fastest_m_s(a), 0);
  run(a, 1);
  EXPECT_EQ(a.vertices_world_m(), b.vertices_world_m());
}

// Every triangle without area (corners lifted) or crumpled, some turned inside out (middles
// lifted).
TEST(Cloth, UnfoldsAfterItWasCrushedToItsRail) {
  config::ClothSettings settings;
  settings.pins = {upper_edge()};
  for (const bool crumpled : {false, true}) {
    Cloth cloth(geometry::curtain_mesh(0.4, 0.6, 6, 8, 0.01, 2), Isometry3d::Identity(), settings);
    std::vector<ClothContact> lift;
    for (std::uint32_t t = 0; t < cloth.model().triangles.size(); ++t)
      for (int corner = 0; corner < 3; ++corner)
        lift.push_back({t, crumpled ? Vector3d::Constant(1.0 / 3).eval() : Vector3d::Unit(corner),
                        Vector3d::UnitZ(), 0.0});
    cloth.project(lift);
    EXPECT_GT(lowest_m(cloth), -0.2);
    run(cloth, 6);
    EXPECT_NEAR(lowest_m(cloth), -0.6, 1e-3) << (crumpled ? "crumpled" : "flat");
  }
}

// --- Contacts ----------------------------------------------------------------------------------

// One contact at each corner of each triangle: the cloth stays above a plane.
std::vector<ClothContact> plane(const Cloth& cloth, const Vector3d& normal, double offset_m = 0) {
  std::vector<ClothContact> contacts;
  for (std::uint32_t t = 0; t < cloth.model().triangles.size(); ++t)
    for (int corner = 0; corner < 3; ++corner)
      contacts.push_back({t, Vector3d::Unit(corner), normal, offset_m});
  return contacts;
}

Cloth lying_cloth(double friction, const Vector3d& normal = Vector3d::UnitZ()) {
  const Isometry3d pose(Eigen::Quaterniond::FromTwoVectors(-Vector3d::UnitY(), normal));
  return Cloth(geometry::curtain_mesh(0.4, 0.4, 6, 6, 0, 0), pose,
               {.air_drag_1_s = 0, .friction = friction});
}

TEST(ClothContact, CorrectsAPenetrationWithoutVelocity) {
  Cloth cloth = lying_cloth(0);
  const std::vector<ClothContact> contacts = plane(cloth, Vector3d::UnitZ(), 0.03);
  cloth.step(kStep_s, Vector3d::Zero(), contacts, 1, kNoLimit_m_s);
  for (const Vector3d& p : cloth.vertices_world_m()) EXPECT_NEAR(p.z(), 0.03, 1e-9);
  EXPECT_LT(fastest_m_s(cloth), 0.05);  // 30 mm in a step would be 7.2 m/s
}

TEST(ClothContact, MovesByItsShare) {
  Cloth cloth = lying_cloth(0);
  cloth.step(kStep_s, Vector3d::Zero(), plane(cloth, Vector3d::UnitZ(), 0.03), 0.25, kNoLimit_m_s);
  for (const Vector3d& p : cloth.vertices_world_m()) EXPECT_NEAR(p.z(), 0.0075, 1e-9);
}

TEST(ClothContact, APointBeyondItsPlaneStaysFree) {
  Cloth cloth = lying_cloth(0), free = cloth;
  const std::vector<ClothContact> contacts = plane(cloth, Vector3d::UnitZ(), -0.5);
  cloth.step(kStep_s, kGravity_m_s2, contacts, 1, kNoLimit_m_s);
  free.step(kStep_s, kGravity_m_s2, {}, 1, kNoLimit_m_s);
  EXPECT_EQ(cloth.vertices_world_m(), free.vertices_world_m());
}

TEST(ClothContact, FrictionHoldsItOnASlopeBelowTheFrictionAngle) {
  for (const double slope_rad : {0.2, 0.4}) {
    const Vector3d normal(std::sin(slope_rad), 0, std::cos(slope_rad));
    for (const double friction : {0.8 * std::tan(slope_rad), 1.2 * std::tan(slope_rad)}) {
      Cloth cloth = lying_cloth(friction, normal);
      const std::vector<ClothContact> contacts = plane(cloth, normal);
      for (int i = 0; i < 120; ++i) cloth.step(kStep_s, kGravity_m_s2, contacts, 1, kNoLimit_m_s);
      const double excess = std::sin(slope_rad) - friction * std::cos(slope_rad);
      Vector3d mean_m_s = Vector3d::Zero();
      for (const Vector3d& v : cloth.velocities_world_m_s())
        mean_m_s += v / double(cloth.velocities_world_m_s().size());
      EXPECT_NEAR(mean_m_s.norm(), std::max(0.0, excess) * 9.80665 * 0.5,
                  0.1 * 9.80665 * 0.5 * std::sin(slope_rad))
          << "slope " << slope_rad << ", friction " << friction;
    }
  }
}

TEST(ClothContact, NoVertexIsFasterThanTheLimit) {
  Cloth cloth(geometry::curtain_mesh(0.4, 0.6, 6, 8, 0.01, 2), Isometry3d::Identity(),
              {.air_drag_1_s = 0});
  for (int i = 0; i < 240; ++i) cloth.step(kStep_s, kGravity_m_s2, {}, 1, 2.0);
  EXPECT_NEAR(fastest_m_s(cloth), 2.0, 1e-12);
}

}  // namespace
}  // namespace fivepipe::sim
