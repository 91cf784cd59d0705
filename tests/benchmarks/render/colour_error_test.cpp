// The error of the avatar's colour, with known differences and points that no camera sees.
#include "benchmarks/render/errors/colour_error.h"

#include "capture_node/synthetic/surroundings.h"
#include "common/base/timing.h"
#include "tests/benchmarks/render/small_view.h"

namespace fivepipe::render_bench {
namespace {

class ColourError : public SmallView {
 protected:
  // The ball with one colour.
  Drawn drawn(const cv::Vec3b& bgr) {
    AvatarRenderer renderer(viewer_);
    render::HullFrame hull = true_surface(ball(), view_);
    for (std::size_t i = 0; i < hull.depth_m.size(); ++i)
      hull.bgr.insert(hull.bgr.end(), {bgr[0], bgr[1], bgr[2]});
    return renderer.draw(hull);
  }
  cv::Mat truth(const cv::Vec3b& bgr) const {
    return {viewer_.render_height_px, viewer_.render_width_px, CV_8UC3,
            cv::Scalar(bgr[0], bgr[1], bgr[2])};
  }
  geometry::Camera at(const Vector3d& eye_m, const Vector3d& up = Vector3d::UnitZ()) const {
    return {image_.pinhole, geometry::look_at(eye_m, kBall_m, up)};
  }
};

TEST_F(ColourError, OfColoursThatAreOffByTwentyIsTwenty) {
  const std::vector<double> levels =
      colour_differences(drawn({120, 80, 60}), truth({100, 100, 60}), ball(), std::vector{image_});
  ASSERT_GT(levels.size(), 10'000u);
  for (std::size_t i = 0; i < levels.size(); ++i) ASSERT_EQ(levels[i], i % 3 == 2 ? 0 : 20) << i;
}

TEST_F(ColourError, CountsOnlyPointsThatACameraSees) {
  const auto pixels = [&](const std::vector<geometry::Camera>& cameras,
                          const std::vector<hull::Capsule>& object) {
    return colour_differences(drawn({1, 2, 3}), truth({1, 2, 3}), object, cameras).size() / 3;
  };
  const std::size_t all = pixels({image_}, ball());
  EXPECT_EQ(pixels({at({0, 3, 0})}, ball()), 0u) << "from behind";
  EXPECT_EQ(pixels({}, ball()), 0u);
  // A camera far to the left sees the left half, one to each side together see all.
  EXPECT_NEAR(double(pixels({at({-100, 1, 0})}, ball())), 0.5 * double(all), 0.03 * double(all));
  EXPECT_EQ(pixels({at({-1, -5, 0}), at({1, -5, 0})}, ball()), all);
  // Something in front of the left camera hides the ball from it.
  std::vector<hull::Capsule> with_screen = ball();
  with_screen.push_back({{-0.5, 1, -1}, {-0.5, 1, 1}, 0.2});
  EXPECT_EQ(pixels({at({-2, 1, 0})}, with_screen), 0u);
}

TEST_F(ColourError, OfTheActorsAvatarIsAtMostFiveLevels) {
  const config::Deployment deployment =
      config::load_deployment(FIVEPIPE_SOURCE_DIR "/launch/deployments/paper.yaml");
  Actor actor(deployment);
  const std::vector<double> levels = avatar_colour_differences(actor, actor.frames(1));
  EXPECT_GT(levels.size(), 10'000u);
  EXPECT_LE(base::percentile(levels, 0.5), 5);
}

TEST(TrueImage, ShowsTheActorAndItsRoom) {
  const config::Deployment deployment =
      config::load_deployment(FIVEPIPE_SOURCE_DIR "/launch/deployments/paper.yaml");
  const Actor actor(deployment);
  const ActorFrame frame = actor.frames(1).front();
  const cv::Mat image = true_image_bgr(deployment.viewer, actor.world(), frame,
                                       std::make_shared<const capture::Surroundings>(1));
  // The centre of the palm is skin, which is red; the room is not.
  const geometry::Camera eye{config::render_pinhole(deployment.viewer), frame.eye_from_world};
  const auto palm = geometry::project(eye, frame.object[1].a_world_m);
  ASSERT_TRUE(palm && is_in_image(eye, frame.object[1].a_world_m));
  const cv::Vec3b skin = image.at<cv::Vec3b>(int(palm->y()), int(palm->x()));
  EXPECT_GT(skin[2], skin[0] + 40);
  const cv::Vec3b room = image.at<cv::Vec3b>(5, 5);
  EXPECT_LT(std::abs(room[2] - room[0]), 60);
}

}  // namespace
}  // namespace fivepipe::render_bench
