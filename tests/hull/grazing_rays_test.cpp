// Attacks the certified margins of the exact depth backends. Maps have real sizes. A ray's images
// pass corners of object pixels in all cameras at one point of the ray, at a distance that float
// cannot resolve and double can, so that every wrong decision of float shows in the depth.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "tests/support/hull/backends.h"
#include "tests/support/hull/grazing_rays.h"
#include "tests/support/sanitizer.h"

namespace fivepipe::hull {
namespace {

using namespace test;
using Eigen::Vector2d;
using Eigen::Vector3d;

// Pieces of the hull shorter than this, relative to their depth, result from rounding in double:
// coordinates up to 1 km are exact to 1e-13 m.
constexpr double kPieceRounding = 1e-11;
// A ray is often at the corner of its tile, because corner rays decide the steps of tiles.
PixelRect rect_around(Random& random, int u_px, int v_px, const PixelRect& image) {
  const auto before = [&] { return std::array{0, 7, 3, 4, int(random() % 32)}[random() % 5]; };
  const int u0 = u_px - before(), v0 = v_px - before(), size = random() % 4 ? 8 : 40;
  return intersection({u0, v0, std::max(u0 + size, u_px + 1), std::max(v0 + size, v_px + 1)},
                      image);
}

::testing::AssertionResult is_reference(float depth_m, std::span<const Silhouette> silhouettes,
                                        const geometry::Ray& ray, const View& view) {
  const auto pieces = reference_intervals(silhouettes, ray, view.near_m, view.far_m);
  for (const Interval& piece : pieces) {
    if (kGlTolerance.near(depth_m, piece.enter)) return ::testing::AssertionSuccess();
    if (piece.leave - piece.enter > kPieceRounding * piece.leave)
      return ::testing::AssertionFailure()
             << "depth " << depth_m << " m, reference " << piece.enter;
  }
  if (depth_m == kNoHull) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << "depth " << depth_m << " m, reference none";
}

// A view's ray whose images pass borders of object pixels in all cameras at one point.
struct GrazingRay {
  View view;
  int u_px, v_px;
  PixelRect rect;  // holds the ray
  geometry::Ray ray() const { return geometry::ray_through(view.camera, Vector2d(u_px, v_px)); }
};

class RaySource {
 public:
  std::vector<Silhouette> silhouettes;

  // Moves the images in the silhouettes' cameras.
  GrazingRay next() {
    if (made_++ % 20 == 0) {
      place_m_ = random_place_m(random_);
      const bool hd = random_() % 2;
      silhouettes.clear();
      for (int cameras = 1 + int(random_() % 4); cameras > 0; --cameras)
        silhouettes.push_back(
            random_silhouette(random_, place_m_, hd ? 1920 : 720, hd ? 1080 : 486));
    }
    GrazingRay ray{random_view(random_, place_m_, silhouettes[0].camera),
                   int(uniform(random_, 0, 640)),
                   int(uniform(random_, 0, 480)),
                   {}};
    const Vector3d p_world_m = point_before_all(ray.view.camera);
    for (Silhouette& s : silhouettes) {
      Vector2d off_px{tiny_offset_px(random_), tiny_offset_px(random_)};
      const auto beside_corner = random_() % 4;  // passes an edge instead of a corner
      if (beside_corner < 2) off_px[Eigen::Index(beside_corner)] = uniform(random_, -0.5, 0.5);
      shift_image(s.camera, p_world_m, any_corner(random_, s.pixels) + off_px);
    }
    shift_image(ray.view.camera, p_world_m, Vector2d(ray.u_px, ray.v_px));
    ray.rect = rect_around(random_, ray.u_px, ray.v_px, {0, 0, 640, 480});
    return ray;
  }
  Random& random() { return random_; }

