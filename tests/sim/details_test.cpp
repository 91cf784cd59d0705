// Optional details of collisions, computed only on request; history; warmth.
#include <limits>
#include <random>
#include <set>
#include <stdexcept>

#include "common/collision/oracle/distance_reference.h"
#include "tests/support/sim_scene.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

constexpr double kLabFrame_s = 1.0 / 60;
const Eigen::AlignedBox3d kSpace(Vector3d(-0.3, -0.3, -0.3), Vector3d(0.3, 0.3, 0.3));

// All tests use the CPU backend, which needs no OpenGL context.
config::SceneObject plate(double x_m = 0) {
  return virtual_box("plate", {x_m, 0, 0}, {0.005, 0.4, 0.4}, config::Reaction::highlight);
}
std::vector<hull::Silhouette> hand_at(double x_m, double radius_m = 0.02) {
  return seen({{{x_m, -0.01, 0}, {x_m, 0.01, 0.005}, radius_m}});
}

TEST(CollisionDetails, ComputesOnlyRequestedDetails) {
  sim::Simulation simulation(scene_of({plate()}), {});
  simulation.advance_to(0, hand_at(0));
  const sim::CollisionReport& report = simulation.collisions().at(0);
  EXPECT_TRUE(report.collision.colliding());
  EXPECT_FALSE(report.response || report.details.response ||
               report.details.local_minimum_translation || report.details.contacts ||
               report.details.first_contact);
  EXPECT_TRUE(report.details.proximity.empty());
  EXPECT_EQ(simulation.hull_components(), nullptr);
  EXPECT_TRUE(simulation.states()[0].warmth.empty());
}

// A camera that looks away has no object pixel, so by Limits::all the hull is empty.
TEST(CollisionDetails, UsesTheHullRuleOfTheConfiguration) {
  std::vector<hull::Silhouette> silhouettes = hand_at(0);
  silhouettes.push_back({{geometry::pinhole_from_fov(64, 48, 0.8),
                          geometry::look_at({0, 0, 1}, {0.1, 0, 2}, Vector3d::UnitX())},
                         hull::ObjectPixels(64, 48)});
  config::Scene with_history = scene_of({plate()});
  with_history.history = config::HistoryRequests{};
  for (const config::Scene& scene : {scene_of({plate()}), with_history})
    for (const bool seen : {false, true}) {
      const hull::HullRule rule = seen ? hull::HullRule{hull::Limits::seen, 5} : hull::HullRule{};
      sim::Simulation simulation(scene, {.hull_rule = rule}, kSpace);
      simulation.advance_to(0, silhouettes);
      EXPECT_EQ(simulation.collisions().at(0).collision.colliding(), seen);
      if (scene.history) {
        EXPECT_EQ(simulation.hull_components()->size(), seen ? 1u : 0u);
      }
    }
}

TEST(CollisionDetails, FixedObjectReportsPenetrationDepth) {
  config::SceneObject object = virtual_box("block", {0.1, 0, 0}, {0.2, 0.2, 0.2},
                                           config::Reaction::highlight);  // x >= 0
  object.requests.response = config::ResponseRequests{.v_rec_world = Vector3d::UnitX(),
                                                      .four_points = true,
                                                      .closed_form = true,
                                                      .local_minimum_translation = true};
  object.requests.contacts = 3;
  sim::Simulation simulation(scene_of({object}), {});
  simulation.advance_to(0, hand_at(-0.015, 0.025));  // 1 cm deep in the block
  const sim::CollisionDetails& details = simulation.collisions().at(0).details;
  ASSERT_TRUE(details.response && details.response->has_exit());
  // A move along x frees the block. The hull exceeds the hand by less than two pixels of 2 mm plus
  // the excess of cameras from above.
  EXPECT_GT(details.response->clear_distance_m() + details.response->residual_m, 0.008);
  EXPECT_LT(details.response->clear_distance_m() + details.response->residual_m, 0.020);
  EXPECT_NE(details.response->four_points.status, collision::NormalStatus::not_requested);
  ASSERT_EQ(details.response->closed_form.status, collision::NormalStatus::defined);
  EXPECT_GT(details.response->closed_form.normal_world.x(), 0.5) << "the hand's front";
  ASSERT_TRUE(details.local_minimum_translation);
  EXPECT_NE(details.local_minimum_translation->status,
            collision::LocalMinimumTranslationStatus::none_verified);
  ASSERT_TRUE(details.contacts);
  EXPECT_GE(details.contacts->contacts.size(), 1u);
  EXPECT_LE(details.contacts->contacts.size(), 3u);
}

