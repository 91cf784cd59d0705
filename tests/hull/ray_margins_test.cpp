// The error bounds of the SIMD ray kernels, for one camera and one block of rays: positions of
// images, crossings of pixel borders, ends of verdicts, and steps of tiles. Truth is computed in
// long double. The kernels are compiled for the lowest instruction set, whose reciprocal is the
// least accurate.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/hull/cpu/step_simd-inl.h"
#include "common/hull/cpu/tile_simd-inl.h"
#include "tests/support/hull/grazing_rays.h"

namespace fivepipe::hull {
namespace HWY_NAMESPACE {
namespace {

using namespace test;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Exact = long double;  // 2^40 times finer than float

// (U, V, W) of a ray's image as BlockCamera describes it: relative to the origin, along the
// mirrored axes.
struct ExactLine {
  Exact at_begin[3], slope[3];
  Exact w(Exact s) const { return at_begin[2] + s * slope[2]; }
  Exact position(int axis, Exact s) const { return (at_begin[axis] + s * slope[axis]) / w(s); }
  // The s at which the image crosses `border`.
  Exact crossing(int axis, Exact border) const {
    return (border * at_begin[2] - at_begin[axis]) / (slope[axis] - border * slope[2]);
  }
};

// Bounds of positions, by axis.
struct Bounds {
  Exact low[2] = {1e30L, 1e30L}, high[2] = {-1e30L, -1e30L};
  void add(const ExactLine& line, Exact s) {
    for (int axis = 0; axis < 2; ++axis) {
      const Exact x = line.position(axis, s);
      low[axis] = std::min(low[axis], x), high[axis] = std::max(high[axis], x);
    }
  }
};

// One camera, and a block of rays that look at a corner of its object pixels.
struct Scene {
  Silhouette silhouette;
  SkipMap skip_map;
  MapFromView map;
  Block block{};

  // Returns false if the kernels do not support the block.
  bool make(Random& random) {
    const Vector3d place_m = random_place_m(random),
                   p_world_m = place_m + random_in_ball(random, 0.2);
    const bool hd = random() % 2;
    silhouette = random_silhouette(random, place_m, hd ? 1920 : 720, hd ? 1080 : 486);
    const View view = random_view(random, place_m, silhouette.camera);
    const auto uv_px = geometry::project(view.camera, p_world_m);
    if (!uv_px || !geometry::project(silhouette.camera, p_world_m)) return false;
    shift_image(silhouette.camera, p_world_m, any_corner(random, silhouette.pixels));
    skip_map.assign(silhouette.pixels);
    make_all(skip_map);
    map = map_from_view(silhouette.camera, view.camera);
    const int u = int(uv_px->x()) - int(random() % kBlock_px),
              v = int(uv_px->y()) - int(random() % kBlock_px);
    const double depth_m = (view.camera.camera_from_world * p_world_m).z();
    block.rays = {u, v, u + kBlock_px, v + kBlock_px};
    block.begin =
        depth_m * (random() % 2 ? 1 - log_uniform(random, 1e-3, 1) : log_uniform(random, 1e-2, 1));
    block.end = depth_m * (1 + log_uniform(random, 1e-3, 1));
    if (random() % 4 == 0) approach_camera_plane(random);
    const SkipMap* of_camera = &skip_map;
    return prepare(block, {&map, 1}, {&of_camera, 1});
  }
  // Ends the block's range close to the plane W = 0 of the camera, if the central ray crosses it.
  void approach_camera_plane(Random& random) {
    const double slope = map.at_infinity.row(2).dot(
                     Vector3d(block.rays.u0_px + 16, block.rays.v0_px + 16, 1)),
                 plane_m = -map.at_eye.z() / slope, off = log_uniform(random, 1e-4, 1);
    if (!(plane_m > 0)) return;
    if (slope > 0)
      block.begin = plane_m * (1 + off), block.end = std::max(block.end, 2 * block.begin);
    else
      block.end = plane_m * (1 - off), block.begin = std::min(block.begin, 0.5 * block.end);
  }
  const BlockCamera& camera() const { return block.cameras[0]; }
  float span() const { return float(block.end - block.begin); }
  float eps_px(float s) const { return camera().eps_px + s * camera().eps_px_per_m; }

