// Compares every pixel with the definition of the shading, computed in double: ray casting of the
// triangles, one light and the sky, the filtered checker, warmth, and the interpolation of the
// hull.
#include <algorithm>
#include <cmath>
#include <random>

#include "benchmarks/render/oracle/hull_pixel.h"
#include "benchmarks/render/oracle/triangle_ray.h"
#include "tests/render/composite_fixture.h"

namespace fivepipe::render {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Half a level of rounding and the 0.41 levels by which the shader's curve differs from sRGB.
constexpr double kLevels = 0.95;
// Half a level of rounding. A GPU's conversion to levels may be off by more: 0.55 on an H200.
constexpr double kUnlitLevels = 0.6;

Vector3d linear(const std::array<double, 3>& srgb) {
  Vector3d rgb;
  for (int i = 0; i < 3; ++i) {
    const double c = srgb[std::size_t(i)];
    rgb[i] = c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
  }
  return rgb;
}
Vector3d levels(const Vector3d& linear_rgb) {
  return linear_rgb.unaryExpr([](double l) {
    return 255 * (l <= 0.0031308 ? 12.92 * l : 1.055 * std::pow(std::min(l, 1.0), 1 / 2.4) - 0.055);
  });
}
void expect_colour(const cv::Vec3b& bgr, const Vector3d& rgb_levels, int u, int v,
                   double tolerance = kLevels) {
  for (int c = 0; c < 3; ++c)
    ASSERT_NEAR(bgr[2 - c], rgb_levels[c], tolerance) << "channel " << c << " at " << u << ' ' << v;
}

struct Light {
  Vector3d light_world_m;
  double reach_m;
  Vector3d reflected(const Vector3d& albedo, const Vector3d& normal, const Vector3d& p_m) const {
    const Vector3d to_light = (light_world_m - p_m) / reach_m;
    const double diffuse = 1.6 * std::max(normal.dot(to_light), 0.0) /
                           (to_light.norm() * (1 + to_light.squaredNorm()));
    return albedo.cwiseProduct(Vector3d(0.135, 0.1425, 0.155) +
                               normal.z() * Vector3d(0.065, 0.0775, 0.095) +
                               diffuse * Vector3d(1, 0.97, 0.92));
  }
};

// The fraction of a box around `at` [cells] that odd cells cover. Cell 0 is even.
double odd_fraction(const Vector2d& at, const Vector2d& size) {
  const auto odd = [](double begin, double end) {
    const auto until = [](double x) {  // length of the odd cells in [0, x]
      const double pairs = std::floor(x / 2), rest = x - 2 * pairs;
      return pairs + std::max(0.0, rest - 1);
    };
    return (until(end) - until(begin)) / (end - begin);
  };
  const double x = odd(at.x() - size.x() / 2, at.x() + size.x() / 2),
               y = odd(at.y() - size.y() / 2, at.y() + size.y() / 2);
  return x * (1 - y) + y * (1 - x);
}

class Reference : public Composite {
 protected:
  Reference() {
    viewer_.render_width_px = 160;
    viewer_.render_height_px = 120;
    viewer_.recon_width_px = 80;
    viewer_.recon_height_px = 60;
    eye_ = geometry::look_at({0.1, -0.1, 0.05}, {0.05, 1, 0}, {0.2, 0, 1});
    empty_hull_ = test::no_hull(eye_, config::recon_pinhole(viewer_));
  }

  struct Triangle {
    std::size_t object;
    std::array<Vector3d, 3> p_m, normal;
    std::array<double, 3> warmth;
  };
  static std::vector<Triangle> triangles_of(const config::Scene& scene,
                                            const std::vector<ObjectPose>& poses) {
    std::vector<Triangle> triangles;
    for (std::size_t o = 0; o < scene.objects.size(); ++o) {
      const Surface surface(scene.objects[o]);
      const auto corners = surface.corners();
      std::vector<float> warmth(corners.size());
      Eigen::Isometry3d world_from_object = scene.objects[o].world_from_object;
      for (const ObjectPose& pose : poses)
        if (pose.object == scene.objects[o].name) {
          world_from_object = pose.world_from_object;
          if (!pose.warmth.empty()) warmth = surface.at_corners(pose.warmth);
        }
      for (std::size_t t = 0; t < corners.size(); t += 3) {
        Triangle& triangle = triangles.emplace_back();
        triangle.object = o;
        for (std::size_t c = 0; c < 3; ++c) {
          triangle.p_m[c] = world_from_object * corners[t + c].p_object_m.cast<double>();
          triangle.normal[c] = world_from_object.linear() * corners[t + c].normal.cast<double>();
          triangle.warmth[c] = warmth[t + c];
        }
      }
    }
    return triangles;
  }