TEST(CollisionDetails, ComputesOnlyTheRequestedNormal) {
  for (const bool four : {false, true}) {
    config::SceneObject object = plate(0.01);
    object.requests.response = config::ResponseRequests{
        .v_rec_world = Vector3d::UnitX(), .four_points = four, .closed_form = !four};
    sim::Simulation simulation(scene_of({object}), {});
    simulation.advance_to(0, hand_at(0));
    const sim::CollisionDetails& details = simulation.collisions().at(0).details;
    ASSERT_TRUE(details.response);
    EXPECT_EQ(details.response->four_points.status == collision::NormalStatus::not_requested,
              !four);
    EXPECT_EQ(details.response->closed_form.status == collision::NormalStatus::not_requested, four);
    EXPECT_FALSE(details.local_minimum_translation);
  }
}

TEST(CollisionDetails, ContactsNeedNoResponseAndAResponseNoContacts) {
  config::SceneObject contacts = plate(), response = plate();
  contacts.requests.contacts = 1;
  response.requests.response = config::ResponseRequests{.v_rec_world = Vector3d::UnitX()};
  sim::Simulation simulation(scene_of({contacts, response}), {});
  simulation.advance_to(0, hand_at(0));
  const sim::CollisionDetails &first = simulation.collisions().at(0).details,
                              &second = simulation.collisions().at(1).details;
  ASSERT_TRUE(first.contacts);
  EXPECT_EQ(first.contacts->contacts.size(), 1u);
  EXPECT_FALSE(first.response);
  EXPECT_TRUE(second.response);
  EXPECT_FALSE(second.contacts);
}

TEST(CollisionDetails, ReportsEvenlySpreadPointsUpToTheLimit) {
  const auto silhouettes = hand_at(0);
  for (const bool needs_all_points : {false, true}) {
    config::SceneObject object = plate();
    object.shape = config::BoxShape{{0.005, 0.1, 0.1}, 0.02};
    if (needs_all_points) object.requests.contacts = 1;
    const auto report_with = [&](std::size_t max_points) {
      sim::Simulation simulation(scene_of({object}), {.max_points = int(max_points)});
      simulation.advance_to(0, silhouettes);
      return simulation.collisions().at(0);
    };
    const sim::CollisionReport whole = report_with(4000);
    const std::vector<collision::CollisionPoint>& points = whole.collision.points;
    ASSERT_GT(points.size(), 20u);
    ASSERT_LT(points.size(), 4000u);
    EXPECT_FALSE(whole.truncated);
    for (const std::size_t limit : {points.size(), points.size() - 1, std::size_t(7)}) {
      const sim::CollisionReport report = report_with(limit);
      EXPECT_EQ(report.truncated, limit < points.size());
      EXPECT_FALSE(report.collision.truncated);
      EXPECT_EQ(report.collision.triangles, whole.collision.triangles);
      std::vector<collision::CollisionPoint> expected;
      for (std::size_t i = 0; i < limit; ++i) expected.push_back(points[i * points.size() / limit]);
      EXPECT_EQ(report.collision.points, expected);
    }
    const sim::CollisionReport none = report_with(0);
    EXPECT_TRUE(none.truncated);
    EXPECT_TRUE(none.collision.points.empty());
    EXPECT_TRUE(none.collision.colliding());
  }
}

