// Conversion to CollisionResult and HullComponents: the messages contain exactly what is requested.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

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

}  // namespace
}  // namespace fivepipe::sim
