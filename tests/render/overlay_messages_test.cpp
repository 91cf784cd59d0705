// Conversion of collision results to the marks of the overlays.
#include <gtest/gtest.h>

#include <cmath>

#include "common/config/sim_config.h"
#include "render_node/overlays/messages_marks.h"
#include "tests/support/not_finite.h"

namespace fivepipe::render {
namespace {

using config::Overlay;

// A box of which everything is shown, and a valid message of it.
struct ShownCollision {
  config::Scene scene;
  OverlaidObject object;
  fivepipe_v1_CollisionResult message{};
  std::vector<fivepipe_v1_Vec3> points_m{{1, 2, 3}, {4, 5, 6}};
  std::vector<fivepipe_v1_HullNormal> normals{2};
  std::vector<fivepipe_v1_ProximityField> fields{1};
  std::vector<float> min_m, max_m;

  explicit ShownCollision(config::ProximityOf of = config::ProximityOf::vertices) {
    scene.objects.resize(2);
    scene.objects[0].name = "scenery";
    scene.objects[0].shape = scene.objects[1].shape = config::BoxShape{{1, 1, 1}};
    scene.objects[0].reaction = config::Reaction::none;
    scene.objects[1].name = "box";
    config::ResponseRequests& response = scene.objects[1].requests.response.emplace();
    response.four_points = response.closed_form = true;
    scene.objects[1].requests.proximity = {.of = of};
    scene.overlays = {Overlay::collision_points, Overlay::recovery, Overlay::hull_normals,
                      Overlay::proximity};
    object = overlaid_objects(scene).at("box");
    messages::set_text(message.object, "box");
    message.response = fivepipe_v1_recovered;
    message.cp_object_m = {0.1, 0.2, 0.3};
    message.cp_hull_m = {0.4, 0.5, 0.6};
    normals[0] = {fivepipe_v1_four_points, fivepipe_v1_normal_defined, {0.6, 0.8, 0}, 0, {}};
    normals[1] = {fivepipe_v1_closed_form, fivepipe_v1_normal_defined, {0, 0, -1}, 0, {}};
    fields[0].of =
        of == config::ProximityOf::vertices ? fivepipe_v1_of_vertices : fivepipe_v1_of_triangles;
    fields[0].cap_m = 0.2;
    min_m.assign(object.proximity_values(), 0.05f);
    max_m.assign(object.proximity_values(), 0.06f);
  }
  messages::Received<CollisionMarks> received() {
    messages::borrow(message.points_m, points_m);
    messages::borrow(message.normals, normals);
    for (fivepipe_v1_ProximityField& field : fields) {
      messages::borrow(field.min_m, min_m);
      messages::borrow(field.max_m, max_m);
    }
    messages::borrow(message.proximity, fields);
    return marks_from(message, object);
  }
  CollisionMarks marks() { return std::get<CollisionMarks>(received()); }
  // The detail of the drop; empty if the message is valid.
  std::string refusal() {
    const auto result = received();
    const auto* bad = std::get_if<messages::BadMessage>(&result);
    if (!bad) return "";
    EXPECT_EQ(bad->reason, "bad_collision");
    EXPECT_EQ(bad->subject, "box");
    return bad->detail;
  }
};

TEST(OverlayMessages, MarksHaveEveryFieldOfTheirMessage) {
  ShownCollision shown;
  shown.min_m[3] = std::nextafter(0.2f, 0.0f), shown.max_m[3] = float(test::kInfinity);
  const CollisionMarks marks = shown.marks();
  EXPECT_EQ(marks.object, 1u);
  EXPECT_EQ(marks.points_world_m,
            (std::vector<Eigen::Vector3f>{Eigen::Vector3f(1, 2, 3), Eigen::Vector3f(4, 5, 6)}));
  ASSERT_TRUE(marks.recovery);
  EXPECT_EQ(marks.recovery->cp_object_world_m, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(marks.recovery->cp_hull_world_m, Eigen::Vector3d(0.4, 0.5, 0.6));
  EXPECT_FALSE(marks.recovery->still_colliding);
  ASSERT_EQ(marks.hull_normals.size(), 2u);
  EXPECT_EQ(marks.hull_normals[0].cp_hull_world_m, Eigen::Vector3d(0.4, 0.5, 0.6));
  EXPECT_EQ(marks.hull_normals[0].n_hull_world, Eigen::Vector3d(0.6, 0.8, 0));
  EXPECT_FALSE(marks.hull_normals[0].is_closed_form);
  EXPECT_EQ(marks.hull_normals[1].n_hull_world, Eigen::Vector3d(0, 0, -1));
  EXPECT_TRUE(marks.hull_normals[1].is_closed_form);
  ASSERT_EQ(marks.proximity.size(), 8u);
  EXPECT_NEAR(marks.proximity[0], 0.25, 1e-6);
  EXPECT_EQ(marks.proximity[3], 1);
  shown.message.response = fivepipe_v1_still_colliding;
  EXPECT_TRUE(shown.marks().recovery->still_colliding);
}

TEST(OverlayMessages, ProximityOfTrianglesHasOneValuePerTriangle) {
  ShownCollision shown(config::ProximityOf::triangles);
  EXPECT_EQ(shown.marks().proximity.size(), 12u);
}

TEST(OverlayMessages, WithoutAnExitThereIsNoRecovery) {
  ShownCollision shown;
  for (fivepipe_v1_HullNormal& normal : shown.normals) normal.status = fivepipe_v1_normal_undefined;
  shown.message.cp_hull_m.x = test::kNaN;
  for (const auto status : {fivepipe_v1_no_response, fivepipe_v1_reference_inside,
                            fivepipe_v1_no_exit_within_reach, fivepipe_v1_direction_undefined}) {
    shown.message.response = status;
    EXPECT_FALSE(shown.marks().recovery);
    EXPECT_TRUE(shown.marks().hull_normals.empty());
  }
}

// A field that is not shown has no effect, even if it is invalid.
TEST(OverlayMessages, OnlyWhatIsShownIsRead) {
  ShownCollision shown;
  shown.min_m[0] = float(test::kNaN);
  shown.message.cp_object_m.y = test::kInfinity;
  EXPECT_NE(shown.refusal(), "");
  shown.object.shown = {Overlay::collision_points};
  const CollisionMarks marks = shown.marks();
  EXPECT_EQ(marks.points_world_m.size(), 2u);
  EXPECT_FALSE(marks.recovery);
  EXPECT_TRUE(marks.hull_normals.empty() && marks.proximity.empty());
}

TEST(OverlayMessages, NumbersThatAreNotFiniteOrTooFarAreRefused) {
  for (const double bad : {test::kNaN, test::kInfinity, -test::kInfinity, 1.1 * kMaxCoordinate_m}) {
    ShownCollision shown;
    shown.points_m[1].z = bad;
    EXPECT_EQ(shown.refusal(), "collision point not finite or too far");
    shown = ShownCollision();
    shown.message.cp_object_m.x = bad;
    EXPECT_EQ(shown.refusal(), "CP_obj not finite or too far");
    shown = ShownCollision();
    shown.message.cp_hull_m.y = bad;
    EXPECT_EQ(shown.refusal(), "CP_hull not finite or too far");
    shown.object.shown = {Overlay::hull_normals};
    EXPECT_EQ(shown.refusal(), "CP_hull not finite or too far");
    shown = ShownCollision();
    shown.normals[0].n_hull.x = bad;
    EXPECT_EQ(shown.refusal(), "normal is not a unit vector");
    shown = ShownCollision();
    shown.min_m[2] = float(bad);
    EXPECT_EQ(shown.refusal(), "bounds of proximity not valid");
    shown = ShownCollision();
    shown.fields[0].cap_m = bad;
    EXPECT_EQ(shown.refusal(), "cap of proximity not valid");
  }
}

TEST(OverlayMessages, MoreThanTheSceneCanHaveIsRefused) {
  ShownCollision shown;
  shown.points_m.resize(config::kMaxCollisionPoints);
  EXPECT_EQ(shown.refusal(), "");
  shown.points_m.emplace_back();
  EXPECT_EQ(shown.refusal(), "1000001 collision points are too many");
  shown = ShownCollision();
  shown.normals.push_back(shown.normals[1]);
  EXPECT_EQ(shown.refusal(), "two normals of one kind");
  shown = ShownCollision();
  shown.fields.resize(2, shown.fields[0]);
  EXPECT_EQ(shown.refusal(), "more than one proximity field");
  shown = ShownCollision();
  shown.min_m.pop_back();
  EXPECT_EQ(shown.refusal(), "7 and 8 bounds of proximity for 8 vertices");
  shown.min_m.resize(8);
  shown.max_m.push_back(1);
  EXPECT_EQ(shown.refusal(), "8 and 9 bounds of proximity for 8 vertices");
}

TEST(OverlayMessages, ContradictionsAreRefused) {
  ShownCollision shown;
  shown.message.response = fivepipe_v1_no_exit_within_reach;
  EXPECT_EQ(shown.refusal(), "normal without CP_hull");
  shown = ShownCollision();
  shown.normals[1].n_hull = {0, 0, 1.01};
  EXPECT_EQ(shown.refusal(), "normal is not a unit vector");
  shown = ShownCollision();
  shown.fields[0].of = fivepipe_v1_of_triangles;
  EXPECT_EQ(shown.refusal(), "proximity is not of what the scene requests");
  shown = ShownCollision();
  shown.fields[0].cap_m = 0;
  EXPECT_EQ(shown.refusal(), "cap of proximity not valid");
  const std::pair<float, float> bounds_m[] = {
      {-0.01f, 0.1f}, {0.1f, 0.05f}, {0.1f, float(test::kNaN)}, {0.21f, 0.3f}};
  for (const auto& [min_m, max_m] : bounds_m) {
    shown = ShownCollision();
    shown.min_m[7] = min_m, shown.max_m[7] = max_m;
    EXPECT_EQ(shown.refusal(), "bounds of proximity not valid") << min_m << ' ' << max_m;
  }
}

TEST(OverlayMessages, OnlyObjectsThatReportAnOverlayAreOverlaid) {
  ShownCollision shown;
  config::Scene& scene = shown.scene;
  EXPECT_EQ(overlaid_objects(scene).size(), 1u);
  scene.objects[0].reaction = config::Reaction::highlight;
  EXPECT_EQ(overlaid_objects(scene).at("scenery").shown, std::set{Overlay::collision_points});
  EXPECT_TRUE(overlaid_objects(scene).at("scenery").mesh.vertices_m.empty());
  EXPECT_EQ(overlaid_objects(scene).at("box").shown, scene.overlays);
  scene.overlays = {};
  EXPECT_TRUE(overlaid_objects(scene).empty());
}

}  // namespace
}  // namespace fivepipe::render