TEST(CollisionDetails, ReportsThatTheDetectorHadMorePoints) {
  constexpr std::size_t kMaxFound = 4096;
  config::SceneObject object = plate();
  object.shape = config::BoxShape{{0.005, 0.1, 0.1}, 0.01};
  sim::Simulation simulation(scene_of({object}), {.spacing_m = 2e-4, .max_points = 20000});
  simulation.advance_to(0, hand_at(0));
  EXPECT_EQ(simulation.collisions().at(0).collision.points.size(), kMaxFound);
  EXPECT_TRUE(simulation.collisions().at(0).truncated);
}

TEST(CollisionDetails, ProximityHoldsTheExactDistance) {
  constexpr double kCap_m = 0.08, kTolerance_m = 0.002;
  const auto silhouettes = hand_at(-0.05);
  const collision::HullDistance exact(silhouettes);
  for (const config::ProximityOf of :
       {config::ProximityOf::vertices, config::ProximityOf::triangles}) {
    config::SceneObject object = plate();
    object.shape = config::BoxShape{{0.005, 0.2, 0.2}, 0.04};
    object.requests.proximity = config::ProximityRequests{of, kCap_m, kTolerance_m};
    sim::Simulation simulation(scene_of({object}), {});
    simulation.advance_to(0, silhouettes);
    const std::vector<collision::Proximity>& proximity =
        simulation.collisions().at(0).details.proximity;
    const geometry::Mesh mesh = config::mesh_of(object);
    ASSERT_EQ(proximity.size(),
              of == config::ProximityOf::vertices ? mesh.vertices_m.size() : mesh.triangles.size());
    int within = 0;
    for (std::size_t i = 0; i < proximity.size(); ++i) {
      EXPECT_LE(proximity[i].min_m, proximity[i].max_m);
      within += std::isfinite(proximity[i].max_m);
      if (of == config::ProximityOf::triangles) continue;
      const collision::Clearance truth = exact.clearance_m(
          mesh.vertices_m[i], kCap_m, kTolerance_m / 4);  // the reference gives bounds too
      EXPECT_LE(proximity[i].min_m, truth.max_m);
      EXPECT_GE(proximity[i].max_m, truth.min_m);
      if (std::isfinite(truth.max_m)) {
        EXPECT_LE(proximity[i].max_m - proximity[i].min_m, kTolerance_m + 1e-9);
      }
    }
    EXPECT_GT(within, 10);
    EXPECT_LT(within, int(proximity.size()));
  }
}

TEST(CollisionDetails, ProximityHasTheCapAndToleranceOfEachObject) {
  std::vector<config::SceneObject> objects;
  for (const auto& [cap_m, tolerance_m] :
       {std::pair{0.08, 0.002}, {0.03, 0.002}, {0.08, 0.01}, {0.03, 0.002}}) {
    objects.push_back(plate());
    objects.back().shape = config::BoxShape{{0.005, 0.2, 0.2}, 0.04};
    objects.back().requests.proximity =
        config::ProximityRequests{config::ProximityOf::vertices, cap_m, tolerance_m};
  }
  const auto silhouettes = hand_at(-0.05);
  sim::Simulation together(scene_of(objects), {});
  together.advance_to(0, silhouettes);
  std::set<std::vector<double>> different;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    sim::Simulation alone(scene_of({objects[i]}), {});
    alone.advance_to(0, silhouettes);
    std::vector<double> expected, bounds;
    for (const auto& [of, into] : {std::pair{&alone.collisions().at(0), &expected},
                                   std::pair{&together.collisions().at(i), &bounds}})
      for (const collision::Proximity& p : of->details.proximity)
        into->insert(into->end(), {p.min_m, p.max_m});
    EXPECT_EQ(bounds, expected) << i;
    different.insert(bounds);
  }
  EXPECT_EQ(different.size(), 3u);
}