  ExactLine line(float i, float j) const {
    const Exact u = block.rays.u0_px + Exact(i), v = block.rays.v0_px + Exact(j);
    const int origin[] = {camera().origin_u_px, camera().origin_v_px},
              sign[] = {camera().sign_u, camera().sign_v};
    ExactLine line;
    for (int row = 2; row >= 0; --row) {
      line.slope[row] = map.at_infinity(row, 0) * u + map.at_infinity(row, 1) * v +
                        Exact(map.at_infinity(row, 2));
      line.at_begin[row] = map.at_eye[row] + Exact(block.begin) * line.slope[row];
      if (row == 2) continue;
      for (Exact* x : {line.at_begin, line.slope})
        x[row] = sign[row] * (x[row] - origin[row] * x[2]) - 0.5L * x[2];
    }
    return line;
  }
  // Returns whether the pixels in the bounds are all object pixels, or all empty.
  bool uniform(const Bounds& bounds, bool object) const {
    const auto first_and_end = [&](int axis, int origin_px, int sign) {
      const auto pixel = [](Exact x) { return int(std::floor(std::clamp(x, -1e6L, 1e6L) + 0.5L)); };
      const int low = pixel(bounds.low[axis]), high = pixel(bounds.high[axis]);
      return sign > 0 ? std::pair(origin_px + low, origin_px + high + 1)
                      : std::pair(origin_px - high - 1, origin_px - low);
    };
    const auto [u0, u1] = first_and_end(0, camera().origin_u_px, camera().sign_u);
    const auto [v0, v1] = first_and_end(1, camera().origin_v_px, camera().sign_v);
    const ObjectPixels& pixels = silhouette.pixels;
    const PixelRect rect{u0, v0, u1, v1},
        in_image = intersection(rect, {0, 0, pixels.width_px(), pixels.height_px()});
    if (object && !(rect == in_image)) return false;
    for (int v = in_image.v0_px; v < in_image.v1_px; ++v)
      if (pixels.find(in_image.u0_px, in_image.u1_px, v, !object) < in_image.u1_px) return false;
    return true;
  }
};

// A ray parameter in the block's range: its begin, where positions have the least error, one at
// which an image is on a pixel border, to rounding, or any.
float parameter(Random& random, const Scene& scene, const ExactLine& line) {
  if (random() % 4 == 0) return 0;
  const float any = float(uniform(random, 0, 1)) * scene.span();
  const int axis = int(random() % 2);
  const double border = std::floor(double(line.position(axis, any))) + 0.5;
  const float at_border = float(line.crossing(axis, border));
  return random() % 2 && at_border > 0 && at_border < scene.span() ? at_border : any;
}

// Calls check(random, scene) for scenes that the kernels support.
template <class Check>
void for_scenes(int count, const Check& check) {
  Random random(1);
  Scene scene;
  for (int made = 0; made < count;) {
    if (!scene.make(random)) continue;
    check(random, scene);
    ++made;
  }
}
// Calls check(camera tag, ...) with the kernels' template parameter.
template <class Check>
void with_directions(const BlockCamera& camera, const Check& check) {
  camera.both_ways ? check(std::true_type()) : check(std::false_type());
}

VF all(float x) { return hn::Set(DF(), x); }
bool first(MF mask) { return bits_of(DF(), mask) & 1; }

// The largest error as a fraction of its bound.
struct Worst {
  double of_bound = 0;
  int count = 0;
  void add(Exact error, Exact bound) {
    of_bound = std::max(of_bound, double(std::abs(error) / bound));
    ++count;
  }
};

TEST(RayMargins, PositionsAreWithinTheirErrorBound) {
  Worst worst;
  for_scenes(400, [&](Random& random, const Scene& scene) {
    EXPECT_LT(scene.eps_px(scene.span()), kBoxMargin_px);
    for (int n = 0; n < 200; ++n) {
      const float i = float(random() % kBlock_px), j = float(random() % kBlock_px),
                  s = float(uniform(random, 0, 1)) * scene.span();
      const ExactLine line = scene.line(i, j);
      const Position p = position(lines_at(scene.camera(), all(i), all(j)), all(s));
      worst.add(hn::GetLane(p.u) - line.position(0, s), scene.eps_px(s));
      worst.add(hn::GetLane(p.v) - line.position(1, s), scene.eps_px(s));
    }
  });
  std::printf("%d positions, worst error %.2f of its bound\n", worst.count, worst.of_bound);
  EXPECT_LE(worst.of_bound, 1);
}

TEST(RayMargins, CrossingsAreWithinTheirErrorBoundAndVerdictsEndInTheirBox) {
  Worst worst;
  int inside = 0, wrong = 0;
  for_scenes(400, [&](Random& random, const Scene& scene) {
    for (int n = 0; n < 2000; ++n) {
      const float i = float(random() % kBlock_px), j = float(random() % kBlock_px);
      const ExactLine line = scene.line(i, j);
      const float s = parameter(random, scene, line);
      with_directions(scene.camera(), [&](auto both) {
        constexpr bool kBothWays = decltype(both)::value;
        const VF eps = all(scene.eps_px(s));
        const auto image = images_at<kBothWays>(lines_at(scene.camera(), all(i), all(j)), all(s));
        VF fu, fv;
        if (first(find_pixels(image, 0, hn::Set(DI(), kNoBorder), all(0), eps, fu, fv))) return;
        const BoxExit exit = box_exit(scene.camera(), image, fu, fv, all(s), eps, scene.span());
        const float next = hn::GetLane(exit.next), error = hn::GetLane(exit.error);
        const bool by_u = first(exit.by_u);
        if (first(exit.inside)) {
          if (!(next > s && next < scene.span())) return;
          Bounds bounds;
          for (const float at : {s, next}) bounds.add(line, at);
          ++inside;
          wrong += !scene.uniform(bounds, true);
          return;
        }
        if (!(hn::GetLane(exit.min_gap) > kPastExtent_px)) return;
        const bool back =
            kBothWays && first(by_u ? image.along_u.backward : image.along_v.backward);
        const Exact pixel = hn::GetLane(by_u ? fu : fv), steps = hn::GetLane(exit.steps),
                    exact = line.crossing(!by_u, pixel + (back ? 0.5L - steps : steps - 0.5L));
        if (exact > s && exact <= scene.span()) worst.add(next - exact, error);
      });
    }
  });
  std::printf("%d crossings, worst error %.2f of its bound; %d verdicts\n", worst.count,
              worst.of_bound, inside);
  EXPECT_LE(worst.of_bound, 1);
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(worst.count, 10'000);
  EXPECT_GT(inside, 10'000);
}

// The images of a tile's rays stay on pixels of one kind until the tile's next position.
TEST(RayMargins, TilesStayOnPixelsOfOneKind) {
  int steps = 0, wrong = 0;
  for_scenes(400, [&](Random& random, const Scene& scene) {
    for (int n = 0; n < 400; ++n) {
      const int size = random() % 2 ? kTile_px : kSmallTile_px;
      const float half = 0.5f * float(size - 1),
                  i = half + float(int(random() % (kBlock_px / unsigned(size))) * size),
                  j = half + float(int(random() % (kBlock_px / unsigned(size))) * size);
      const auto corner = [&](int k) {
        return scene.line(i + (k & 1 ? half : -half), j + (k & 2 ? half : -half));
      };
      const float s = parameter(random, scene, corner(int(random() % 4)));
      with_directions(scene.camera(), [&](auto both) {
        const TileStep step =
            step_tiles<decltype(both)::value>(scene.camera(), half, all(i), all(j), all(s));
        const float next = s + hn::GetLane(step.advance);
        if (first(step.stuck) || !(next <= scene.span())) return;
        Bounds bounds;
        for (int k = 0; k < 4; ++k)
          for (const float at : {s, next}) bounds.add(corner(k), at);
        ++steps;
        wrong += !scene.uniform(bounds, hn::GetLane(step.extent) < 0);
      });
    }
  });
  std::printf("%d steps of tiles, %d wrong\n", steps, wrong);
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(steps, 10'000);
}

// What prepare() computes for a camera, from the images of the block's corner rays in long double.
struct ExpectedCamera {
  int right, down;  // offsets of the last ray, in whole tiles
  int origin_px[2];
  bool back[2], both_ways = false, near_a_limit = false, supported = false;
  Exact eps_px = 0, eps_px_per_m = 0;

  explicit ExpectedCamera(const Scene& scene) {
    const PixelRect& rays = scene.block.rays;
    right = 8 * ((rays.width_px() + 7) / 8) - 1, down = 8 * ((rays.height_px() + 7) / 8) - 1;
    set_origin(scene);
    set_directions(scene);
  }
  void set_origin(const Scene& scene) {
    const PixelRect& rays = scene.block.rays;
    const Vector3d center =
        scene.map.at_eye + scene.block.begin * scene.map.at_infinity *
                               Vector3d(rays.u0_px + 0.5 * right, rays.v0_px + 0.5 * down, 1);
    const PixelRect& stored = scene.skip_map.stored();
    const int low[] = {stored.u0_px, stored.v0_px}, high[] = {stored.u1_px - 1, stored.v1_px - 1};
    for (const int axis : {0, 1})
      origin_px[axis] = int(
          std::clamp(std::trunc(center[axis] / center.z()), double(low[axis]), double(high[axis])));
  }
  void set_directions(const Scene& scene) {
    for (const int axis : {0, 1}) {
      int backward = 0;
      for (const int corner : {0, 1, 2, 3}) {
        const Vector3d ray(scene.block.rays.u0_px + (corner & 1 ? right : 0),
                           scene.block.rays.v0_px + (corner & 2 ? down : 0), 1);
        const Exact a = Exact(scene.map.at_infinity.row(axis).dot(ray)) * scene.map.at_eye.z(),
                    b = Exact(scene.map.at_infinity.row(2).dot(ray)) * scene.map.at_eye[axis],
                    uncertain = 1e-4L * (std::abs(a) + std::abs(b));
        backward += a < b;
        if (std::abs(a - b) <= uncertain) both_ways = true;
        near_a_limit |= std::abs(std::abs(a - b) - uncertain) < 1e-3L * uncertain;
      }
      back[axis] = backward == 4;
      both_ways |= backward % 4 != 0;
    }
  }
  // The bound of every rounding, in units of half an ulp, and whether the kernels accept it.
  void set_bounds(const Scene& scene) {
    const Exact span = scene.block.end - Exact(scene.block.begin);
    const ExactLine first = scene.line(0, 0), along_u = scene.line(1, 0),
                    along_v = scene.line(0, 1);
    Exact min_w = 1e30L, max_begin = 0, max_slope = 0, terms_begin[3], terms_slope[3];
    for (const int corner : {0, 1, 2, 3}) {
      const ExactLine line =
          scene.line(corner & 1 ? float(right) : 0, corner & 2 ? float(down) : 0);
      min_w = std::min({min_w, line.w(0), line.w(span)});
      for (const int axis : {0, 1}) {
        max_begin = std::max(max_begin, std::abs(line.at_begin[axis]));
        max_slope = std::max(max_slope, std::abs(line.slope[axis]));
      }
    }
    for (const int k : {0, 1, 2}) {
      const auto terms = [&](const auto of) {
        return std::abs(of(first)) + right * std::abs(of(along_u) - of(first)) +
               down * std::abs(of(along_v) - of(first));
      };
      terms_begin[k] = terms([k](const ExactLine& l) { return l.at_begin[k]; });
      terms_slope[k] = terms([k](const ExactLine& l) { return l.slope[k]; });
    }
    const Exact terms_w = terms_begin[2] + span * terms_slope[2], ratio = terms_w / min_w;
    const auto eps = [&](const Exact* terms, Exact max) {
      return 0x1p-24L / min_w * (4 * std::max(terms[0], terms[1]) + (4 * ratio + 6) * max);
    };
    eps_px = eps(terms_begin, max_begin), eps_px_per_m = eps(terms_slope, max_slope);
    const Exact largest = eps_px + span * eps_px_per_m;
    supported = min_w > 0 && ratio <= 64 && largest < 1 / 64.0L;
    near_a_limit |= std::abs(ratio - 64) < 0.1L || std::abs(largest - 1 / 64.0L) < 1e-5L ||
                    std::abs(min_w) < 1e-9L;
  }
};

TEST(RayBlocks, CamerasArePreparedFromTheCornerRays) {
  Random random(3);
  Scene scene;
  int supported = 0, rejected = 0, both_ways = 0, back = 0;
  for (int n = 0; n < 800; ++n) {
    scene.block.cameras.clear();
    scene.make(random);
    if (scene.block.cameras.empty()) continue;  // the scene was not visible
    const SkipMap* of_camera = &scene.skip_map;
    if (n % 2) {  // a block of parts of tiles
      scene.block.rays.u1_px -= int(random() % 31), scene.block.rays.v1_px -= int(random() % 31);
    }
    const bool prepared = prepare(scene.block, {&scene.map, 1}, {&of_camera, 1});
    ExpectedCamera expected(scene);
    if (expected.near_a_limit) continue;
    const BlockCamera& c = scene.camera();
    ASSERT_EQ(c.both_ways, expected.both_ways);
    const int sign[] = {c.sign_u, c.sign_v}, origin[] = {c.origin_u_px, c.origin_v_px};
    for (const int axis : {0, 1}) {
      ASSERT_EQ(sign[axis], expected.back[axis] && !expected.both_ways ? -1 : 1);
      ASSERT_NEAR(origin[axis], expected.origin_px[axis], 1e-9);
    }
    expected.set_bounds(scene);
    if (expected.near_a_limit) continue;
    ASSERT_EQ(prepared, expected.supported) << n;
    (prepared ? supported : rejected)++;
    if (!prepared) continue;
    ASSERT_NEAR(c.eps_px, double(expected.eps_px), 1e-5 * c.eps_px);
    ASSERT_NEAR(c.eps_px_per_m, double(expected.eps_px_per_m), 1e-5 * c.eps_px_per_m);
    both_ways += c.both_ways, back += c.sign_u < 0 || c.sign_v < 0;
  }
  EXPECT_GT(supported, 150);
  EXPECT_GT(rejected, 15);
  EXPECT_GT(both_ways, 4);
  EXPECT_GT(back, 80);
}

// Pixels of the block, along the mirrored axes, are those of the skip map.
TEST(RayBlocks, BytesAreTheExtentsOfTheQuadrantAhead) {
  for_scenes(150, [&](Random& random, const Scene& scene) {
    const BlockCamera& c = scene.camera();
    const PixelRect& stored = scene.skip_map.stored();
    const auto in_map = [](float p, int origin_px, int sign) {
      return sign > 0 ? origin_px + int(p) : origin_px - int(p) - 1;
    };
    const auto ends = [&](float low, float high, int origin_px, int sign) {
      return std::minmax({in_map(low, origin_px, sign), in_map(high, origin_px, sign)});
    };
    const auto u_ends = ends(c.min_u, c.max_u, c.origin_u_px, c.sign_u),
               v_ends = ends(c.min_v, c.max_v, c.origin_v_px, c.sign_v);
    ASSERT_LE(c.min_u, c.max_u);
    ASSERT_LE(c.min_v, c.max_v);
    ASSERT_EQ((PixelRect{u_ends.first, v_ends.first, u_ends.second + 1, v_ends.second + 1}),
              stored);
    for (int n = 0; n < 50; ++n) {
      const float fu = c.min_u + float(random() % unsigned(stored.width_px())),
                  fv = c.min_v + float(random() % unsigned(stored.height_px()));
      const int u = in_map(fu, c.origin_u_px, c.sign_u), v = in_map(fv, c.origin_v_px, c.sign_v);
      const std::int8_t* at = c.at_origin + int(fv * c.step_v) + int(fu * c.step_u);
      if (!c.both_ways) {
        ASSERT_EQ(*at, scene.skip_map.at(quadrant_ahead(c.sign_u < 0, c.sign_v < 0), u, v));
        continue;
      }
      for (int box = 0; box < kQuadrants; ++box)
        ASSERT_EQ(at[box * std::ptrdiff_t(c.box_bytes)], scene.skip_map.at(Quadrant(box), u, v));
    }
  });
}

// A map without the quadrant ahead is left to double.
TEST(RayBlocks, NeedTheQuadrantsAhead) {
  for_scenes(40, [&](Random&, const Scene& scene) {
    Block block = scene.block;
    for (int missing = 0; missing < kQuadrants; ++missing) {
      SkipMap map;
      map.assign(scene.silhouette.pixels);
      for (int box = 0; box < kQuadrants; ++box)
        if (box != missing) map.make(Quadrant(box));
      const SkipMap* of_camera = &map;
      const BlockCamera& c = scene.camera();
      ASSERT_EQ(prepare(block, {&scene.map, 1}, {&of_camera, 1}),
                !c.both_ways && Quadrant(missing) != quadrant_ahead(c.sign_u < 0, c.sign_v < 0));
    }
  });
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace fivepipe::hull
