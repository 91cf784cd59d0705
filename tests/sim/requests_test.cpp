// Requests of a scene that a frame cannot answer: no contact, no hull, no history.
#include <gtest/gtest.h>

#include "tests/support/sim_scene.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

config::SceneObject requesting(const Vector3d& center_m) {
  config::SceneObject box =
      virtual_box("box", center_m, {0.1, 0.1, 0.1}, config::Reaction::highlight);
  box.requests.response = config::ResponseRequests{
      .v_rec_world = Vector3d::UnitX(), .four_points = true, .local_minimum_translation = true};
  box.requests.contacts = 2;
  return box;
}

TEST(Requests, OnlyAnObjectThatCollidesHasAResponseAndContacts) {
  const auto silhouettes = seen({ball(kOrigin, 0.03)});
  sim::Simulation simulation(scene_of({requesting({0.06, 0, 0}), requesting({0.2, 0, 0})}), {});
  simulation.advance_to(0, silhouettes);
  ASSERT_EQ(simulation.collisions().size(), 2u);
  const sim::CollisionReport &touching = simulation.collisions()[0],
                             &free = simulation.collisions()[1];
  EXPECT_TRUE(touching.collision.colliding());
  EXPECT_TRUE(touching.details.response && touching.details.contacts);
  EXPECT_EQ(free.collision.verdict, collision::CollisionVerdict::free);
  EXPECT_FALSE(free.details.response || free.details.contacts ||
               free.details.local_minimum_translation);
}

TEST(Requests, WithoutAHistoryThereIsNoFirstContact) {
  const auto silhouettes = seen({ball(kOrigin, 0.03)});
  config::SceneObject box =
      virtual_box("box", {0.06, 0, 0}, {0.1, 0.1, 0.1}, config::Reaction::highlight);
  box.requests.first_contact = true;
  sim::Simulation simulation(scene_of({box}), {});
  for (int frame = 0; frame < 2; ++frame) simulation.advance_to(frame * kFrame_s, silhouettes);
  EXPECT_TRUE(simulation.collisions().at(0).collision.colliding());
  EXPECT_FALSE(simulation.collisions().at(0).details.first_contact);
}

// No frame set has arrived yet.
TEST(Requests, ABouncingBallFallsBeforeTheFirstHull) {
  sim::Simulation simulation(scene_of({virtual_ball({0, 0, 0.5})}), {});
  simulation.advance_to(0);
  simulation.advance_to(0.1);
  EXPECT_EQ(simulation.counters().steps, 24u);
  EXPECT_LT(simulation.states()[0].world_from_object.translation().z(), 0.49);
  EXPECT_EQ(simulation.counters().contacts, 0u);
  EXPECT_EQ(simulation.counters().detection.objects, 0u);
}

// The detector finds both, and reuses its results in the next query, which is of the ball alone.
TEST(Requests, ACollisionOfAnotherObjectIsNoContactOfTheBall) {
  const auto silhouettes = seen({ball(kOrigin, 0.03)});
  sim::Simulation simulation(
      scene_of({virtual_ball({0, 0, 1}),
                virtual_box("box", {0.06, 0, 0}, {0.1, 0.1, 0.1}, config::Reaction::highlight)}),
      {});
  for (int frame = 0; frame < 4; ++frame) {
    simulation.advance_to(frame * kFrame_s, silhouettes);
    EXPECT_TRUE(simulation.collisions().at(1).collision.colliding());
  }
  EXPECT_EQ(simulation.counters().contacts, 0u);
  EXPECT_FALSE(simulation.collisions().at(0).response);
}

TEST(CurrentHull, ASceneThatDoesNotNeedTheHullHasNone) {
  const config::Scene scene = scene_of({virtual_box("box", kOrigin, {0.1, 0.1, 0.1})});
  const auto silhouettes = seen({ball(kOrigin, 0.03)});
  for (const bool is_needed : {false, true}) {
    sim::CurrentHull hull(scene, {}, is_needed, {});
    EXPECT_EQ(hull.query(), nullptr) << "before the first frame set";
    hull.set(0, silhouettes);
    EXPECT_EQ(hull.query() != nullptr, is_needed);
    EXPECT_EQ(hull.history(), nullptr);
  }
}

}  // namespace
}  // namespace fivepipe::test