TEST(Warmth, FallsWithDistanceAndCools) {
  config::SceneObject object = plate();
  object.shape = config::BoxShape{{0.005, 0.4, 0.4}, 0.05};
  object.reaction = config::Reaction::none;  // warming does not need a reaction
  object.warming =
      config::Warming{.cap_m = 0.1, .tolerance_m = 0.002, .heating_s = 0.2, .cooling_s = 0.4};
  sim::Simulation simulation(scene_of({object}), {});
  const auto hand = hand_at(-0.06);  // 3 to 4 cm from the plate
  for (int frame = 0; frame <= 60; ++frame) simulation.advance_to(frame * kFrame_s, hand);
  const geometry::Mesh mesh = config::mesh_of(object);
  const std::vector<float> warm = simulation.states()[0].warmth;
  ASSERT_EQ(warm.size(), mesh.vertices_m.size());
  for (std::size_t i = 0; i < warm.size(); ++i) {
    const double beside_m = mesh.vertices_m[i].tail<2>().norm();
    EXPECT_GE(warm[i], 0);
    EXPECT_LE(warm[i], 1);
    if (beside_m < 0.01) {
      EXPECT_GT(warm[i], 0.5);  // 1 - 0.04 / 0.1, approached over five time constants
    }
    if (beside_m > 0.16) {
      EXPECT_EQ(warm[i], 0);
    }
  }
  simulation.pause();
  simulation.advance_to(100 * kFrame_s, {});
  EXPECT_EQ(simulation.states()[0].warmth, warm) << "a paused object does not cool";
  simulation.resume();
  for (int frame = 101; frame <= 113; ++frame) simulation.advance_to(frame * kFrame_s, {});
  const std::vector<float> cooler = simulation.states()[0].warmth;
  for (std::size_t i = 0; i < warm.size(); ++i)
    EXPECT_NEAR(cooler[i], warm[i] * std::exp(-13 * kFrame_s / 0.4), 0.02);
  simulation.reset();
  EXPECT_EQ(simulation.states()[0].warmth, std::vector<float>(warm.size(), 0.0f));
}

TEST(Warmth, GrowsWithTheTimeSinceTheFirstFrame) {
  constexpr double kHeating_s = 0.2;
  config::SceneObject object = plate();
  object.shape = config::BoxShape{{0.005, 0.02, 0.02}};  // inside of the hand
  object.reaction = config::Reaction::none;
  object.warming = config::Warming{.cap_m = 0.1, .heating_s = kHeating_s, .cooling_s = 0.4};
  sim::Simulation simulation(scene_of({object}), {});
  for (const int frame : {0, 1, 2, 9}) {
    simulation.advance_to(frame * kFrame_s, hand_at(0));
    const std::vector<float> warm = simulation.states()[0].warmth;
    ASSERT_FALSE(warm.empty());
    for (const float warmth : warm)
      EXPECT_NEAR(warmth, 1 - std::exp(-frame * kFrame_s / kHeating_s), 1e-3) << frame;
  }
}

TEST(Warmth, BeforeTheFirstHullThereIsNoneAndNothingIsReported) {
  config::SceneObject object = plate();
  object.warming = config::Warming{};
  sim::Simulation simulation(scene_of({object}), {});
  simulation.advance_to(0);
  simulation.advance_to(0.1);
  EXPECT_EQ(simulation.counters().steps, 24u);
  EXPECT_TRUE(simulation.collisions().empty());
  const std::vector<float> warm = simulation.states()[0].warmth;
  ASSERT_FALSE(warm.empty());
  EXPECT_EQ(warm, std::vector<float>(warm.size(), 0.0f));
}

TEST(Warmth, IsKeptIfTheDistanceIsUnknown) {
  sim::Warmth warmth({.cap_m = 0.1, .heating_s = 0.1, .cooling_s = 0.1}, 3);
  const double inf = std::numeric_limits<double>::infinity();
  warmth.advance(1, std::vector<collision::Proximity>{{0, 0}, {0.05, 0.05}, {0.1, inf}});
  const std::vector<float> before = warmth.vertices();
  EXPECT_NEAR(before[0], 1, 1e-3);
  EXPECT_NEAR(before[1], 0.5, 1e-3);
  EXPECT_EQ(before[2], 0);
  warmth.advance(1, std::vector<collision::Proximity>(3, {0, inf}));
  EXPECT_EQ(warmth.vertices(), before);
}