 private:
  Vector3d point_before_all(const geometry::Camera& view) {
    for (;;) {
      const Vector3d p_world_m = place_m_ + random_in_ball(random_, 0.2);
      if (geometry::project(view, p_world_m) &&
          std::ranges::all_of(silhouettes, [&](const Silhouette& s) {
            return geometry::project(s.camera, p_world_m).has_value();
          }))
        return p_world_m;
    }
  }
  Random random_{1};
  Vector3d place_m_;
  int made_ = 0;
};

struct GrazingRays : ForHullBackends {
  // gl takes about ten times as long as cpu on llvmpipe. FIVEPIPE_LONG selects more rays, a
  // sanitizer fewer.
  int rays(int quick) const {
    if (GetParam() == std::string("gl")) quick /= 8;
    return std::getenv("FIVEPIPE_LONG") ? 20 * quick : quick / kSlowdown;
  }
  float depth_of_ray(std::span<const Silhouette> silhouettes, const GrazingRay& ray) {
    backend().set_silhouettes(silhouettes);
    const PixelRect& rect = ray.rect;
    return depth_of(backend(), rect, ray.view)
        .depth_m[std::size_t((ray.v_px - rect.v0_px) * rect.width_px() + ray.u_px - rect.u0_px)];
  }
};
INSTANTIATE_TEST_SUITE_P(Hull, GrazingRays, ::testing::Values("cpu", "gl"), backend_name);

// Counts the rays and reports the first wrong ones.
struct Tally {
  int rays = 0, hits = 0, wrong = 0;
  void add(float depth_m, std::span<const Silhouette> silhouettes, const GrazingRay& ray) {
    const auto result = is_reference(depth_m, silhouettes, ray.ray(), ray.view);
    hits += depth_m != kNoHull;
    wrong += !result;
    if (!result && wrong <= 5) ADD_FAILURE() << "ray " << rays << ": " << result.message();
    ++rays;
  }
  void expect_none_wrong() const {
    std::printf("%d rays, %d hits, %d wrong\n", rays, hits, wrong);
    EXPECT_EQ(wrong, 0);
    EXPECT_GT(hits, rays / 10);
  }
};

TEST_P(GrazingRays, PastPixelBordersInAllCamerasEqualTheReference) {
  RaySource source;
  Tally tally;
  for (int i = 0; i < rays(3000); ++i) {
    const GrazingRay ray = source.next();
    tally.add(depth_of_ray(source.silhouettes, ray), source.silhouettes, ray);
  }
  tally.expect_none_wrong();
}

// Moves the image of a point of the ray to the center of the map, and sets a stripe of object
// pixels on the side that the ray's image passes before the point, or after it. The stripe begins
// off_px beside the point and is width_px wide, along the axis of the image's larger motion.
void set_stripe(Silhouette& s, const geometry::Ray& ray, double depth_m, bool before, int width_px,
                double off_px) {
  constexpr int kHalfLength_px = 100;
  const geometry::Pinhole& k = s.camera.pinhole;
  const auto at = [&](double t) {
    return *geometry::project(s.camera, ray.origin_world_m + t * ray.direction_world);
  };
  const Vector2d motion = at(depth_m * (1 + 1e-6)) - at(depth_m);
  const bool along_u = std::abs(motion.x()) > std::abs(motion.y()),
             low_side = ((along_u ? motion.x() : motion.y()) > 0) == before;
  const int u = k.width_px / 2, v = k.height_px / 2;
  shift_image(s.camera, ray.origin_world_m + depth_m * ray.direction_world,
              along_u ? Vector2d(u - 0.5 + off_px, v) : Vector2d(u, v - 0.5 + off_px));
  const int low = low_side ? -width_px : 0, high = low_side ? 0 : width_px;
  const PixelRect stripe =
      intersection(along_u ? PixelRect{u + low, v - kHalfLength_px, u + high, v + kHalfLength_px}
                           : PixelRect{u - kHalfLength_px, v + low, u + kHalfLength_px, v + high},
                   {0, 0, k.width_px, k.height_px});
  s.pixels = ObjectPixels(k.width_px, k.height_px);
  for (int row = stripe.v0_px; row < stripe.v1_px; ++row)
    s.pixels.set_run(stripe.u0_px, stripe.u1_px, row);
}

// A ray that passes borders of a slow and of a fast camera at one point. The slow camera is beside
// the eye, so float knows the ray's crossing of its border to some um only. The fast camera is near
// the ray, has a long focal length, and sees these as several pixels. The ray enters or leaves each
// camera's object there; sometimes the far plane is just behind.
struct SlowAndFast {
  GrazingRay ray;
  std::vector<Silhouette> silhouettes;
};
SlowAndFast slow_and_fast(Random& random) {
  const View view{{geometry::pinhole_from_fov(640, 480, log_uniform(random, 0.02, 0.2)),
                   random_look_at(random, random_direction(random), Vector3d::Zero(), 0.05)},
                  0.05,
                  10.0};
  const int u = int(uniform(random, 0, 640)), v = int(uniform(random, 0, 480)),
            before_u = int(random() % 32), before_v = int(random() % 32);
  SlowAndFast scene{
      {view, u, v,
       intersection({u - before_u, v - before_v, u - before_u + 32, v - before_v + 32},
                    {0, 0, 640, 480})},
      {}};
  const geometry::Ray line = scene.ray.ray();
  const double depth_m = uniform(random, 0.8, 1.2), beside = log_uniform(random, 1e-6, 1e-3);
  const Vector3d p_world_m = line.origin_world_m + depth_m * line.direction_world,
                 beside_m = line.origin_world_m + beside * random_direction(random),
                 near_m = p_world_m + random_vector(random, 0.2, 0.6);
  scene.silhouettes = {{{geometry::pinhole_from_fov(1920, 1080, uniform(random, 0.3, 1.2)),
                         geometry::look_at(beside_m, p_world_m, random_direction(random))},
                        {}},
                       {{geometry::pinhole_from_fov(720, 486, log_uniform(random, 1e-3, 0.02)),
                         geometry::look_at(near_m, p_world_m, random_direction(random))},
                        {}}};
  const bool leaves_fast = random() % 3 > 0, leaves_slow = !leaves_fast && random() % 2;
  // The slow camera's image stays in one pixel, where float resolves 3e-8 px.
  const double side = random() % 2 ? 1 : -1, slow_off_px = side * log_uniform(random, 1e-9, 1e-4);
  set_stripe(scene.silhouettes[0], line, depth_m, leaves_slow, 200, slow_off_px);
  const int width_px = int(log_uniform(random, 1, 200));
  set_stripe(scene.silhouettes[1], line, depth_m, leaves_fast, width_px, tiny_offset_px(random));
  if (!leaves_fast && !leaves_slow)
    scene.ray.view.far_m = depth_m * (1 + log_uniform(random, 1e-10, 1e-5));
  return scene;
}

TEST_P(GrazingRays, PastASlowAndAFastCameraEqualTheReference) {
  Random random(1);
  Tally tally;
  while (tally.rays < rays(2000)) {
    const SlowAndFast scene = slow_and_fast(random);
    tally.add(depth_of_ray(scene.silhouettes, scene.ray), scene.silhouettes, scene.ray);
  }
  tally.expect_none_wrong();
}

// The near or the far plane cuts the ray just before or behind an end of its first piece.
TEST_P(GrazingRays, CutAtAnEndOfTheirFirstPieceEqualTheReference) {
  RaySource source;
  Tally tally;
  while (tally.rays < rays(2000)) {
    GrazingRay ray = source.next();
    const auto pieces =
        reference_intervals(source.silhouettes, ray.ray(), ray.view.near_m, ray.view.far_m);
    if (pieces.empty()) continue;
    const double side = source.random()() % 2 ? 1 : -1,
                 off = side * log_uniform(source.random(), 1e-10, 1e-4);
    switch (source.random()() % 3) {
      case 0: ray.view.far_m = pieces.front().enter * (1 + off); break;
      case 1: ray.view.near_m = pieces.front().enter * (1 + off); break;
      default: ray.view.near_m = pieces.front().leave * (1 + off);
    }
    if (!(ray.view.near_m < ray.view.far_m)) continue;
    tally.add(depth_of_ray(source.silhouettes, ray), source.silhouettes, ray);
  }
  tally.expect_none_wrong();
}

}  // namespace
}  // namespace fivepipe::hull
