// Distances of outlines and centroids, and the stages of registration, with known displacements.
#include "benchmarks/render/errors/registration.h"

#include <gmock/gmock.h>

#include <fstream>

#include "benchmarks/render/errors/published_latency.h"
#include "common/base/timing.h"
#include "tests/benchmarks/render/small_view.h"
#include "tests/support/test_folder.h"

namespace fivepipe::render_bench {
namespace {

using ::testing::HasSubstr;

double median(const std::vector<double>& values) { return base::percentile(values, 0.5); }
double p95(const std::vector<double>& values) { return base::percentile(values, 0.95); }

class Registration : public SmallView {
 protected:
  double focal_px_ = image_.pinhole.fx_px;
  ShownShape truth(const Vector3d& moved_m = Vector3d::Zero(),
                   double radius_m = kBallRadius_m) const {
    return true_shape(ball(moved_m, radius_m), image_);
  }
  ShownShape drawn(const Vector3d& moved_m = Vector3d::Zero(), double radius_m = kBallRadius_m) {
    AvatarRenderer renderer(viewer_);
    return shape_of(renderer.draw(true_surface(ball(moved_m, radius_m), view_)));
  }
  std::vector<double> outline_mm(const ShownShape& a, const ShownShape& b) const {
    return outline_distances_mm(a, b, focal_px_);
  }
  double centroid_mm(const ShownShape& a, const ShownShape& b) const {
    return centroid_distance_mm(a, b, focal_px_);
  }
};

// The outline of a ball is a circle, whose points are 10 mm * |cos(angle)| from the shifted one. In
// the image it moves by f * 10 mm / (Z - r^2 / Z), which is the depth of the outline.
TEST_F(Registration, OfAHullShiftedByTenMillimetresIsTen) {
  constexpr double shift_mm = 10;
  const double typical_mm = std::sqrt(0.5) * shift_mm;
  for (const Vector3d& shift_m : {Vector3d(0.01, 0, 0), Vector3d(0, 0, -0.01)}) {
    const std::vector<double> exact_mm = outline_mm(truth(shift_m), truth());
    EXPECT_NEAR(median(exact_mm), typical_mm, 0.1);
    EXPECT_NEAR(p95(exact_mm), shift_mm, 0.1);
    EXPECT_NEAR(centroid_mm(truth(shift_m), truth()), shift_mm, 0.05);
    // Pixels displace the outline by up to half of one.
    EXPECT_NEAR(median(outline_mm(drawn(shift_m), truth())), typical_mm, 0.5 * px_mm_);
    EXPECT_NEAR(p95(outline_mm(drawn(shift_m), truth())), shift_mm, 0.5 * px_mm_);
    EXPECT_NEAR(centroid_mm(drawn(shift_m), truth()), shift_mm, 0.2);
  }
}

TEST_F(Registration, OfAHullThatIsTooLargeIsInItsOutlineOnly) {
  const double radius_m = kBallRadius_m + 0.01;
  EXPECT_NEAR(median(outline_mm(truth({0, 0, 0}, radius_m), truth())), 10, 0.5);
  EXPECT_NEAR(median(outline_mm(drawn({0, 0, 0}, radius_m), truth())), 10, 0.5 * px_mm_);
  EXPECT_NEAR(centroid_mm(drawn({0, 0, 0}, radius_m), truth()), 0, 0.1);
}

TEST_F(Registration, OfTheObjectInItsPlaceIsBelowAPixel) {
  EXPECT_LT(median(outline_mm(truth(), truth())), 1e-6);
  EXPECT_LT(p95(outline_mm(drawn(), truth())), 0.75 * px_mm_);
  EXPECT_LT(median(outline_mm(drawn(), truth())), 0.4 * px_mm_);
  EXPECT_LT(centroid_mm(drawn(), truth()), 0.05 * px_mm_);
}

// A missing part is found from the true outline, an additional one from the drawn outline.
TEST_F(Registration, CountsPartsThatOnlyOneImageShows) {
  std::vector<hull::Capsule> two = ball();
  two.push_back(
      {kBall_m + Vector3d(0.25, 0, 0), kBall_m + Vector3d(0.25, 0, 0), kBallRadius_m / 3});
  const ShownShape more = true_shape(two, image_);
  EXPECT_GT(p95(outline_mm(more, truth())), 50);
  EXPECT_GT(p95(outline_mm(truth(), more)), 50);
}

TEST_F(Registration, OfNothingIsRefused) {
  AvatarRenderer renderer(viewer_);
  EXPECT_THROW(shape_of(renderer.draw(test::no_hull(eye_, view_.camera.pinhole))),
               std::runtime_error);
  EXPECT_THROW(truth({0, -5, 0}), std::runtime_error);
}

TEST_F(Registration, OfTheActorHasItsStages) {
  Actor actor(config::load_deployment(FIVEPIPE_SOURCE_DIR "/launch/deployments/paper.yaml"));
  const std::vector<RegistrationStage> stages = registration(actor, actor.frames(1), 0.03);
  ASSERT_EQ(stages.size(), 4u);
  EXPECT_EQ(stages[0].name, "renderer");
  EXPECT_LT(median(stages[0].outline_mm), 1.5);  // half a pixel of the reconstruction has 1.3 mm
  EXPECT_EQ(stages[3].name, "latency");
  // 30 mm of motion, with the displacement at rest. The arm leaves the image at its lower edge,
  // along which it moves; it is nearer than the hand and therefore moves by more pixels.
  EXPECT_NEAR(stages[3].centroid_mm[0], 30, stages[2].centroid_mm[0] + 2);
  EXPECT_LE(p95(stages[3].added_mm), 31);
  for (const RegistrationStage& stage : stages) EXPECT_GT(median(stage.added_mm), 0) << stage.name;
}

// The hull lacks what a camera does not see, and its outline is not that of the object.
TEST_F(Registration, ACameraThatDoesNotSeeTheWholeObjectIsRefused) {
  config::Deployment deployment =
      config::load_deployment(FIVEPIPE_SOURCE_DIR "/launch/deployments/paper.yaml");
  config::RigCamera& camera = deployment.rig.cameras.front();
  camera.published.fx_px = camera.source.fx_px *= 6;
  camera.published.fy_px = camera.source.fy_px *= 6;
  Actor actor(deployment);
  EXPECT_THROW(registration(actor, actor.frames(1), 0.03), std::runtime_error);
}

TEST(PublishedLatency, IsTheMedianOfDeploymentPaper) {
  const test::TestFolder folder;
  const auto file = folder.path / "paper_tiles.json";
  std::ofstream(file) << R"({"results": [
      {"name": "pipeline_with_capture/paper/capture", "time_ms": {"median": 2}},
      {"name": "pipeline_with_capture/paper/latency", "time_ms": {"median": 29.5}}]})";
  EXPECT_EQ(published_latency_ms(file), 29.5);
  EXPECT_GT(published_latency_ms(FIVEPIPE_SOURCE_DIR "/docs/benchmarks/paper_tiles.json"), 1);
}

TEST(PublishedLatency, OfAFileWithoutTheResultIsAnErrorThatNamesTheOption) {
  const test::TestFolder folder;
  const auto file = folder.path / "other.json";
  for (const char* text : {"", "{", "{}", R"({"results": []})", R"({"results": [{"name": 3}]})",
                           R"({"results": [{"name": "pipeline_with_capture/paper/latency"}]})"}) {
    std::ofstream(file) << text;
    try {
      published_latency_ms(file);
      ADD_FAILURE() << text;
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), HasSubstr(file.string())) << text;
      EXPECT_THAT(error.what(), HasSubstr("--latency-ms")) << text;
    }
  }
  EXPECT_THROW(published_latency_ms(folder.path / "none.json"), std::runtime_error);
}

}  // namespace
}  // namespace fivepipe::render_bench