config::Scene scene_with_history(bool first_contact) {
  config::Scene scene = scene_of({plate()});
  scene.objects[0].requests.first_contact = first_contact;
  scene.history = config::HistoryRequests{};
  return scene;
}

// At 5 m/s the hand moves 8 cm per frame, through a plate of 5 mm; it touches it in no frame.
TEST(History, FastHandReportsFirstContactWithAThinPlate) {
  sim::Simulation simulation(scene_with_history(true), {}, kSpace),
      unrequested(scene_with_history(false), {}, kSpace);
  int contacts = 0;
  for (int frame = 0; frame <= 5; ++frame) {
    const double x_m =
        -0.2067 + 5 * kLabFrame_s * frame;  // from -0.04 to 0.043 between frames 2 and 3
    simulation.advance_to(frame * kLabFrame_s, hand_at(x_m));
    const sim::CollisionReport& report = simulation.collisions().at(0);
    EXPECT_FALSE(report.collision.colliding()) << frame;
    unrequested.advance_to(frame * kLabFrame_s, hand_at(x_m));
    EXPECT_FALSE(unrequested.collisions().at(0).details.first_contact);
    if (!report.details.first_contact) continue;
    ++contacts;
    EXPECT_EQ(frame, 3);
    // Contact begins when the hand's front, 2 cm plus a pixel or two ahead of its centre, reaches
    // the plate's face.
    const double expected_s = (2 + (0.04 - 0.02 - 0.0025) / (5 * kLabFrame_s)) * kLabFrame_s;
    EXPECT_NEAR(report.details.first_contact->contact.time_s, expected_s, 0.006 / 5);
    EXPECT_NEAR(report.details.first_contact->contact.p_world_m.x(), 0, 0.004);
    EXPECT_EQ(report.details.first_contact->component, simulation.hull_components()->at(0).id);
    simulation.advance_to((frame + 0.5) * kLabFrame_s);
    EXPECT_FALSE(simulation.collisions().at(0).details.first_contact) << "the hull is not new";
  }
  EXPECT_EQ(contacts, 1);
}

// Two hands reach the plate. The hand ahead is the left and smaller one, or the right and larger
// one.
TEST(History, ReportsTheEarlierOfTwoFirstContacts) {
  for (const auto& [ahead_y_m, ahead_radius_m] : {std::pair{-0.12, 0.018}, {0.12, 0.022}}) {
    sim::Simulation simulation(scene_with_history(true), {}, kSpace);
    int contacts = 0;
    for (int frame = 0; frame <= 4; ++frame) {
      const double x_m = -0.2267 + 5 * kLabFrame_s * frame, ahead_x_m = x_m + 0.015;
      simulation.advance_to(
          frame * kLabFrame_s,
          seen({{{ahead_x_m, ahead_y_m, 0}, {ahead_x_m, ahead_y_m, 0.01}, ahead_radius_m},
                {{x_m, -ahead_y_m, 0}, {x_m, -ahead_y_m, 0.01}, 0.02}}));
      ASSERT_EQ(simulation.hull_components()->size(), 2u);
      const auto& contact = simulation.collisions().at(0).details.first_contact;
      if (!contact) continue;
      ++contacts;
      EXPECT_NEAR(contact->contact.p_world_m.y(), ahead_y_m, 0.03);
      for (const collision::TrackedComponent& hand : *simulation.hull_components())
        EXPECT_EQ(hand.id == contact->component,
                  hand.component.centroid_world_m.y() * ahead_y_m > 0);
    }
    EXPECT_EQ(contacts, 1);
  }
}

