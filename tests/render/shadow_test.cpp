// Shadows of virtual objects and of the hull, and light on the hull, against their closed forms.
#include <algorithm>
#include <cmath>

#include "common/config/views.h"
#include "tests/render/composite_fixture.h"

namespace fivepipe::render {
namespace {

using Eigen::Vector3d;

constexpr double kWall_m = 2, kOccluder_m = 1;  // depths of the plates' fronts
const Vector3d kLight_m(-0.5, 0.1, 0.3);
// Half of the occluder's edges, and its centre.
constexpr double kHalf_m = 0.12;
const Vector3d kOccluderCenter_m(0.1, kOccluder_m, -0.05);

config::ShadowView shadow_view() {
  config::ShadowView shadows;
  shadows.target_world_m = {0.15, 1.5, 0};
  shadows.fov_rad = 1.6;
  return shadows;
}

class Shadows : public Composite {
 protected:
  geometry::Pinhole pinhole_ = config::render_pinhole(viewer_);

  config::Scene scene(bool with_shadows, bool with_occluder = true) const {
    std::vector<config::SceneObject> objects{plate("wall", kWall_m, 8, 8)};
    if (with_occluder)
      objects.push_back(plate("occluder", kOccluder_m, 2 * kHalf_m, 2 * kHalf_m,
                              kOccluderCenter_m.x(), kOccluderCenter_m.z()));
    config::Scene scene = scene_of(std::move(objects), kLight_m);
    if (with_shadows) scene.shadows = shadow_view();
    return scene;
  }
  cv::Mat draw(const config::Scene& of, const HullFrame& hull,
               const HullFrame* light_hull = nullptr) const {
    Renderer renderer(of, viewer_);
    renderer.draw(hull, {}, {}, {}, light_hull);
    return renderer.image_bgr();
  }
  Vector3d on_wall_m(double u, double v) const {
    return {(u - pinhole_.cx_px) / pinhole_.fx_px * kWall_m, kWall_m,
            -(v - pinhole_.cy_px) / pinhole_.fy_px * kWall_m};
  }
  // Whether the occluder hides the light from a point of the wall.
  static bool is_shadowed(const Vector3d& p_m) {
    const double at = (kOccluder_m - kLight_m.y()) / (p_m.y() - kLight_m.y());
    const Vector3d crossing = kLight_m + at * (p_m - kLight_m) - kOccluderCenter_m;
    return std::abs(crossing.x()) < kHalf_m && std::abs(crossing.z()) < kHalf_m;
  }
  bool shows_occluder(int u, int v) const {
    const Vector3d p_m = 0.5 * on_wall_m(u, v) - kOccluderCenter_m;
    return std::abs(p_m.x()) < kHalf_m + 0.003 && std::abs(p_m.z()) < kHalf_m + 0.003;
  }
};

// Distance [px] from a pixel to the nearest one on the other side of the analytic shadow's edge.
constexpr int kBand_px = 3;

TEST_F(Shadows, OfAPlateHasTheAnalyticEdge) {
  const cv::Mat lit = draw(scene(false), empty_hull_), drawn = draw(scene(true), empty_hull_);
  int shadowed = 0, wrong = 0, beside = 0;
  for (int v = kBand_px; v < 480 - kBand_px; ++v)
    for (int u = kBand_px; u < 640 - kBand_px; ++u) {
      if (shows_occluder(u, v)) continue;
      const bool expected = is_shadowed(on_wall_m(u, v));
      shadowed += expected;
      const bool found =
          3 * brightness(drawn.at<cv::Vec3b>(v, u)) < 2 * brightness(lit.at<cv::Vec3b>(v, u));
      if (found == expected) continue;
      bool is_at_edge = false;
      for (const auto& [du, dv] :
           {std::pair{kBand_px, 0}, {-kBand_px, 0}, {0, kBand_px}, {0, -kBand_px}})
        is_at_edge |= is_shadowed(on_wall_m(u + du, v + dv)) != expected;
      ++(is_at_edge ? beside : wrong);
    }
  // The shadow is a square. A pixel of the map at its depth, in pixels of the image:
  const double edge_px = 4 * std::sqrt(shadowed),
               map_px = (kWall_m - kLight_m.y()) / config::shadow_map_pinhole(shadow_view()).fx_px *
                        pinhole_.fx_px / kWall_m;
  std::printf("edge of a shadow: %.2f px off on average, %.2f pixels of the map; %d px elsewhere\n",
              beside / edge_px, beside / edge_px / map_px, wrong);
  EXPECT_GT(shadowed, 5000);
  EXPECT_EQ(wrong, 0);
  EXPECT_LT(beside / edge_px, 0.6 * map_px);
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
  const config::HullView view = *config::light_view(of);
  const geometry::Camera light{view.recon, *view.fixed};
  const HullFrame hull = test::hull_of(*view.fixed, view.recon, nullptr, [&](int u, int v) {
    const geometry::Ray ray = geometry::ray_through(light, Eigen::Vector2d(u, v));
    const double t = (kOccluder_m - ray.origin_world_m.y()) / ray.direction_world.y();
    const Vector3d p_m = ray.origin_world_m + t * ray.direction_world - kOccluderCenter_m;
    return t > 0 && std::abs(p_m.x()) < kHalf_m && std::abs(p_m.z()) < kHalf_m ? t : 0.0;
  });
  const cv::Mat lit = draw(of, empty_hull_), drawn = draw(of, empty_hull_, &hull);
  int shadowed = 0, different = 0;
  for (int v = 0; v < 480; ++v)
    for (int u = 0; u < 640; ++u) {
      const bool expected = is_shadowed(on_wall_m(u, v));
      shadowed += expected;
      different += expected != (3 * brightness(drawn.at<cv::Vec3b>(v, u)) <
                                2 * brightness(lit.at<cv::Vec3b>(v, u)));
    }
  std::printf("the hull's shadow of %d px differs in %d px\n", shadowed, different);
  EXPECT_GT(shadowed, 5000);
  // Half a pixel of the light's view, which has 6 mm at the wall, is about a pixel of the image.
  EXPECT_LT(different, 2 * 4 * std::sqrt(shadowed));
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
