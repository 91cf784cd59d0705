// The table of simulations of `fivepipe top`, word for word and at its limits, and the values in
// report.json.
#include "launch/supervise/status/simulation_status.h"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "common/pipeline/messages/wire_conversions.h"
#include "launch/supervise/status/status_messages.h"
#include "tests/launch/supervise/statuses.h"
#include "tests/support/not_finite.h"
#include "tests/support/text.h"
#include "tests/support/time_units.h"

using namespace fivepipe;
using namespace fivepipe::test;

namespace {

launch::SimulatedObjects three_bodies(double in_hull_m) {
  return {.count = 3,
          .kinetic_j = 0.0123,
          .potential_j = -4.5,
          .hull_contacts = 6,
          .body_contacts = 7,
          .in_hull_m = in_hull_m,
          .in_body_m = 0.0002};
}
launch::SimulatedObjects one_cloth() {
  return {
      .count = 1, .kinetic_j = 1e-7, .potential_j = 123.4, .hull_contacts = 8, .in_hull_m = 0.0003};
}
launch::SimulatedObjects grains() { return {.count = 532, .hull_contacts = 87}; }

constexpr double kNotFinite[] = {kNaN, kInfinity, -kInfinity};

// A message with all kinds, and the storage that it borrows.
struct MetricsMessage {
  std::vector<fivepipe_v1_BodyMetrics> bodies{{1, 2.5, -3.5, 4, 5, 0.006, 0.007}};
  std::vector<fivepipe_v1_ClothMetrics> cloths{{8, 9.5, 10.5, 11, 0.012}};
  std::vector<fivepipe_v1_ParticleMetrics> particles{{13, 14}};
  fivepipe_v1_SimulationMetrics message{};

  std::optional<launch::SimulationStatus> converted() {
    messages::set_text(message.simulation, "sim");
    messages::borrow(message.bodies, bodies);
    messages::borrow(message.cloths, cloths);
    messages::borrow(message.particles, particles);
    return launch::simulation_from(message);
  }
};

}  // namespace

TEST(SimulationsTable, ShowsALinePerKindWithTheMaximum) {
  launch::StatusRegistry statuses;
  auto sim = status("sim", 1);
  sim.counts = {{"objects_respawned", 2}, {"particles_stuck", 3}, {"particles_not_finite", 1}};
  statuses.add(sim, 10 * s);
  launch::SimulationRegistry simulations;
  EXPECT_EQ(launch::simulations_table(simulations, statuses, 10 * s), "");
  simulations.add({"sim", {{"bodies", three_bodies(0.0021)}}}, 9 * s);
  simulations.add(
      {"sim", {{"bodies", three_bodies(0.0004)}, {"cloths", one_cloth()}, {"particles", grains()}}},
      10 * s);
  EXPECT_EQ(launch::simulations_table(simulations, statuses, 12 * s),
            "\n"
            "simulation      objects           kinetic J  potential J  hull contact"
            "s  in hull now/max mm  object contacts  overlap now/max mm  resets\n"
            "sim             bodies: 3             0.012       -4.500              "
            "6             0.4/2.1                7             0.2/0.2       2\n"
            "sim             cloths: 1             0.000      123.400              "
            "8             0.3/0.3                -                   -       0\n"
            "sim             particles: 532            -            -             8"
            "7                   -                -                   -       4\n");
  EXPECT_EQ(launch::simulations_table(simulations, statuses, 12 * s + 400 * ms), "")
      << "the simulation is silent";
}

TEST(SimulationsTable, HasNoMoreSimulationsThanTheLimitAndNoControlCharacters) {
  launch::SimulationRegistry simulations;
  for (int i = 0; i < 40; ++i)
    simulations.add({"sim\x1b" + std::to_string(i), {{"particles", grains()}}}, 10 * s);
  EXPECT_EQ(simulations.entries().size(), 32u);
  EXPECT_EQ(simulations.ignored(), 8u);
  const std::string table = launch::simulations_table(simulations, {}, 10 * s);
  EXPECT_EQ(line_count(table), 1 + 1 + 32 + 1);
  EXPECT_FALSE(contains(table, "\x1b"));
  EXPECT_TRUE(
      table.ends_with("ignored 8 messages SimulationMetrics: a value is impossible, or too "
                      "many simulations\n"))
      << table;
  simulations.add({"sim\x1b" + std::to_string(0), {{"particles", grains()}}}, 11 * s);
  EXPECT_EQ(simulations.ignored(), 8u) << "a known one";
}