// The contact is at the end of a long thin part, far from the component's centroid, on either side.
TEST(History, LongFingerReportsFirstContact) {
  for (const double side : {-1.0, 1.0})
    for (const double origin_x_m : {-0.16, 0.16}) {
      config::Scene scene = scene_with_history(true);
      scene.objects[0] = virtual_box("plate", {origin_x_m + side * 0.1, 0, 0}, {0.005, 0.02, 0.02},
                                     config::Reaction::highlight);
      scene.objects[0].requests.first_contact = true;
      sim::Simulation simulation(scene, {}, kSpace);
      int contacts = 0;
      for (int frame = 0; frame <= 4; ++frame) {
        const double x_m = origin_x_m + side * 0.015 * (frame - 4);
        simulation.advance_to(
            frame * kLabFrame_s,
            seen({ball({x_m, 0, 0}, 0.03), {{x_m, 0, 0}, {x_m + side * 0.1, 0, 0}, 0.008}}));
        contacts += simulation.collisions().at(0).details.first_contact.has_value();
      }
      EXPECT_EQ(contacts, 1) << side << " at " << origin_x_m;
    }
}

TEST(History, ExtendedFingerReportsFirstContact) {
  config::Scene scene = scene_with_history(true);
  scene.objects[0] =
      virtual_box("plate", {0.1, 0, 0}, {0.005, 0.02, 0.02}, config::Reaction::highlight);
  scene.objects[0].requests.first_contact = true;
  sim::Simulation simulation(scene, {}, kSpace);
  for (int frame = 0; frame <= 3; ++frame) {
    std::vector<hull::Capsule> hand{ball(kOrigin, 0.03)};
    if (frame == 3) hand.push_back({kOrigin, {0.1, 0, 0}, 0.008});
    simulation.advance_to(frame * kLabFrame_s, seen(hand));
    EXPECT_EQ(simulation.collisions().at(0).details.first_contact.has_value(), frame == 3) << frame;
  }
}

// A stick turns about its centre by 0.3 rad per frame. Its end reaches the plate a quarter of a
// frame after frame 5: the hull of frame 5 must turn with the stick.
TEST(History, RotatingStickReportsWhenItsEndArrives) {
  constexpr double kTurn_rad = 0.3, kLength_m = 0.12, kRadius_m = 0.01, kThickness_m = 0.004;
  const double touched_rad = 5.25 * kTurn_rad;
  const Vector3d end_m(kLength_m * std::cos(touched_rad), kLength_m * std::sin(touched_rad), 0);
  // The plate is ahead of the end, along the stick.
  config::Scene scene = scene_with_history(true);
  scene.objects[0] =
      virtual_box("plate", kOrigin, {0.02, kThickness_m, 0.02}, config::Reaction::highlight);
  scene.objects[0].requests.first_contact = true;
  Eigen::Isometry3d& pose = scene.objects[0].world_from_object;
  pose.linear() = Eigen::AngleAxisd(touched_rad, Vector3d::UnitZ()).matrix();
  pose.translation() = end_m + pose.linear() * Vector3d(0, kRadius_m + 0.5 * kThickness_m, 0);
  sim::Simulation simulation(scene, {}, kSpace);
  double contact_s = 0;
  for (int frame = 0; frame <= 6; ++frame) {
    const double angle_rad = kTurn_rad * frame;
    const Vector3d half_m(kLength_m * std::cos(angle_rad), kLength_m * std::sin(angle_rad), 0);
    simulation.advance_to(1 + frame * kLabFrame_s, seen({{-half_m, half_m, kRadius_m}}));
    const auto& contact = simulation.collisions().at(0).details.first_contact;
    if (!contact) continue;
    EXPECT_EQ(contact_s, 0) << "only one";
    contact_s = contact->contact.time_s;
  }
  EXPECT_NEAR(contact_s, 1 + 5.25 * kLabFrame_s, 0.12 * kLabFrame_s);
}

