// The reference composite agrees with the renderer, and finds a wrong order.
#include "benchmarks/render/errors/reference_composite.h"
#include "tests/benchmarks/render/small_view.h"

namespace fivepipe::render_bench {
namespace {

class Surfaces : public SmallView {
 protected:
  // A wall behind the ball, and a bar in front of its upper half.
  config::Scene scene_ = [] {
    config::Scene scene;
    scene.objects = {
        test::object("wall", config::BoxShape{{1, 0.1, 0.6}}, {0.1, 2, 0}, {0.1, 0.2, 0.3}),
        test::object("bar", config::BoxShape{{0.6, 0.1, 0.1}}, {0, 0.7, 0.06}, {1, 1, 0})};
    scene.particles.resize(1);
    scene.particles[0].radius_m = 0.016;
    return scene;
  }();
  // In front of the bar, inside the ball and behind the wall.
  std::vector<render::ParticleCloud> particles_{
      {0, {0.05f, 0.5f, 0.04f, 0.02f, 1.0f, 0.0f, 0.1f, 3.0f, 0.0f}}};
  std::vector<hull::Silhouette> silhouettes_ = silhouettes();
  render::HullFrame hull_ = reconstructed({silhouettes_, {}}, view_);
  ShownSurfaces shown_{scene_, viewer_};
  FrameReference reference_{scene_, viewer_, shown_.numbers(), hull_, silhouettes_};

  WrongPixels wrong(const render::HullFrame& hull) {
    return wrong_pixels(scene_, reference_, particles_, shown_.of(hull, particles_));
  }
  static int count(const cv::Mat& surfaces, int number) {
    int found = 0;
    for (int v = 0; v < surfaces.rows; ++v)
      for (int u = 0; u < surfaces.cols; ++u) found += surfaces.at<std::uint16_t>(v, u) == number;
    return found;
  }
  // Pixels at which the bar hides the hull.
  int hidden() const {
    ReferenceComposite alone(viewer_, eye_, shown_.numbers());
    alone.add_texels(hull_);
    const cv::Mat with = reference_.drawing.surfaces(), without = alone.surfaces();
    int found = 0;
    for (int v = 0; v < with.rows; ++v)
      for (int u = 0; u < with.cols; ++u)
        found += with.at<std::uint16_t>(v, u) == shown_.numbers().object(1) &&
                 without.at<std::uint16_t>(v, u) == shown_.numbers().hull;
    return found;
  }
};

// A pixel whose centre an edge passes within rounding may differ: one in 10,000.
constexpr double kRounding_percent = 0.01;

TEST_F(Surfaces, AllOfTheReferenceAreDrawn) {
  const SurfaceNumbers& numbers = shown_.numbers();
  const cv::Mat drawn = shown_.of(hull_, particles_);
  for (const int number : {SurfaceNumbers::kBackground, numbers.object(0), numbers.object(1),
                           numbers.particle(0), numbers.hull})
    EXPECT_GT(count(drawn, number), 100) << number;
  EXPECT_EQ(count(drawn, numbers.hull) + count(drawn, 0) + count(drawn, 1) + count(drawn, 2) +
                count(drawn, 3),
            320 * 240);
}

TEST_F(Surfaces, OfACorrectFrameDifferOnlyBesideOutlines) {
  const WrongPixels found = wrong(hull_);
  // Also the outline of the particle, which is drawn as if from far away.
  EXPECT_LT(found.drawing_percent(), kRounding_percent + 0.01);
  // The reconstruction has the image's pixels, so that its exact hull is that of the image.
  EXPECT_LT(found.percent(), kRounding_percent + 0.01);
  EXPECT_EQ(found.pixels, 320u * 240u);
}

TEST_F(Surfaces, AHullThatIsDrawnOnTopIsWrongWhereItMustBeHidden) {
  render::HullFrame on_top = hull_;
  for (float& depth_m : on_top.depth_m) depth_m *= 0.3f;
  const int expected = hidden();
  EXPECT_GT(expected, 500);
  const WrongPixels found = wrong(on_top);
  // The particle in front of the bar is now behind the hull, too.
  const int particle = count(shown_.of(hull_, particles_), shown_.numbers().particle(0));
  EXPECT_NEAR(double(found.wrong), expected + particle, particle);
  EXPECT_GT(found.percent(), 100 * kRounding_percent);
}

TEST_F(Surfaces, AHullThatIsNotDrawnIsWrongWhereItMustBeSeen) {
  const WrongPixels found = wrong(test::no_hull(eye_, hull_.recon));
  EXPECT_NEAR(double(found.wrong), count(reference_.exact.surfaces(), shown_.numbers().hull), 20);
}

TEST_F(Surfaces, AnObjectInAnotherPlaceIsWrong) {
  config::Scene moved = scene_;
  moved.objects[1].world_from_object.translation().x() += 0.05;
  ShownSurfaces shown(moved, viewer_);
  const WrongPixels found =
      wrong_pixels(scene_, reference_, particles_, shown.of(hull_, particles_));
  // Two strips of the bar's height.
  const double px_per_m = image_.pinhole.fx_px / 0.65, strip_px = 0.05 * px_per_m * 0.1 * px_per_m;
  EXPECT_NEAR(double(found.wrong), 2 * strip_px, 0.4 * strip_px);
}

// A reconstruction of fewer pixels than the image has is wrong beside the outline. The renderer
// does not cause these errors.
TEST_F(Surfaces, CoarseTexelsAreWrongByTheExactHullOnly) {
  hull::View coarse = view_;
  coarse.camera.pinhole = geometry::resized(view_.camera.pinhole, 80, 60);
  const render::HullFrame hull = reconstructed({silhouettes_, {}}, coarse);
  const FrameReference reference(scene_, viewer_, shown_.numbers(), hull, silhouettes_);
  const WrongPixels found =
      wrong_pixels(scene_, reference, particles_, shown_.of(hull, particles_));
  EXPECT_LT(found.drawing_percent(), kRounding_percent + 0.01);
  EXPECT_GT(found.percent(), 0.1);
}

TEST(SurfaceNumbers, OfTheHullHasAllBitsAndIsTheLargest) {
  config::Scene scene;
  for (int i = 0; i < 20; ++i) {
    const SurfaceNumbers numbers(scene);
    EXPECT_GT(numbers.hull, numbers.object(scene.objects.size()) - 1);
    EXPECT_EQ(numbers.hull + 1, 1 << numbers.bits);
    scene.objects.emplace_back();
  }
}

}  // namespace
}  // namespace fivepipe::render_bench