  struct Hit {
    std::size_t object = 0;
    double distance = INFINITY;
    Vector3d p_m, normal;
    double warmth = 0;
    bool near_an_edge = false;
  };
  // The first triangle on the ray. Normals are those of the corners, interpolated.
  Hit cast(const std::vector<Triangle>& triangles, const geometry::Ray& ray) const {
    Hit hit;
    for (const Triangle& t : triangles) {
      const std::optional<PlaneHit> at = plane_hit(t.p_m, ray);
      if (!at) continue;
      const double smallest = at->barycentric.minCoeff();
      if (smallest < -0.02 || at->distance < viewer_.near_m || at->distance > hit.distance)
        continue;
      Vector3d normal = Vector3d::Zero();
      double warmth = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        normal += at->barycentric[Eigen::Index(c)] * t.normal[c];
        warmth += at->barycentric[Eigen::Index(c)] * t.warmth[c];
      }
      normal *= (at->is_from_back ? -1 : 1) / normal.norm();
      hit = {t.object, at->distance, ray.origin_world_m + at->distance * ray.direction_world,
             normal,   warmth,       smallest < 0.02};
    }
    return hit;
  }

  // Compares each third pixel and returns how many of them show an object.
  int expect_reference(const config::Scene& scene, const Light& light,
                       const std::vector<ObjectPose>& poses = {},
                       const std::set<std::string>& colliding = {}) {
    Renderer renderer(scene, viewer_);
    renderer.draw(empty_hull_, poses, colliding);
    const cv::Mat drawn = renderer.image_bgr();
    const geometry::Camera camera{config::render_pinhole(viewer_), eye_};
    const std::vector<Triangle> triangles = triangles_of(scene, poses);
    int hits = 0;
    for (int v = 1; v < drawn.rows; v += 3)
      for (int u = 1; u < drawn.cols; u += 3) {
        const Hit hit = cast(triangles, geometry::ray_through(camera, Vector2d(u, v)));
        if (!(hit.distance < INFINITY) || hit.near_an_edge) continue;
        const config::SceneObject& object = scene.objects[hit.object];
        Vector3d albedo = linear(object.colour_rgb);
        if (colliding.contains(object.name))
          albedo = 0.2 * albedo + 0.8 * Vector3d(0.8, 0.02, 0.02);
        Vector3d glow = Vector3d::Zero();
        if (object.warming) {
          const Vector3d warm = linear(object.warming->colour_rgb);
          albedo = (1 - hit.warmth) * albedo + hit.warmth * warm;
          glow = 0.4 * hit.warmth * warm;
        }
        expect_colour(drawn.at<cv::Vec3b>(v, u),
                      levels(light.reflected(albedo, hit.normal, hit.p_m) + glow), u, v);
        if (HasFatalFailure()) return 0;
        ++hits;
      }
    return hits;
  }
};

config::SceneObject turned(config::SceneObject object, const Vector3d& axis, double angle_rad) {
  object.world_from_object.rotate(Eigen::AngleAxisd(angle_rad, axis.normalized()));
  return object;
}

TEST_F(Reference, LightOfBoxesBallsAndCurtains) {
  const Vector3d light_m(0.6, 0.3, 0.7);
  const auto scene_with = [&](std::vector<config::SceneObject> objects) {
    return scene_of(std::move(objects), light_m);
  };
  const auto light_of = [&](const Vector3d& center_m) {
    return Light{light_m, (center_m - light_m).norm()};
  };
  const Vector3d center_m(0.05, 1, 0.02);
  const std::array<double, 3> dark{0.03, 0.5, 0.9}, bright{0.9, 0.7, 0.2};
  EXPECT_GT(
      expect_reference(
          scene_with({test::object("box", config::BoxShape{{0.4, 0.5, 0.3}}, center_m, dark)}),
          light_of(center_m)),
      100);
  EXPECT_GT(expect_reference(
                scene_with({test::object("ball", config::SphereShape{0.3, 2}, center_m, bright)}),
                light_of(center_m)),
            200);
  // Seen from its back.
  config::SceneObject curtain = turned(
      test::object("curtain", config::CurtainShape{0.6, 0.5, 16, 4, 0.05, 3}, {0, 1, 0.3}, bright),
      {0, 0, 1}, 2.6);
  Eigen::AlignedBox3d bounds_m;
  const Eigen::AlignedBox3d local_m = geometry::bounds_m(config::mesh_of(curtain));
  bounds_m.extend(local_m.transformed(curtain.world_from_object));
  EXPECT_GT(expect_reference(scene_with({curtain}), light_of(bounds_m.center())), 200);
}

