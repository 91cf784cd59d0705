// The local minimum translation: shorter than V_rec, and verified.
#include "common/collision/response/local_minimum_translation.h"

#include <algorithm>
#include <iostream>
#include <stdexcept>

#include "common/collision/response/recovery.h"
#include "tests/support/collision/response.h"
#include "tests/support/not_finite.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

class LocalMinimumTranslationTest : public ResponseTest {
 protected:
  collision::LocalMinimumTranslation minimum(
      const collision::Response& response,
      const collision::LocalMinimumTranslationConfig& config = {}) {
    return collision::find_local_minimum_translation(query(), collision_, response, requery(),
                                                     config);
  }
};

double response_length_m(const collision::Response& response) {
  return response.clear_distance_m() + response.residual_m;
}

// Checks the properties of every result.
void expect_valid(const collision::LocalMinimumTranslation& result,
                  const collision::Response& response, const collision::Requery& requery) {
  EXPECT_NEAR(result.translation_world_m.norm(), result.length_m, 1e-12);
  if (result.status == collision::LocalMinimumTranslationStatus::none_verified) {
    EXPECT_EQ(result.length_m, 0);
    return;
  }
  EXPECT_TRUE(requery(result.translation_world_m).points.empty());
  EXPECT_LE(result.length_m, response_length_m(response) + response.pixel_footprint_m +
                                 2 * collision::kMaxRounding_m);
}

TEST_F(LocalMinimumTranslationTest, EscapesAPlaneAlongItsNormal) {
  see(plane_silhouettes());
  place({0.001, 0.0005, kVirtualRadius_m - 0.008});
  ASSERT_TRUE(collision_.colliding());
  double deepest_m = 0;
  for (const collision::CollisionPoint& point : collision_.points)
    deepest_m = std::max(deepest_m, -point.p_world_m.z());
  for (const Vector3d& v_rec : {Vector3d(1, 0, 1), Vector3d(0.3, -1, 0.7), Vector3d(-2, 1, 1)}) {
    const collision::Response response = respond_to({rp_object_m_, v_rec, {}, kFlatness_m});
    ASSERT_TRUE(response.has_exit());
    const collision::LocalMinimumTranslation result = minimum(response);
    expect_valid(result, response, requery());
    EXPECT_EQ(result.status, collision::LocalMinimumTranslationStatus::shorter_found);
    EXPECT_LT(angle_rad(result.translation_world_m, Vector3d(0, 0, 1)), 0.03);
    // The tolerance covers the minimum gain, and surface points between the samples.
    EXPECT_NEAR(result.length_m, deepest_m, 3e-4);
    EXPECT_LT(result.requeries, 32);
  }
}

TEST_F(LocalMinimumTranslationTest, IsTheResponseIfVRecIsOptimal) {
  see(plane_silhouettes());
  place({0, 0, kVirtualRadius_m - 0.008});
  const collision::Response response =
      respond_to({rp_object_m_, Vector3d(0, 0, 1), {}, kFlatness_m});
  ASSERT_EQ(response.status, collision::RecoveryStatus::recovered);
  const collision::LocalMinimumTranslation result = minimum(response);
  expect_valid(result, response, requery());
  EXPECT_EQ(result.status, collision::LocalMinimumTranslationStatus::none_shorter_found);
  EXPECT_EQ(result.length_m, response.clear_distance_m());
}

TEST_F(LocalMinimumTranslationTest, IsVerifiedAndNeverLonger) {
  Random random(61);
  int found = 0, cases = 0;
  double sum = 0;
  for (int i = 0; i < 12; ++i) {
    std::vector<hull::Capsule> real;
    for (int c = 0; c < 2; ++c)
      real.push_back({random_in_ball(random, 0.03), random_in_ball(random, 0.03),
                      uniform(random, 0.008, 0.02)});
    see(real);
    const Vector3d center = random_in_ball(random, 0.03), rp_object = random_in_ball(random, 0.03);
    place(collision::world_triangles(geometry::box_mesh({0.03, 0.02, 0.05}), at(center)),
          rp_object);
    if (!collision_.colliding()) continue;
    const collision::Response response = respond_to({rp_object_m_, random_direction(random)});
    if (!response.has_exit()) continue;
    const collision::LocalMinimumTranslation result = minimum(response);
    expect_valid(result, response, requery());
    EXPECT_LE(result.requeries, 32);
    ++cases;
    if (result.status != collision::LocalMinimumTranslationStatus::shorter_found) continue;
    ++found;
    sum += result.length_m / response_length_m(response);
    auto shuffled = collision_;
    std::shuffle(shuffled.points.begin(), shuffled.points.end(), random);
    EXPECT_EQ(collision::find_local_minimum_translation(query(), shuffled, response, requery())
                  .translation_world_m,
              result.translation_world_m);
  }
  std::cout << "shorter translations found in " << found << " of " << cases << ", on average "
            << sum / found << " of the response's length\n";
  EXPECT_GE(cases, 5);
  EXPECT_GE(found, cases / 2);
}

