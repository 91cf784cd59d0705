// Shadows of virtual objects and of the hull, and light on the hull, against their closed forms.
#include <algorithm>
#include <cmath>

#include "benchmarks/render/oracle/plate_shadow.h"
#include "tests/render/composite_fixture.h"

namespace fivepipe::render {
namespace {

using Eigen::Vector3d;

using plate_shadow::kLight_m, plate_shadow::kOccluderCenter_m, plate_shadow::kWall_m,
    plate_shadow::shadow_view;

class Shadows : public Composite {
 protected:
  geometry::Pinhole pinhole_ = config::render_pinhole(viewer_);

  static config::Scene scene(bool with_shadows, bool with_occluder = true) {
    return plate_shadow::scene(with_shadows, with_occluder);
  }
  cv::Mat draw(const config::Scene& of, const HullFrame& hull,
               const HullFrame* light_hull = nullptr) const {
    Renderer renderer(of, viewer_);
    renderer.draw(hull, {}, {}, {}, light_hull);
    return renderer.image_bgr();
  }
  Vector3d on_wall_m(double u, double v) const { return plate_shadow::on_wall_m(pinhole_, u, v); }
  static bool is_shadowed(const Vector3d& p_m) { return plate_shadow::is_shadowed(p_m); }
  bool shows_occluder(int u, int v) const { return plate_shadow::shows_occluder(pinhole_, u, v); }
};

// Largest distance [px] of a wrong pixel from the edge.
constexpr double kBand_px = 3;

TEST_F(Shadows, OfAPlateHasTheAnalyticEdge) {
  const cv::Mat lit = draw(scene(false), empty_hull_), drawn = draw(scene(true), empty_hull_);
  const plate_shadow::EdgeError error = plate_shadow::edge_error(lit, drawn, pinhole_, true);
  const double map_px = plate_shadow::map_pixel_px(pinhole_);
  std::printf("edge of a shadow: %.2f px off on average, %.2f pixels of the map; at most %.2f px\n",
              error.mean_px, error.mean_px / map_px, error.worst_px);
  EXPECT_GT(error.shadowed_px, 5000);
  EXPECT_LT(error.worst_px, kBand_px);
  EXPECT_LT(error.mean_px, 0.6 * map_px);
}

TEST_F(Shadows, AreDarkButNotBlack) {
  const cv::Mat drawn = draw(scene(true), empty_hull_);
  // The shadow's centre.
  const Vector3d to_m = kOccluderCenter_m - kLight_m,
                 p_m = kLight_m + (kWall_m - kLight_m.y()) / to_m.y() * to_m;
  const int u = int(pinhole_.cx_px + pinhole_.fx_px * p_m.x() / kWall_m),
            v = int(pinhole_.cy_px - pinhole_.fy_px * p_m.z() / kWall_m);
  EXPECT_GT(brightness(drawn.at<cv::Vec3b>(v, u)), 100);
  EXPECT_LT(brightness(drawn.at<cv::Vec3b>(v, u)), 450);
}

// A lit surface does not shadow itself, not even in grazing light.
TEST_F(Shadows, NoSurfaceShadowsItself) {
  for (const Vector3d& light_m : {Vector3d(-0.5, 0.1, 0.3), Vector3d(-1.5, 1.8, 0)}) {
    config::Scene of = scene(false, false);
    of.objects.push_back(
        test::object("ball", config::SphereShape{0.2, 4}, {0, 1.5, 0}, {0.7, 0.7, 0.7}));
    of.light_world_m = light_m;
    const cv::Mat lit = draw(of, empty_hull_);
    of.shadows = shadow_view();
    const cv::Mat drawn = draw(of, empty_hull_);
    // The part of the ball that faces the light, and the wall on the light's side.
    int darker = 0;
    for (int v = 0; v < 480; ++v)
      for (int u = 0; u < 250; ++u)
        darker += brightness(drawn.at<cv::Vec3b>(v, u)) < brightness(lit.at<cv::Vec3b>(v, u)) - 6;
    EXPECT_EQ(darker, 0) << light_m.transpose();
  }
}

// The hull of a rectangle at the occluder's place, as the light sees it.
TEST_F(Shadows, TheHullCastsThatOfThePlateInItsPlace) {
  const config::Scene of = scene(true, false);
  const HullFrame hull = plate_shadow::occluder_in_light();
  const cv::Mat lit = draw(of, empty_hull_), drawn = draw(of, empty_hull_, &hull);
  const plate_shadow::EdgeError error = plate_shadow::edge_error(lit, drawn, pinhole_, false);
  std::printf("edge of the hull's shadow: %.2f px off on average, at most %.2f px\n", error.mean_px,
              error.worst_px);
  EXPECT_GT(error.shadowed_px, 5000);
  // Half a pixel of the light's view, which has 6 mm at the wall, is about a pixel of the image.
  EXPECT_LT(error.mean_px, 2);
}

// The coloured hull in the place of the wall has the wall's colours: lit, and shadowed by the
// occluder.
TEST_F(Shadows, ALitHullLooksLikeTheObjectInItsPlace) {
  for (const bool with_shadows : {false, true}) {
    config::Scene of = scene(with_shadows);
    const cv::Mat wall = draw(of, empty_hull_);
    of.objects.erase(of.objects.begin());
    of.lights_real_objects = true;
    // The objects' bounds set the light's nominal distance; keep it.
    of.objects.push_back(plate("behind", kWall_m + 0.001, 8, 8));
    const std::array<std::uint8_t, 3> grey = {204, 204, 204};  // 0.8, as the wall
    const HullFrame hull = test::hull_of(eye_, config::recon_pinhole(viewer_), &grey,
                                         [](int, int) { return kWall_m; });
    const cv::Mat drawn = draw(of, hull);
    int different = 0, compared = 0;
    for (int v = 20; v < 460; ++v)
      for (int u = 20; u < 620; ++u) {
        if (shows_occluder(u, v)) continue;
        bool is_at_edge = false;
        for (const int d : {-4, 4})
          is_at_edge |= is_shadowed(on_wall_m(u + d, v)) != is_shadowed(on_wall_m(u - d, v)) ||
                        is_shadowed(on_wall_m(u, v + d)) != is_shadowed(on_wall_m(u, v - d));
        if (with_shadows && is_at_edge) continue;
        ++compared;
        for (int c = 0; c < 3; ++c)
          different += std::abs(drawn.at<cv::Vec3b>(v, u)[c] - wall.at<cv::Vec3b>(v, u)[c]) > 2;
      }
    EXPECT_GT(compared, 200'000);
    EXPECT_EQ(different, 0) << with_shadows;
  }
}

TEST_F(Shadows, WithoutLightTheHullKeepsItsColoursInShadow) {
  const config::Scene of = scene(true);
  const HullFrame hull =
      test::hull_of(eye_, config::recon_pinhole(viewer_), &kHullBgr, [](int, int) { return 1.5; });
  const cv::Mat drawn = draw(of, hull);
  for (const int u : {100, 330, 600}) EXPECT_EQ(drawn.at<cv::Vec3b>(400, u), kHullColour);
}

TEST_F(Shadows, ParticlesReceiveThem) {
  config::Scene of = scene(true);
  config::ParticleSource source;
  source.name = "grains";
  source.radius_m = 0.016;
  source.colour_rgb = {0.9, 0.9, 0.9};
  of.particles = {source};
  // On the line from the light through the occluder's centre, and beside it.
  const Vector3d shadowed_m = kLight_m + 1.5 * (kOccluderCenter_m - kLight_m),
                 lit_m = shadowed_m + Vector3d(0, 0, 0.45);
  ParticleCloud cloud;
  for (const Vector3d& p : {shadowed_m, lit_m})
    cloud.p_world_m.insert(cloud.p_world_m.end(), {float(p.x()), float(p.y()), float(p.z())});
  Renderer renderer(of, viewer_);
  renderer.draw(empty_hull_, {}, {}, {{cloud}}, nullptr);
  const cv::Mat drawn = renderer.image_bgr();
  const auto at = [&](const Vector3d& p) {
    return brightness(drawn.at<cv::Vec3b>(int(pinhole_.cy_px - pinhole_.fy_px * p.z() / p.y()),
                                          int(pinhole_.cx_px + pinhole_.fx_px * p.x() / p.y())));
  };
  EXPECT_LT(2 * at(shadowed_m), at(lit_m));
}

}  // namespace
}  // namespace fivepipe::render