TEST_F(Reference, AnObjectMovesAndTurnsWithItsPose) {
  const Vector3d light_m(-0.5, -0.2, 0.6), center_m(0, 1, 0);
  ObjectPose pose{"box", Eigen::Isometry3d::Identity(), {}, {}};
  pose.world_from_object.translation() = Vector3d(0.1, 0.9, -0.05);
  pose.world_from_object.rotate(Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()));
  EXPECT_GT(expect_reference(scene_of({test::object("box", config::BoxShape{{0.4, 0.5, 0.3}},
                                                    center_m, {0.5, 0.7, 0.3})},
                                      light_m),
                             {light_m, (center_m - light_m).norm()}, {pose}, {"box"}),
            200);
}

TEST_F(Reference, WarmObjectsGlow) {
  const Vector3d light_m(-0.5, -0.2, 0.6), center_m(0, 1, 0);
  for (const config::Shape& shape : {config::Shape(config::BoxShape{{0.4, 0.5, 0.3}, 0.1}),
                                     config::Shape(config::SphereShape{0.3, 2})}) {
    config::SceneObject object = test::object("warm", shape, center_m, {0.3, 0.35, 0.4});
    object.warming = config::Warming{};
    object.warming->colour_rgb = {0.9, 0.4, 0.15};
    ObjectPose pose{"warm", object.world_from_object, {}, {}};
    for (const Vector3d& vertex : config::mesh_of(object).vertices_m)
      pose.warmth.push_back(float(std::clamp(0.5 + 2 * vertex.x(), 0.0, 1.0)));
    EXPECT_GT(expect_reference(scene_of({object}, light_m), {light_m, (center_m - light_m).norm()},
                               {pose}),
              200);
  }
}

// The nominal distance of the light is that to the center of the scene, and at least 10 cm. Objects
// without a vertex do not count.
TEST_F(Reference, ALightAtTheCenterOfTheSceneLightsIt) {
  const Vector3d center_m(0.1, 0.1, 0);
  EXPECT_GT(expect_reference(
                scene_of({test::object("room", config::BoxShape{{0.7, 0.8, 0.5}}, center_m,
                                       {0.8, 0.8, 0.8}),
                          test::object("nothing", config::MeshShape{}, {5, 5, 5}, {1, 1, 1})},
                         center_m),
                {center_m, 0.1}),
            1000);
}

// A plate of cells that are larger and smaller than a pixel, turned within the image plane. The
// pixel averages the cells over its footprint.
TEST_F(Reference, ACheckerIsAveragedOverThePixel) {
  eye_ = test::eye_along_y();
  empty_hull_.eye_from_world = eye_;
  const geometry::Camera camera{config::render_pinhole(viewer_), eye_};
  const Vector3d light_m(0, -0.5, 0.3);
  for (const double angle_rad : {0.0, 0.4})
    for (const double cell_px : {40.0, 5.0, 1.3}) {
      const double cell_m = cell_px / camera.pinhole.fx_px;
      config::SceneObject object = turned(plate("wall", 1, 3, 3), {0, 1, 0}, angle_rad);
      object.pattern = config::Pattern::checker;
      object.pattern_size_m = cell_m;
      const Light light{light_m, (object.world_from_object.translation() - light_m).norm()};
      const cv::Mat drawn = image(scene_of({object}, light_m), empty_hull_);
      const auto cells_at = [&](double u, double v) {
        const geometry::Ray ray = geometry::ray_through(camera, Vector2d(u, v));
        const Vector3d p =
            object.world_from_object.inverse() * (ray.origin_world_m + ray.direction_world);
        return Vector2d(p.x() / cell_m, p.z() / cell_m);
      };
      const Vector2d footprint = (cells_at(1, 0) - cells_at(0, 0)).cwiseAbs() +
                                 (cells_at(0, 1) - cells_at(0, 0)).cwiseAbs();
      for (int v = 0; v < drawn.rows; ++v)
        for (int u = 0; u < drawn.cols; ++u) {
          const geometry::Ray ray = geometry::ray_through(camera, Vector2d(u, v));
          const Vector3d albedo =
              linear({0.8, 0.8, 0.8}) * (1 - 0.38 * odd_fraction(cells_at(u, v), footprint));
          // Float rounding of the coordinates, for cells of a pixel: a thousandth of a cell.
          expect_colour(drawn.at<cv::Vec3b>(v, u),
                        levels(light.reflected(albedo, -Vector3d::UnitY(),
                                               ray.origin_world_m + ray.direction_world)),
                        u, v, kLevels + 0.1);
          if (HasFatalFailure()) return;
        }
    }
}