TEST_F(LocalMinimumTranslationTest, RespectsMaxRequeries) {
  see(plane_silhouettes());
  place({0, 0, kVirtualRadius_m - 0.008});
  const collision::Response response =
      respond_to({rp_object_m_, Vector3d(1, 0, 1), {}, kFlatness_m});
  int requeries = 0;
  const auto counting = [&](const Vector3d& move_m) { return ++requeries, moved(move_m); };
  for (const int max_requeries : {1, 2, 5}) {
    requeries = 0;
    const collision::LocalMinimumTranslation result = collision::find_local_minimum_translation(
        query(), collision_, response, counting, {.max_requeries = max_requeries});
    EXPECT_LE(requeries, max_requeries);
    EXPECT_EQ(requeries, result.requeries);
    expect_valid(result, response, requery());
  }
}

TEST_F(LocalMinimumTranslationTest, IsNotVerifiedIfTheObjectStaysStuck) {
  place({0, 0, 0.082});
  const collision::Response response = respond_by_default();
  ASSERT_TRUE(response.has_exit());
  const collision::ObjectCollision stuck = collision_;
  const collision::LocalMinimumTranslation result = collision::find_local_minimum_translation(
      query(), collision_, response, [&](const Vector3d&) { return stuck; });
  EXPECT_EQ(result.status, response.remaining_points.empty()
                               ? collision::LocalMinimumTranslationStatus::none_shorter_found
                               : collision::LocalMinimumTranslationStatus::none_verified);
  // By default 32 requeries.
  const collision::Response oblique =
      respond_to({rp_object_m_, Vector3d(2, 0, 1), {}, kFlatness_m});
  ASSERT_TRUE(oblique.has_exit());
  EXPECT_EQ(collision::find_local_minimum_translation(query(), collision_, oblique,
                                                      [&](const Vector3d&) { return stuck; })
                .requeries,
            32);
  collision::Response unfinished = response;
  unfinished.remaining_points = collision_.points;
  EXPECT_EQ(collision::find_local_minimum_translation(query(), collision_, unfinished,
                                                      [&](const Vector3d&) { return stuck; })
                .status,
            collision::LocalMinimumTranslationStatus::none_verified);
}

TEST_F(LocalMinimumTranslationTest, RequiresAnExit) {
  place({0, 0, 0.082});
  EXPECT_THROW(minimum(collision::Response{}), std::invalid_argument);
  const collision::Response response = respond_by_default();
  EXPECT_THROW(minimum(response, {.max_requeries = 0}), std::invalid_argument);
  EXPECT_THROW(minimum(response, {.min_gain_m = kNaN}), std::invalid_argument);
  EXPECT_THROW(collision::find_local_minimum_translation(query(), collision_, response, {}),
               std::invalid_argument);
}

// Points of a ball, of which those in the hull collide. The descent is deterministic, so each of
// its directions, limits and steps changes these numbers.
TEST(LocalMinimumTranslation, DescentOfPointsKeepsItsValues) {
  struct Case {
    collision::LocalMinimumTranslationStatus status;
    int requeries;
    double length_m;
  };
  using collision::LocalMinimumTranslationStatus;
  const Case cases[] = {
      {LocalMinimumTranslationStatus::shorter_found, 5, 0.01470305413919},
      {LocalMinimumTranslationStatus::shorter_found, 5, 0.01671736614303},
      {LocalMinimumTranslationStatus::shorter_found, 8, 0.01428093338871},
      {LocalMinimumTranslationStatus::shorter_found, 5, 0.031752692014},
      {LocalMinimumTranslationStatus::shorter_found, 2, 0.006927607096638},
      {LocalMinimumTranslationStatus::shorter_found, 3, 0.008615676926619},
  };
  for (int scene = 0; scene < 6; ++scene) {
    Random random(std::uint64_t(700 + scene));
    const auto silhouettes = silhouettes_of(
        {{random_in_ball(random, 0.03), random_in_ball(random, 0.03), uniform(random, 0.01, 0.02)},
         {random_in_ball(random, 0.03), random_in_ball(random, 0.03), uniform(random, 0.01, 0.02)}},
        ring(5, 1.0, 0.3, 320, 0.16));
    const Queries q(silhouettes);
    const Vector3d center = 0.03 * random_direction(random);
    std::vector<Vector3d> surface;
    for (int i = 0; i < 400; ++i) surface.push_back(center + 0.02 * random_direction(random));
    const collision::Requery requery = [&](const Vector3d& move_m) {
      collision::ObjectCollision found;
      for (std::size_t i = 0; i < surface.size(); ++i)
        if (const Vector3d p = surface[i] + move_m; q.query.contains(p))
          found.points.push_back({p, std::uint32_t(i)});
      return found;
    };
    const collision::ObjectCollision collision = requery(kOrigin);
    ASSERT_FALSE(collision.points.empty()) << scene;
    const collision::Response response =
        collision::respond(q.query, collision,
                           {.rp_object_world_m = center,
                            .v_rec_world = Vector3d(center + 0.02 * random_direction(random))},
                           requery, {.height_m = 0.2});
    ASSERT_TRUE(response.has_exit()) << scene;
    const auto found =
        collision::find_local_minimum_translation(q.query, collision, response, requery);
    EXPECT_EQ(found.status, cases[scene].status) << scene;
    EXPECT_EQ(found.requeries, cases[scene].requeries) << scene;
    EXPECT_NEAR(found.length_m, cases[scene].length_m, 1e-10) << scene;
  }
}

}  // namespace
}  // namespace fivepipe::test