TEST(SimulationsTable, ReportHasTheValuesOfTheKindsThatTheSceneHas) {
  launch::SimulationRegistry simulations;
  simulations.add({"sim", {{"bodies", three_bodies(0.5)}}}, 9 * s);
  simulations.add({"sim", {{"bodies", three_bodies(0.25)}, {"particles", grains()}}}, 10 * s);
  const nlohmann::json json = launch::json_of(simulations.entries().at("sim"));
  EXPECT_EQ(json, (nlohmann::json{{"bodies",
                                   {{"count", 3},
                                    {"kinetic_j", 0.0123},
                                    {"potential_j", -4.5},
                                    {"hull_contacts", 6},
                                    {"object_contacts", 7},
                                    {"in_hull_mm", 250.0},
                                    {"max_in_hull_mm", 500.0},
                                    {"overlap_mm", 0.2},
                                    {"max_overlap_mm", 0.2}}},
                                  {"particles", {{"count", 532}, {"hull_contacts", 87}}}}));
}

TEST(SimulationStatus, KeepsEveryFieldOfAMessage) {
  const auto status = MetricsMessage().converted();
  ASSERT_TRUE(status);
  EXPECT_EQ(status->simulation, "sim");
  ASSERT_EQ(status->of_kind.size(), 3u);
  const launch::SimulatedObjects &bodies = status->of_kind.at("bodies"),
                                 &cloths = status->of_kind.at("cloths"),
                                 &particles = status->of_kind.at("particles");
  EXPECT_EQ((std::vector{bodies.count, bodies.hull_contacts, *bodies.body_contacts, cloths.count,
                         cloths.hull_contacts, particles.count, particles.hull_contacts}),
            (std::vector<std::uint64_t>{1, 4, 5, 8, 11, 13, 14}));
  EXPECT_EQ(
      (std::vector{*bodies.kinetic_j, *bodies.potential_j, *bodies.in_hull_m, *bodies.in_body_m,
                   *cloths.kinetic_j, *cloths.potential_j, *cloths.in_hull_m}),
      (std::vector{2.5, -3.5, 0.006, 0.007, 9.5, 10.5, 0.012}));
  EXPECT_FALSE(cloths.in_body_m || cloths.body_contacts || particles.kinetic_j);
}

TEST(SimulationStatus, RefusesImpossibleValues) {
  const auto refuses = [](const auto& change) {
    MetricsMessage of;
    change(of);
    return !of.converted();
  };
  for (const double wrong : kNotFinite) {
    EXPECT_TRUE(refuses([&](MetricsMessage& of) { of.bodies[0].kinetic_j = wrong; })) << wrong;
    EXPECT_TRUE(refuses([&](MetricsMessage& of) { of.bodies[0].potential_j = wrong; })) << wrong;
    EXPECT_TRUE(refuses([&](MetricsMessage& of) { of.bodies[0].deepest_in_body_m = wrong; }));
    EXPECT_TRUE(refuses([&](MetricsMessage& of) { of.cloths[0].deepest_in_hull_m = wrong; }));
  }
  EXPECT_TRUE(refuses([](MetricsMessage& of) { of.bodies[0].kinetic_j = -1e-9; }));
  EXPECT_TRUE(refuses([](MetricsMessage& of) { of.cloths[0].deepest_in_hull_m = -1e-9; }));
  EXPECT_TRUE(refuses([](MetricsMessage& of) { of.message.capture_stamp_ns = -1; }));
  EXPECT_FALSE(refuses([](MetricsMessage& of) { of.bodies[0].potential_j = -1e9; }));
}