// Each component moves from its own position in the frame before.
TEST(History, OnlyTheFastOfTwoHandsReportsFirstContact) {
  constexpr double kBeside_m = 0.12;
  for (const double fast_y_m : {-kBeside_m, kBeside_m}) {
    sim::Simulation simulation(scene_with_history(true), {}, kSpace);
    int contacts = 0;
    for (int frame = 0; frame <= 5; ++frame) {
      const double x_m = -0.2067 + 5 * kLabFrame_s * frame;
      simulation.advance_to(
          frame * kLabFrame_s,
          seen({{{x_m, fast_y_m - 0.01, 0}, {x_m, fast_y_m + 0.01, 0.005}, 0.02},
                {{-0.1, -fast_y_m - 0.01, 0}, {-0.1, -fast_y_m + 0.01, 0}, 0.02}}));
      ASSERT_EQ(simulation.hull_components()->size(), 2u);
      const auto& contact = simulation.collisions().at(0).details.first_contact;
      if (!contact) continue;
      ++contacts;
      EXPECT_EQ(frame, 3);
      EXPECT_NEAR(contact->contact.p_world_m.y(), fast_y_m, 0.03);
      for (const collision::TrackedComponent& hand : *simulation.hull_components())
        EXPECT_EQ(hand.id == contact->component,
                  hand.component.centroid_world_m.y() * fast_y_m > 0);
    }
    EXPECT_EQ(contacts, 1);
  }
}

TEST(History, FastFallingObjectReportsFirstContact) {
  config::Scene scene = scene_with_history(true);
  scene.objects[0] =
      virtual_box("plate", {0, 0, 0.5}, {0.2, 0.2, 0.005}, config::Reaction::highlight);
  scene.objects[0].motion = config::Motion::dynamic;
  scene.objects[0].requests.first_contact = true;
  sim::Simulation simulation(scene, {}, kSpace);
  constexpr double kSlowFrame_s = 0.1;
  int contacts = 0;
  for (int frame = 0; frame <= 5; ++frame) {
    const double z_before_m = simulation.states()[0].world_from_object.translation().z();
    simulation.advance_to(frame * kSlowFrame_s, hand_at(0));
    const double z_m = simulation.states()[0].world_from_object.translation().z();
    const auto& contact = simulation.collisions().at(0).details.first_contact;
    if (!contact) continue;
    ++contacts;
    EXPECT_EQ(frame, 4);
    // At constant speed between its poses, the plate's lower face reaches the hull's top, which is
    // at 2 cm plus the excess of cameras from above.
    const double down_m = z_before_m - 0.0025 - 0.02;
    EXPECT_NEAR(contact->contact.time_s, (3 + down_m / (z_before_m - z_m)) * kSlowFrame_s,
                0.01 / (z_before_m - z_m) * kSlowFrame_s);
  }
  EXPECT_EQ(contacts, 1);
}

// A respawn from 2.5 m below is a jump, not a motion through the hand.
TEST(History, RespawnedObjectHasNoFirstContact) {
  config::Scene scene = scene_with_history(true);
  scene.objects[0] =
      virtual_box("plate", {0, 0, 0.5}, {0.2, 0.2, 0.005}, config::Reaction::highlight);
  scene.objects[0].motion = config::Motion::dynamic;
  scene.objects[0].requests.first_contact = true;
  sim::Simulation simulation(scene, {}, kSpace);
  constexpr double kSlowFrame_s = 0.05;
  const auto hand = hand_at(0);
  for (int frame = 0; frame <= 24 && simulation.counters().respawned == 0; ++frame) {
    simulation.advance_to(frame * kSlowFrame_s,
                          frame < 8 ? std::vector<hull::Silhouette>{}
                                    : hand);  // the plate has fallen before the hand appears
    EXPECT_FALSE(simulation.collisions().at(0).details.first_contact) << frame;
  }
  EXPECT_EQ(simulation.counters().respawned, 1u);
}