TEST_F(Reference, TheBackgroundIsBrighterAtTheTop) {
  config::Scene scene = scene_of({});
  scene.background_rgb = {0.3, 0.5, 0.7};
  const cv::Mat drawn = image(scene, empty_hull_);
  for (int v = 0; v < drawn.rows; ++v)
    for (int u = 0; u < drawn.cols; ++u) {
      const double factor = 1.2 - 0.4 * (v + 0.5) / drawn.rows;
      expect_colour(drawn.at<cv::Vec3b>(v, u), 255 * factor * Vector3d(0.3, 0.5, 0.7), u, v,
                    kUnlitLevels);
      if (HasFatalFailure()) return;
    }
}

// What the hull's pixels show, by the comments of hull.frag.
class HullReference : public Reference {
 protected:
  // Draws the hull and compares depth and colour of each pixel.
  void expect_hull(const HullFrame& hull) {
    config::Scene scene = scene_of({}, {0.7, -0.4, 0.5});
    const Light light{scene.light_world_m, scene.light_world_m.norm()};
    Renderer renderer(scene, viewer_);
    renderer.draw(hull, {}, {});
    const cv::Mat drawn = renderer.image_bgr(), depth_m = renderer.depth_m();
    const geometry::Pinhole k = config::render_pinhole(viewer_), recon = hull.recon;
    const HullTexels texels(hull);
    for (int v = 0; v < drawn.rows; ++v)
      for (int u = 0; u < drawn.cols; ++u) {
        const std::optional<HullPixel> shown = hull_pixel(texels, k, u, v);
        if (!shown) {
          ASSERT_NEAR(depth_m.at<float>(v, u), viewer_.far_m, kDepthRounding_m) << u << ' ' << v;
          continue;
        }
        ASSERT_NEAR(depth_m.at<float>(v, u), shown->depth_m, kDepthRounding_m) << u << ' ' << v;
        if (!hull.bgr.empty()) {
          expect_colour(drawn.at<cv::Vec3b>(v, u), shown->rgb, u, v, 0.6);
        } else {
          // For a plane n . p = d, 1 / z = n . ray / d with ray = ((u - cx) / fx, ..., 1).
          const int tu = std::clamp(shown->nearest_u_px, 0, recon.width_px - 1),
                    tv = std::clamp(shown->nearest_v_px, 0, recon.height_px - 1);
          const double gu = texels.slope(tu, tv, 1, 0), gv = texels.slope(tu, tv, 0, 1);
          const Vector3d normal_eye =
              -Vector3d(
                   gu * recon.fx_px, gv * recon.fy_px,
                   1 / texels.depth_m(tu, tv) - gu * (tu - recon.cx_px) - gv * (tv - recon.cy_px))
                   .normalized();
          const geometry::Ray ray = geometry::ray_through({k, hull.eye_from_world}, Vector2d(u, v));
          expect_colour(
              drawn.at<cv::Vec3b>(v, u),
              levels(light.reflected(Vector3d::Constant(0.55),
                                     hull.eye_from_world.linear().transpose() * normal_eye,
                                     ray.origin_world_m + shown->depth_m * ray.direction_world)),
              u, v, kLevels + 0.05);
        }
        if (HasFatalFailure()) return;
      }
  }

  // Two planes with a step between them of `step` times the largest of one surface, with holes.
  HullFrame stepped(const geometry::Pinhole& recon, double step, bool coloured) {
    const std::array<std::uint8_t, 3> black{};
    std::mt19937 random(6);
    const double jump = std::min(5.7 / recon.fx_px, 0.5);
    HullFrame hull = test::hull_of(eye_, recon, coloured ? &black : nullptr, [&](int u, int v) {
      if (random() % 9 == 0) return 0.0;
      const double inverse_z =
          1 + 0.2 * (u - recon.cx_px) / recon.fx_px - 0.1 * (v - recon.cy_px) / recon.fy_px;
      return (1 + ((u / 3 + v / 2) % 2 ? step * jump : 0)) / inverse_z;
    });
    for (std::uint8_t& level : hull.bgr) level = std::uint8_t(random() % 256);
    return hull;
  }
};

TEST_F(HullReference, DepthAndColourOfEachPixel) {
  for (const bool coloured : {true, false})
    for (const double step : {0.0, 0.5, 0.85, 1.15, 1.5}) {
      SCOPED_TRACE(testing::Message() << coloured << ' ' << step);
      expect_hull(stepped(config::recon_pinhole(viewer_), step, coloured));
      if (HasFatalFailure()) return;
    }
}

