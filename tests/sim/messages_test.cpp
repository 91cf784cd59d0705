// Conversion to CollisionResult, HullComponents and VirtualState: the messages contain exactly what
// is requested. Execution of commands.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "sim_node/messages.h"
#include "sim_node/messages_collision.h"

namespace fivepipe::sim {
namespace {

const std::vector<std::string> kCameras = {"left", "right"};
const ResultFrame kFrame{7, 5'000'000'000, 2.5, kCameras};

CollisionReport report_of(collision::CollisionVerdict verdict) {
  CollisionReport report{.object = 0, .name = "plate"};
  report.collision.verdict = verdict;
  report.collision.triangles = {3, 5};
  report.collision.undecided = {8};
  report.collision.points = {{{1, 2, 3}, 3}};
  return report;
}

bool is(const fivepipe_v1_Vec3& message, const Eigen::Vector3d& expected) {
  return messages::from_wire(message) == expected;
}

TEST(CollisionMessage, ContainsOnlyRequestedFields) {
  OutgoingCollision out =
      collision_message(kFrame, report_of(collision::CollisionVerdict::colliding), {});
  const fivepipe_v1_CollisionResult& message = out.message();
  EXPECT_STREQ(message.object, "plate");
  EXPECT_EQ(message.frame, 7u);
  EXPECT_EQ(message.verdict, fivepipe_v1_colliding);
  EXPECT_EQ(message.triangles_colliding, 2u);
  ASSERT_EQ(message.points_m._length, 1u);
  EXPECT_EQ(message.points_m._buffer[0].z, 3);
  EXPECT_EQ(message.response, fivepipe_v1_no_response);
  EXPECT_FALSE(message.points_truncated);
  EXPECT_EQ(message.triangles._length + message.triangles_undecided._length +
                message.normals._length + message.local_minimum_translation._length +
                message.contacts._length + message.proximity._length +
                message.first_contact._length,
            0u);
}

TEST(CollisionMessage, HullInTheBoxIsReportedAsUndecided) {
  CollisionReport report = report_of(collision::CollisionVerdict::free);
  EXPECT_EQ(collision_message(kFrame, report, {}).message().verdict, fivepipe_v1_free);
  report.collision.hull_in_box = true;
  EXPECT_EQ(collision_message(kFrame, report, {}).message().verdict, fivepipe_v1_undecided);
}

TEST(CollisionMessage, NormalsNameTheLimitingCameras) {
  CollisionReport report = report_of(collision::CollisionVerdict::colliding);
  collision::Response& response = report.details.response.emplace();
  response.status = collision::RecoveryStatus::recovered;
  response.d_rec_m = 0.01;
  response.closed_form.status = collision::NormalStatus::defined;
  response.closed_form.normal_world = Eigen::Vector3d::UnitX();
  response.closed_form.cameras = {{1, Eigen::Vector3d::UnitX(), 0.01, 0},
                                  {0, Eigen::Vector3d::UnitY(), 0.02, 0.5}};
  response.four_points.status = collision::NormalStatus::too_uncertain;
  OutgoingCollision out = collision_message(kFrame, report, {});
  const fivepipe_v1_CollisionResult& message = out.message();
  EXPECT_EQ(message.response, fivepipe_v1_recovered);
  EXPECT_EQ(message.d_rec_m, 0.01);
  ASSERT_EQ(message.normals._length, 2u);
  EXPECT_EQ(message.normals._buffer[0].kind, fivepipe_v1_four_points);
  EXPECT_EQ(message.normals._buffer[0].status, fivepipe_v1_normal_undefined);
  const fivepipe_v1_HullNormal& closed = message.normals._buffer[1];
  EXPECT_EQ(closed.kind, fivepipe_v1_closed_form);
  EXPECT_EQ(closed.status, fivepipe_v1_normal_defined);
  ASSERT_EQ(closed.cameras._length, 2u);
  EXPECT_STREQ(closed.cameras._buffer[0].camera, "right");
  EXPECT_STREQ(closed.cameras._buffer[1].camera, "left");
  EXPECT_EQ(closed.cameras._buffer[1].normal.y, 1);
}

TEST(CollisionMessage, ProximityBoundsRoundOutwardToFloat) {
  CollisionReport report = report_of(collision::CollisionVerdict::free);
  const double third = 1.0 / 3, inf = std::numeric_limits<double>::infinity();
  report.details.proximity = {{third, third},
                              {0.7, 0.7},
                              {0, 0},
                              {0, inf},
                              {inf, inf}};  // float rounds 1/3 up and 0.7 down
  config::CollisionRequests requests;
  requests.proximity = config::ProximityRequests{config::ProximityOf::triangles, 0.1, 0.01};
  OutgoingCollision out = collision_message(kFrame, report, requests);
  const fivepipe_v1_CollisionResult& message = out.message();
  ASSERT_EQ(message.proximity._length, 1u);
  const fivepipe_v1_ProximityField& field = message.proximity._buffer[0];
  EXPECT_EQ(field.of, fivepipe_v1_of_triangles);
  EXPECT_EQ(field.cap_m, 0.1);
  ASSERT_EQ(field.min_m._length, 5u);
  ASSERT_EQ(field.max_m._length, 5u);
  for (std::uint32_t i = 0; i < 5; ++i) {
    EXPECT_LE(double(field.min_m._buffer[i]), report.details.proximity[i].min_m);
    EXPECT_GE(double(field.max_m._buffer[i]), report.details.proximity[i].max_m);
    if (std::isfinite(report.details.proximity[i].min_m)) {
      EXPECT_NEAR(field.min_m._buffer[i], report.details.proximity[i].min_m, 1e-7);
    }
  }
  EXPECT_EQ(field.min_m._buffer[2], 0);
  EXPECT_EQ(field.max_m._buffer[2], 0);
}

TEST(CollisionMessage, FirstContactUsesTheCaptureClock) {
  CollisionReport report = report_of(collision::CollisionVerdict::free);
  report.details.first_contact = ComponentContact{{2.49, 0.0005, {0.1, 0.2, 0.3}, 4, false}, 11};
  OutgoingCollision out = collision_message(kFrame, report, {});
  const fivepipe_v1_CollisionResult& message = out.message();
  ASSERT_EQ(message.first_contact._length, 1u);
  const fivepipe_v1_FirstContact& contact = message.first_contact._buffer[0];
  EXPECT_NEAR(double(contact.stamp_ns - kFrame.capture_stamp_ns), -1e7,
              2);  // 10 ms before the frame
  EXPECT_EQ(contact.error_ns, 500'000u);
  EXPECT_EQ(contact.component, 11u);
  EXPECT_EQ(contact.triangle, 4u);
  EXPECT_EQ(contact.p_m.y, 0.2);
}

TEST(CollisionMessage, ContainsTrianglesAndContactsOnRequest) {
  CollisionReport report = report_of(collision::CollisionVerdict::colliding);
  report.details.contacts.emplace().contacts.push_back({.status = collision::ContactStatus::defined,
                                                        .on_object = {{1, 0, 0}, 3},
                                                        .depth_m = 0.004,
                                                        .camera = 1});
  report.details.contacts->contacts.push_back(
      {.status = collision::ContactStatus::no_exit_within_reach, .on_object = {{0, 1, 0}, 5}});
  report.details.local_minimum_translation = collision::LocalMinimumTranslation{
      .status = collision::LocalMinimumTranslationStatus::shorter_found,
      .translation_world_m = {0, 0, 0.02}};
  config::CollisionRequests requests;
  requests.triangles = true;
  OutgoingCollision out = collision_message(kFrame, report, requests);
  const fivepipe_v1_CollisionResult& message = out.message();
  ASSERT_EQ(message.triangles._length, 2u);
  EXPECT_EQ(message.triangles._buffer[1], 5u);
  ASSERT_EQ(message.triangles_undecided._length, 1u);
  EXPECT_EQ(message.triangles_undecided._buffer[0], 8u);
  ASSERT_EQ(message.contacts._length, 2u);
  EXPECT_STREQ(message.contacts._buffer[0].camera, "right");
  EXPECT_EQ(message.contacts._buffer[0].depth_m, 0.004);
  EXPECT_EQ(message.contacts._buffer[1].status, fivepipe_v1_contact_without_exit);
  EXPECT_STREQ(message.contacts._buffer[1].camera, "");
  ASSERT_EQ(message.local_minimum_translation._length, 1u);
  EXPECT_EQ(message.local_minimum_translation._buffer[0].status, fivepipe_v1_shorter_found);
  EXPECT_EQ(message.local_minimum_translation._buffer[0].translation_m.z, 0.02);
}

TEST(ComponentsMessage, ReportsIdentityAndMotion) {
  collision::TrackedComponent tracked{
      .id = 3, .origin = collision::ComponentOrigin::tracked, .from = {3}};
  tracked.component.box_world_m = {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 2, 3)};
  tracked.component.centroid_world_m = {0.4, 0.5, 0.6};
  tracked.component.volume_m3 = 0.002;
  tracked.component.clipped = true;
  tracked.motion = collision::ComponentMotion{.velocity_world_m_s = {0, 0.5, 0},
                                              .angular_velocity_world_rad_s = {0, 0, 3},
                                              .determined_axes = 2,
                                              .residual_m = 0.001,
                                              .window_s = 0.1,
                                              .frames = 6};
  const collision::TrackedComponent merged{
      .id = 4, .origin = collision::ComponentOrigin::merged, .from = {1, 2}};
  OutgoingComponents out = components_message("simulation", kFrame, {tracked, merged});
  const fivepipe_v1_HullComponents& message = out.message();
  EXPECT_STREQ(message.simulation, "simulation");
  EXPECT_EQ(message.capture_stamp_ns, kFrame.capture_stamp_ns);
  ASSERT_EQ(message.components._length, 2u);
  ASSERT_EQ(message.components._buffer[0].from._length, 1u);
  EXPECT_EQ(message.components._buffer[0].from._buffer[0], 3u);
  EXPECT_EQ(message.components._buffer[0].frames, 6);
  EXPECT_EQ(message.components._buffer[0].velocity_m_s.y, 0.5);
  EXPECT_EQ(message.components._buffer[0].determined_axes, 2);
  EXPECT_EQ(message.components._buffer[0].box_max_m.z, 3);
  EXPECT_EQ(message.components._buffer[0].box_min_m.z, 0);
  EXPECT_EQ(message.components._buffer[0].centroid_m.y, 0.5);
  EXPECT_EQ(message.components._buffer[0].volume_m3, 0.002);
  EXPECT_TRUE(message.components._buffer[0].clipped);
  EXPECT_FALSE(message.components._buffer[1].clipped);
  EXPECT_EQ(message.components._buffer[0].angular_velocity_rad_s.z, 3);
  EXPECT_EQ(message.components._buffer[0].residual_m, 0.001);
  EXPECT_EQ(message.components._buffer[0].window_s, 0.1);
  EXPECT_EQ(message.components._buffer[1].origin, fivepipe_v1_component_merged);
  EXPECT_EQ(message.components._buffer[1].frames, 0);
  ASSERT_EQ(message.components._buffer[1].from._length, 2u);
  EXPECT_EQ(message.components._buffer[1].from._buffer[1], 2u);
}

TEST(CollisionMessage, ContainsEveryFieldOfTheResponse) {
  CollisionReport report = report_of(collision::CollisionVerdict::colliding);
  report.truncated = true;
  collision::Response& response = report.response.emplace();
  response.status = collision::RecoveryStatus::still_colliding;
  response.cp_object_world_m = {1, 2, 3};
  response.v_rec_world = {0, 0.6, 0.8};
  response.cp_hull_world_m = {4, 5, 6};
  response.d_rec_m = 0.01;
  response.d_rec_error_m = 0.002;
  response.residual_m = 0.003;
  response.four_points = {.status = collision::NormalStatus::defined,
                          .normal_world = {0.6, 0, 0.8},
                          .error_rad = 0.04,
                          .cameras = {{1, {0, 0.8, 0.6}, 0.05, 0}}};
  response.closed_form = {.status = collision::NormalStatus::no_border,
                          .normal_world = {0, 1, 0},
                          .error_rad = 0.07,
                          .cameras = {{0, {1, 0, 0}, 0.06, 0}, {2, {0, 0, 1}, 0.08, 0}}};
  OutgoingCollision out = collision_message(kFrame, report, {});
  const fivepipe_v1_CollisionResult& message = out.message();
  EXPECT_EQ(message.frame, kFrame.frame);
  EXPECT_EQ(message.capture_stamp_ns, kFrame.capture_stamp_ns);
  EXPECT_TRUE(message.points_truncated);
  EXPECT_EQ(message.response, fivepipe_v1_still_colliding);
  EXPECT_TRUE(is(message.cp_object_m, {1, 2, 3}));
  EXPECT_TRUE(is(message.v_rec, {0, 0.6, 0.8}));
  EXPECT_TRUE(is(message.cp_hull_m, {4, 5, 6}));
  EXPECT_EQ(message.d_rec_m, 0.01);
  EXPECT_EQ(message.d_rec_error_m, 0.002);
  EXPECT_EQ(message.residual_m, 0.003);
  ASSERT_EQ(message.normals._length, 2u);
  const fivepipe_v1_HullNormal &four = message.normals._buffer[0],
                               &closed = message.normals._buffer[1];
  EXPECT_EQ(four.kind, fivepipe_v1_four_points);
  EXPECT_EQ(four.status, fivepipe_v1_normal_defined);
  EXPECT_TRUE(is(four.n_hull, {0.6, 0, 0.8}));
  EXPECT_EQ(four.error_rad, 0.04);
  ASSERT_EQ(four.cameras._length, 1u);
  EXPECT_STREQ(four.cameras._buffer[0].camera, "right");
  EXPECT_TRUE(is(four.cameras._buffer[0].normal, {0, 0.8, 0.6}));
  EXPECT_EQ(four.cameras._buffer[0].error_rad, 0.05);
  EXPECT_EQ(closed.kind, fivepipe_v1_closed_form);
  EXPECT_EQ(closed.status, fivepipe_v1_normal_undefined);
  EXPECT_TRUE(is(closed.n_hull, {0, 1, 0}));
  EXPECT_EQ(closed.error_rad, 0.07);
  ASSERT_EQ(closed.cameras._length, 2u);
  EXPECT_STREQ(closed.cameras._buffer[0].camera, "left");
  EXPECT_STREQ(closed.cameras._buffer[1].camera, "") << "there is no such camera";
}

TEST(CollisionMessage, TheResponseOfTheDetailsHasPriority) {
  CollisionReport report = report_of(collision::CollisionVerdict::colliding);
  report.response.emplace().status = collision::RecoveryStatus::recovered;
  report.details.response.emplace().status = collision::RecoveryStatus::reference_inside;
  OutgoingCollision out = collision_message(kFrame, report, {});
  EXPECT_EQ(out.message().response, fivepipe_v1_reference_inside);
  EXPECT_EQ(out.message().normals._length, 0u) << "not requested";
}

TEST(CollisionMessage, HasEveryStatus) {
  using collision::RecoveryStatus;
  for (const auto& [status, expected] :
       {std::pair{RecoveryStatus::recovered, fivepipe_v1_recovered},
        {RecoveryStatus::still_colliding, fivepipe_v1_still_colliding},
        {RecoveryStatus::reference_inside, fivepipe_v1_reference_inside},
        {RecoveryStatus::no_exit_within_reach, fivepipe_v1_no_exit_within_reach},
        {RecoveryStatus::direction_undefined, fivepipe_v1_direction_undefined},
        {RecoveryStatus::no_collision_point, fivepipe_v1_no_response}}) {
    CollisionReport report = report_of(collision::CollisionVerdict::colliding);
    report.response.emplace().status = status;
    EXPECT_EQ(collision_message(kFrame, report, {}).message().response, expected);
  }
  using collision::LocalMinimumTranslationStatus;
  for (const auto& [status, expected] :
       {std::pair{LocalMinimumTranslationStatus::shorter_found, fivepipe_v1_shorter_found},
        {LocalMinimumTranslationStatus::none_shorter_found, fivepipe_v1_none_shorter_found},
        {LocalMinimumTranslationStatus::none_verified, fivepipe_v1_none_verified}}) {
    CollisionReport report = report_of(collision::CollisionVerdict::colliding);
    report.details.local_minimum_translation.emplace().status = status;
    OutgoingCollision out = collision_message(kFrame, report, {});
    EXPECT_EQ(out.message().local_minimum_translation._buffer[0].status, expected);
  }
  EXPECT_EQ(collision_message(kFrame, report_of(collision::CollisionVerdict::undecided), {})
                .message()
                .verdict,
            fivepipe_v1_undecided);
  CollisionReport colliding = report_of(collision::CollisionVerdict::colliding);
  colliding.collision.hull_in_box = true;
  EXPECT_EQ(collision_message(kFrame, colliding, {}).message().verdict, fivepipe_v1_colliding);
}

TEST(CollisionMessage, ContainsEveryFieldOfAContact) {
  CollisionReport report = report_of(collision::CollisionVerdict::colliding);
  report.details.contacts.emplace().contacts = {
      {.status = collision::ContactStatus::no_border,
       .on_object = {{1, 2, 3}, 9},
       .on_hull_world_m = {4, 5, 6},
       .normal_world = {0.6, 0.8, 0},
       .depth_m = 0.004,
       .depth_error_m = 0.001,
       .normal_error_rad = 0.02,
       .camera = 0},
      {.status = collision::ContactStatus::defined, .on_object = {{0, 1, 0}, 5}, .camera = 2}};
  OutgoingCollision out = collision_message(kFrame, report, {});
  const fivepipe_v1_CollisionResult& message = out.message();
  EXPECT_EQ(message.triangles._length, 0u) << "not requested";
  ASSERT_EQ(message.contacts._length, 2u);
  const fivepipe_v1_Contact &first = message.contacts._buffer[0],
                            &second = message.contacts._buffer[1];
  EXPECT_EQ(first.status, fivepipe_v1_contact_without_border);
  EXPECT_EQ(first.triangle, 9u);
  EXPECT_TRUE(is(first.on_object_m, {1, 2, 3}));
  EXPECT_TRUE(is(first.on_hull_m, {4, 5, 6}));
  EXPECT_TRUE(is(first.normal, {0.6, 0.8, 0}));
  EXPECT_EQ(first.depth_m, 0.004);
  EXPECT_EQ(first.depth_error_m, 0.001);
  EXPECT_EQ(first.normal_error_rad, 0.02);
  EXPECT_STREQ(first.camera, "left");
  EXPECT_EQ(second.status, fivepipe_v1_contact_defined);
  EXPECT_STREQ(second.camera, "") << "there is no such camera";
}

TEST(MetricsMessage, ContainsEveryFieldOfTheKindsThatTheSceneHas) {
  SimulationMetrics metrics;
  EXPECT_EQ(metrics_message("sim", 1, 2, 0, metrics).message().bodies._length, 0u);
  metrics.bodies = {
      .bodies = 3, .energy = {1.5, -2.5}, .hull = {4, 0.001}, .each_other = {5, 0.002}};
  metrics.cloths = {.cloths = 6, .energy = {3.5, -4.5}, .hull = {7, 0.003}};
  metrics.particles = {.particles = 8, .hull_contacts = 9};
  OutgoingMetrics out = metrics_message("sim", 10, 11, 12.5, metrics);
  const fivepipe_v1_SimulationMetrics& message = out.message();
  EXPECT_STREQ(message.simulation, "sim");
  EXPECT_EQ(message.frame, 10u);
  EXPECT_EQ(message.capture_stamp_ns, 11);
  EXPECT_EQ(message.simulation_time_s, 12.5);
  ASSERT_EQ(message.bodies._length, 1u);
  const fivepipe_v1_BodyMetrics& bodies = message.bodies._buffer[0];
  EXPECT_EQ((std::vector{bodies.bodies, bodies.hull_contacts, bodies.body_contacts}),
            (std::vector<std::uint32_t>{3, 4, 5}));
  EXPECT_EQ((std::vector{bodies.kinetic_j, bodies.potential_j, bodies.deepest_in_hull_m,
                         bodies.deepest_in_body_m}),
            (std::vector{1.5, -2.5, 0.001, 0.002}));
  ASSERT_EQ(message.cloths._length, 1u);
  const fivepipe_v1_ClothMetrics& cloths = message.cloths._buffer[0];
  EXPECT_EQ(cloths.cloths, 6u);
  EXPECT_EQ(cloths.hull_contacts, 7u);
  EXPECT_EQ((std::vector{cloths.kinetic_j, cloths.potential_j, cloths.deepest_in_hull_m}),
            (std::vector{3.5, -4.5, 0.003}));
  ASSERT_EQ(message.particles._length, 1u);
  EXPECT_EQ(message.particles._buffer[0].particles, 8u);
  EXPECT_EQ(message.particles._buffer[0].hull_contacts, 9u);
}

TEST(CollisionMessage, ProximityNamesWhatItIsOf) {
  config::CollisionRequests requests;
  requests.proximity = config::ProximityRequests{config::ProximityOf::vertices, 0.1, 0.01};
  OutgoingCollision out =
      collision_message(kFrame, report_of(collision::CollisionVerdict::free), requests);
  ASSERT_EQ(out.message().proximity._length, 1u);
  EXPECT_EQ(out.message().proximity._buffer[0].of, fivepipe_v1_of_vertices);
  EXPECT_EQ(out.message().proximity._buffer[0].min_m._length, 0u);
}

TEST(CollisionMessage, FirstContactKeepsItsErrorAndWhetherItIsCoarse) {
  for (const bool coarse : {false, true}) {
    CollisionReport report = report_of(collision::CollisionVerdict::free);
    report.details.first_contact =
        ComponentContact{{2.75, 1.25e-9, {0.1, 0.2, 0.3}, 4, coarse}, 11};
    OutgoingCollision out = collision_message(kFrame, report, {});
    const fivepipe_v1_FirstContact& contact = out.message().first_contact._buffer[0];
    EXPECT_EQ(contact.stamp_ns, kFrame.capture_stamp_ns + 250'000'000);
    EXPECT_EQ(contact.error_ns, 2u) << "rounded up";
    EXPECT_EQ(contact.coarse, coarse);
    EXPECT_TRUE(is(contact.p_m, {0.1, 0.2, 0.3}));
  }
}

TEST(ComponentsMessage, HasEveryField) {
  using collision::ComponentOrigin;
  std::vector<collision::TrackedComponent> components;
  for (const ComponentOrigin origin : {ComponentOrigin::appeared, ComponentOrigin::tracked,
                                       ComponentOrigin::merged, ComponentOrigin::split})
    components.push_back({.id = 5 + components.size(), .origin = origin, .from = {1}});
  components[0].from = {};
  components[1].component.centroid_world_m = {0.4, 0.5, 0.6};
  components[1].component.box_world_m = {Eigen::Vector3d(-1, -2, -3), Eigen::Vector3d(1, 2, 3)};
  components[1].motion = collision::ComponentMotion{
      .velocity_world_m_s = {1, 2, 3}, .angular_velocity_world_rad_s = {4, 5, 6}, .frames = 3};
  OutgoingComponents out = components_message("simulation", kFrame, components);
  const fivepipe_v1_HullComponents& message = out.message();
  EXPECT_EQ(message.frame, kFrame.frame);
  ASSERT_EQ(message.components._length, 4u);
  const fivepipe_v1_ComponentOrigin origins[] = {
      fivepipe_v1_component_appeared, fivepipe_v1_component_tracked, fivepipe_v1_component_merged,
      fivepipe_v1_component_split};
  for (std::size_t i = 0; i < 4; ++i) {
    const fivepipe_v1_HullComponent& component = message.components._buffer[i];
    EXPECT_EQ(component.id, 5 + i);
    EXPECT_EQ(component.origin, origins[i]);
    EXPECT_EQ(component.from._length, i == 0 ? 0u : 1u);
    EXPECT_EQ(component.frames, i == 1 ? 3 : 0);
  }
  const fivepipe_v1_HullComponent& tracked = message.components._buffer[1];
  EXPECT_EQ(tracked.from._buffer[0], 1u);
  EXPECT_TRUE(is(tracked.centroid_m, {0.4, 0.5, 0.6}));
  EXPECT_TRUE(is(tracked.box_min_m, {-1, -2, -3}));
  EXPECT_TRUE(is(tracked.box_max_m, {1, 2, 3}));
  EXPECT_TRUE(is(tracked.velocity_m_s, {1, 2, 3}));
  EXPECT_TRUE(is(tracked.angular_velocity_rad_s, {4, 5, 6}));
}

TEST(StateMessage, ContainsTheObjectsThatMoveOrAreWarmed) {
  config::Scene scene;
  scene.objects.resize(4);
  scene.objects[0].motion = config::Motion::dynamic;
  std::vector<ObjectState> states(4);
  for (std::size_t i = 0; i < 4; ++i) {
    states[i].name = "object " + std::to_string(i);
    states[i].world_from_object.translation() = Eigen::Vector3d(double(i), 2, 3);
  }
  states.emplace_back().warmth = {1.0f};  // removed again
  states.pop_back();
  states[2].warmth = {0.25f, 0.5f};
  states[3].vertices_m = {{1, 2, 3}, {4, 5, 6}};
  OutgoingState out = state_message("simulation", 7, 5'000, 2.5, scene, states);
  const fivepipe_v1_VirtualState& message = out.message();
  EXPECT_STREQ(message.simulation, "simulation");
  EXPECT_EQ(message.frame, 7u);
  EXPECT_EQ(message.capture_stamp_ns, 5'000);
  EXPECT_EQ(message.simulation_time_s, 2.5);
  const std::size_t sent[] = {0, 2, 3};  // the fixed object 1 is as in the scene
  ASSERT_EQ(message.objects._length, std::size(sent));
  for (std::size_t i = 0; i < std::size(sent); ++i) {
    const fivepipe_v1_ObjectState& object = message.objects._buffer[i];
    const ObjectState& state = states[sent[i]];
    EXPECT_EQ(object.object, state.name);
    EXPECT_EQ(messages::from_wire(object.world_from_object)->matrix(),
              state.world_from_object.matrix());
    const auto warmth = messages::span_of(object.warmth),
               vertices = messages::span_of(object.vertices_m);
    EXPECT_EQ(std::vector<float>(warmth.begin(), warmth.end()), state.warmth);
    EXPECT_EQ(std::vector<float>(vertices.begin(), vertices.end()),
              i == 2 ? std::vector<float>({1, 2, 3, 4, 5, 6}) : std::vector<float>());
  }
}

TEST(Command, IsExecutedByItsTargetOrByAllNodes) {
  config::Scene scene;
  scene.objects.push_back({.name = "ball",
                           .shape = config::SphereShape{0.1},
                           .motion = config::Motion::dynamic,
                           .mass_kg = 1});
  for (const auto& [target, node, is_executed] : {std::tuple{"", "simulation", true},
                                                  {"simulation", "simulation", true},
                                                  {"s", "simulation", false},
                                                  {"s", "s", true},
                                                  {"simulation 2", "simulation", false}}) {
    Simulation simulation(scene, {});
    fivepipe_v1_Command command{};
    messages::set_text(command.target, target);
    double time_s = 0;
    const auto fall_m = [&] {  // in a tenth of a second
      const double before_m = simulation.states()[0].world_from_object.translation().z();
      simulation.advance_to(time_s += 0.1);
      return before_m - simulation.states()[0].world_from_object.translation().z();
    };
    simulation.advance_to(0);
    EXPECT_GT(fall_m(), 0.01);
    command.kind = fivepipe_v1_pause_simulation;
    apply(command, node, simulation);
    EXPECT_EQ(fall_m() == 0, is_executed) << target;
    command.kind = fivepipe_v1_resume_simulation;
    apply(command, node, simulation);
    EXPECT_GT(fall_m(), 0.01);
    command.kind = fivepipe_v1_reset_simulation;
    apply(command, node, simulation);
    EXPECT_EQ(simulation.states()[0].world_from_object.translation().z() == 0, is_executed)
        << target;
  }
}

TEST(ParticlesMessage, HasThePlacesOfAllParticles) {
  ParticleSet particles;
  particles.add({1, 2, 3}, {0, 0, 0}, 0);
  particles.add({4, 5, 6}, {0, 0, 0}, 0);
  OutgoingParticles out = particles_message("grains", 7, 5'000'000'000, particles);
  const fivepipe_v1_Particles& message = out.message();
  EXPECT_STREQ(message.source, "grains");
  EXPECT_EQ(message.frame, 7u);
  EXPECT_EQ(message.capture_stamp_ns, 5'000'000'000);
  const auto p_m = messages::span_of(message.p_m);
  EXPECT_EQ(std::vector<float>(p_m.begin(), p_m.end()), (std::vector<float>{1, 2, 3, 4, 5, 6}));
}

}  // namespace
}  // namespace fivepipe::sim