TEST(History, ResetObjectHasNoFirstContact) {
  config::Scene scene = scene_with_history(true);
  scene.objects[0] =
      virtual_box("plate", {0, 0, 0.5}, {0.2, 0.2, 0.005}, config::Reaction::highlight);
  scene.objects[0].motion = config::Motion::dynamic;
  scene.objects[0].requests.first_contact = true;
  sim::Simulation simulation(scene, {}, kSpace);
  constexpr double kSlowFrame_s = 0.05;
  const auto hand = hand_at(0);
  for (int frame = 0; frame <= 12; ++frame) {
    if (frame == 10) {
      EXPECT_LT(simulation.states()[0].world_from_object.translation().z(), -0.2);
      simulation.reset();  // a jump from below the hand to above it
    }
    simulation.advance_to(frame * kSlowFrame_s, frame < 8 ? std::vector<hull::Silhouette>{} : hand);
    EXPECT_FALSE(simulation.collisions().at(0).details.first_contact) << frame;
  }
}

TEST(History, LongGapReportsNoFirstContact) {
  for (const double gap_s : {0.2, 0.249, 0.251, 1.0, 60.0}) {
    sim::Simulation simulation(scene_with_history(true), {}, kSpace);
    for (int frame = 0; frame <= 3; ++frame)
      simulation.advance_to(frame * kLabFrame_s, hand_at(-0.1));
    const std::uint64_t id = simulation.hull_components()->at(0).id;
    simulation.advance_to(3 * kLabFrame_s + gap_s, hand_at(0.1));
    const bool is_known = gap_s <= 0.25;
    EXPECT_EQ(simulation.hull_components()->at(0).id == id, is_known) << gap_s;
    EXPECT_EQ(simulation.collisions().at(0).details.first_contact.has_value(), is_known) << gap_s;
  }
}

TEST(History, InitialContactIsNotAFirstContact) {
  sim::Simulation simulation(scene_with_history(true), {}, kSpace);
  for (int frame = 0; frame <= 3; ++frame) {
    simulation.advance_to(frame * kLabFrame_s, hand_at(0.002 * frame));
    EXPECT_TRUE(simulation.collisions().at(0).collision.colliding());
    EXPECT_FALSE(simulation.collisions().at(0).details.first_contact);
  }
}

TEST(History, TracksComponentsAndHeldHullAddsNoFrame) {
  sim::Simulation simulation(scene_with_history(false), {}, kSpace);
  for (int frame = 0; frame <= 4; ++frame)
    simulation.advance_to(frame * kFrame_s, hand_at(-0.15 + 0.5 * kFrame_s * frame));
  ASSERT_EQ(simulation.hull_components()->size(), 1u);
  const collision::TrackedComponent before = simulation.hull_components()->at(0);
  ASSERT_TRUE(before.motion);
  EXPECT_FALSE(before.component.outlines.empty()) << "the tracker needs outlines for rotations";
  EXPECT_EQ(before.motion->frames, 5);
  EXPECT_NEAR(before.motion->velocity_world_m_s.x(), 0.5, 0.025);
  simulation.advance_to(4.5 * kFrame_s);
  simulation.advance_to(5.5 * kFrame_s);
  EXPECT_EQ(simulation.hull_components()->at(0).motion->frames, 5);
  EXPECT_EQ(simulation.hull_components()->at(0).id, before.id);
  EXPECT_FALSE(simulation.collisions().at(0).details.first_contact) << "not requested";
}

TEST(History, RequiresASearchBox) {
  EXPECT_THROW(sim::Simulation(scene_with_history(false), {}), std::invalid_argument);
  EXPECT_THROW(
      sim::Simulation(scene_with_history(false), {},
                      Eigen::AlignedBox3d(Vector3d::Constant(-100), Vector3d::Constant(100))),
      std::invalid_argument)
      << "too many cells";
}

TEST(History, EmptyHullHasNoComponents) {
  sim::Simulation simulation(scene_with_history(true), {}, kSpace);
  for (int frame = 0; frame <= 3; ++frame) simulation.advance_to(frame * kFrame_s, {});
  EXPECT_TRUE(simulation.hull_components()->empty());
  EXPECT_EQ(simulation.collisions().at(0).collision.verdict, collision::CollisionVerdict::free);
}

}  // namespace
}  // namespace fivepipe::test