// The tilt of a surface has no meaning for so few pixels, so only the depths may differ by a half.
TEST_F(HullReference, DepthAndColourOfEachPixelOfAVeryCoarseHull) {
  viewer_.recon_width_px = 8;
  viewer_.recon_height_px = 6;
  for (const bool coloured : {true, false})
    for (const double step : {0.0, 0.5, 0.85, 1.15, 1.5}) {
      SCOPED_TRACE(testing::Message() << coloured << ' ' << step);
      expect_hull(stepped(config::recon_pinhole(viewer_), step, coloured));
      if (HasFatalFailure()) return;
    }
}

// The depths 1 m and 1.5 m differ by a half of the first, and by less than a half of the second.
TEST_F(HullReference, DepthsThatDifferByAHalfAreTwoSurfacesFromTheNearOne) {
  viewer_.recon_width_px = 8;
  viewer_.recon_height_px = 6;
  const auto depth_at = [](int u, int v) { return (u * u + v * v + u * v) % 5 < 2 ? 1.5 : 1.0; };
  expect_hull(test::hull_of(eye_, config::recon_pinhole(viewer_), nullptr, depth_at));
}

// The renderer uploads the part of the image that contains the hull and one more pixel.
TEST_F(HullReference, ASmallHullOfTheSameOrAnotherSizeReplacesTheHullBefore) {
  const config::Scene scene = scene_of({});
  Renderer renderer(scene, viewer_);
  for (const auto& [width, height, u0, v0, coloured] : {std::tuple{80, 60, 0, 0, true},
                                                        {80, 60, 30, 20, true},
                                                        {80, 60, 31, 18, false},
                                                        {80, 60, 30, 20, true},
                                                        {40, 60, 10, 20, true},
                                                        {40, 30, 3, 5, false},
                                                        {80, 30, 60, 10, true},
                                                        {80, 60, 68, 50, true}}) {
    const config::Viewer viewer = [&, width = width, height = height] {
      config::Viewer other = viewer_;
      other.recon_width_px = width;
      other.recon_height_px = height;
      return other;
    }();
    std::mt19937 random(2);
    const std::array<std::uint8_t, 3> black{};
    HullFrame hull = test::hull_of(
        eye_, config::recon_pinhole(viewer), coloured ? &black : nullptr,
        [&, u0 = u0, v0 = v0](int u, int v) {
          return u >= u0 && u < u0 + 9 && v >= v0 && v < v0 + 7 && random() % 6 ? 1 + 0.01 * u
                                                                                : hull::kNoHull;
        });
    for (std::uint8_t& level : hull.bgr) level = std::uint8_t(random() % 256);
    renderer.draw(hull, {}, {});
    const cv::Mat again = renderer.image_bgr(), again_m = renderer.depth_m();
    Renderer fresh(scene, viewer);
    fresh.draw(hull, {}, {});
    EXPECT_EQ(cv::norm(again, fresh.image_bgr(), cv::NORM_INF), 0) << width << ' ' << height;
    EXPECT_EQ(cv::norm(again_m, fresh.depth_m(), cv::NORM_INF), 0) << width << ' ' << height;
  }
}

// Other users of the context leave it in any state.
TEST_F(Reference, TheImageDoesNotDependOnTheStateOfTheContext) {
  const config::Scene scene =
      scene_of({test::object("ball", config::SphereShape{0.2, 2}, {0, 1, 0}, {0.8, 0.5, 0.2}),
                plate("plate", 0.9, 0.3, 0.3)});
  const HullFrame hull = test::hull_of(eye_, config::recon_pinhole(viewer_), nullptr,
                                       [](int u, int) { return u < 40 ? 0.95 : 1.3; });
  const cv::Mat expected = image(scene, hull);
  Renderer renderer(scene, viewer_);
  for (int i = 0; i < 2; ++i) {
    glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE);
    glEnable(GL_CULL_FACE);
    glCullFace(GL_BACK);
    glDisable(GL_DEPTH_TEST);
    glDepthFunc(GL_GREATER);
    glDepthMask(GL_FALSE);
    renderer.draw(hull, {}, {});
    EXPECT_EQ(cv::norm(renderer.image_bgr(), expected, cv::NORM_INF), 0);
    EXPECT_FALSE(glIsEnabled(GL_CULL_FACE));
    GLint row_length = -1;
    glGetIntegerv(GL_UNPACK_ROW_LENGTH, &row_length);
    EXPECT_EQ(row_length, 0);
  }
}

}  // namespace
}  // namespace fivepipe::render
