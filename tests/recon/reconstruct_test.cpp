// Tests tiles, the reconstruction of tiles by each backend, and the colour of the hull.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <string>

#include "common/hull/colour/hull_colour.h"
#include "common/pipeline/frames/tile_balancer.h"
#include "recon_node/reconstruct.h"
#include "tests/support/checked_gl_context.h"
#include "tests/support/hull/scenes.h"

namespace fivepipe::recon {
namespace {

using namespace test;
using Eigen::Vector3d;
using hull::HullColour;
using hull::kUnseenBgr;

const Eigen::AlignedBox3d kVolume(Vector3d(-0.4, -0.4, -0.4), Vector3d(0.4, 0.4, 0.4));

TEST(Tiles, AreDisjointAndCoverTheView) {
  test::Random random(1);
  for (int i = 0; i < 200; ++i) {
    const int width = int(test::uniform(random, 1, 90)), height = int(test::uniform(random, 1, 70)),
              columns = int(test::uniform(random, 1, 12)), rows = int(test::uniform(random, 1, 12));
    std::vector<int> covered(std::size_t(width) * height);
    const auto tiles = tiles_of(width, height, columns, rows);
    ASSERT_EQ(int(tiles.size()), columns * rows);
    for (const Tile& tile : tiles) {
      EXPECT_EQ(tile.index, &tile - tiles.data());
      for (int v = tile.rect.v0_px; v < tile.rect.v1_px; ++v)
        for (int u = tile.rect.u0_px; u < tile.rect.u1_px; ++u)
          ++covered.at(std::size_t(v) * width + u);
    }
    for (const int times : covered) ASSERT_EQ(times, 1);
  }
}

struct Recon : ::testing::TestWithParam<config::HullBackend> {
  test::CheckedGlContext context;
};
INSTANTIATE_TEST_SUITE_P(Backends, Recon,
                         ::testing::Values(config::HullBackend::cpu, config::HullBackend::gl,
                                           config::HullBackend::sweep),
                         [](const auto& p) {
                           return p.param == config::HullBackend::cpu  ? "cpu"
                                  : p.param == config::HullBackend::gl ? "gl"
                                                                       : "sweep";
                         });

std::vector<float> assembled(const std::vector<ReconTile>& tiles, const hull::PixelRect& view) {
  std::vector<float> depth_m(view.area_px(), hull::kNoHull);
  for (const ReconTile& t : tiles)
    for (int v = t.covered.v0_px, i = 0; v < t.covered.v1_px; ++v)
      for (int u = t.covered.u0_px; u < t.covered.u1_px; ++u, ++i)
        depth_m[std::size_t(v) * view.width_px() + u] = t.depth_m[i];
  return depth_m;
}

// The cameras see only parts of the object.
TEST_P(Recon, UsesTheHullRuleOfItsConfiguration) {
  test::Random random(14);
  const auto silhouettes =
      test::silhouettes_of({test::narrow_cameras(random, 3), test::random_object(random, 3, 0.15)});
  const hull::View view{test::random_camera(random, 83, 57, 0.7), 0.05, 3.0};
  const hull::PixelRect all = test::whole_image(view.camera);
  const auto depths = [&](config::HullBackend backend, const hull::HullRule& rule) {
    return assembled(Reconstructor({.backend = backend, .hull_rule = rule}, kVolume)
                         .reconstruct({silhouettes}, view, tiles_of(83, 57, 3, 2), false),
                     all);
  };
  const auto hits = [](const std::vector<float>& depth_m) {
    return std::count_if(depth_m.begin(), depth_m.end(),
                         [](float d) { return d != hull::kNoHull; });
  };
  const auto by_all = hits(depths(GetParam(), {}));
  const auto of_cpu = [&](const hull::HullRule& rule) {
    return hits(depths(config::HullBackend::cpu, rule));
  };
  // The sweep misses rays that pass the hull between two planes.
  const double tolerance = GetParam() == config::HullBackend::sweep ? 0.25 : 0;
  for (const int min_seen : {1, 2}) {
    const hull::HullRule rule{hull::Limits::seen, min_seen};
    EXPECT_GT(hits(depths(GetParam(), rule)), by_all + 30);
    EXPECT_NEAR(hits(depths(GetParam(), rule)), of_cpu(rule), tolerance * double(of_cpu(rule)));
  }
  // A box whose top is halfway between two depths near the median, so that rounding decides no
  // pixel.
  const std::vector<float> whole = depths(config::HullBackend::cpu, {});
  std::vector<double> z_m;
  for (int i = 0; i < int(whole.size()); ++i)
    if (whole[std::size_t(i)] != hull::kNoHull) {
      const geometry::Ray ray = geometry::ray_through(view.camera, Eigen::Vector2d(i % 83, i / 83));
      z_m.push_back(ray.origin_world_m.z() +
                    double(whole[std::size_t(i)]) * ray.direction_world.z());
    }
  ASSERT_GT(z_m.size(), 30u);
  std::sort(z_m.begin(), z_m.end());
  hull::HullRule half;
  const double top_m = 0.5 * (z_m[z_m.size() / 2] + z_m[z_m.size() / 2 + 1]);
  half.within_world_m = {Vector3d(-0.4, -0.4, -0.4), Vector3d(0.4, 0.4, top_m)};
  EXPECT_NE(depths(GetParam(), half), depths(GetParam(), {}));
  EXPECT_GT(hits(depths(GetParam(), half)), 0);
  EXPECT_NEAR(hits(depths(GetParam(), half)), of_cpu(half), tolerance * double(of_cpu(half)));
}

// With coverage, the depth is that of the coverage hull inside of the rule's box.
TEST(ReconCoverage, UsesTheOutlines) {
  test::Random random(14);
  const auto object = test::random_object(random, 3, 0.15);
  const auto cameras = test::random_cameras(random, 3);
  const auto silhouettes = test::silhouettes_of(object, cameras);
  std::vector<hull::CoverageSilhouette> covered;
  std::vector<hull::CoverageOutline> outlines;
  for (const hull::Silhouette& s : silhouettes) {
    covered.push_back({s.camera, hull::true_coverage(object, s.camera)});
    outlines.push_back(covered.back().map.dense().outline(s.pixels));
  }
  const hull::View view{test::random_camera(random, 83, 57, 0.7), 0.05, 3.0};
  const hull::PixelRect all = test::whole_image(view.camera);
  hull::HullRule half;
  half.within_world_m = {Vector3d(-0.4, -0.4, -0.4), Vector3d(0.4, 0.4, 0.02)};
  for (const hull::HullRule& rule : {hull::HullRule(), half}) {
    Reconstructor reconstructor(
        {.backend = config::HullBackend::cpu, .hull_rule = rule, .coverage = true}, kVolume);
    const auto depths = [&](const Reconstructor::Maps& maps) {
      return assembled(reconstructor.reconstruct(maps, view, tiles_of(83, 57, 3, 2), false), all);
    };
    base::WorkerPool pool(1);
    const auto of_coverage = hull::CoverageHull(pool, covered, rule).depth(view, all).depth_m;
    EXPECT_EQ(depths({silhouettes, outlines}), of_coverage);
    const auto binary = hull::CpuHull(pool, silhouettes, rule).depth(view, all).depth_m;
    EXPECT_EQ(depths({silhouettes}), binary) << "without outlines";
    EXPECT_NE(binary, of_coverage);
    EXPECT_GT(std::count_if(binary.begin(), binary.end(), [](float d) { return d > 0; }), 100);
  }
}

TEST_P(Recon, TilesFromAnyNodeEqualTheWholeViewBitForBit) {
  test::Random random(4);
  const auto silhouettes =
      test::silhouettes_of({test::random_cameras(random, 3), test::random_object(random, 3, 0.15)});
  const hull::View view{test::random_camera(random, 83, 57, 0.7), 0.05, 3.0};
  const hull::PixelRect all = test::whole_image(view.camera);
  Reconstructor reconstructor({.backend = GetParam()}, kVolume);
  const auto whole =
      assembled(reconstructor.reconstruct({silhouettes}, view, tiles_of(83, 57, 1, 1), false), all);
  EXPECT_GT(std::count_if(whole.begin(), whole.end(), [](float d) { return d != hull::kNoHull; }),
            100);
  for (const auto& [columns, rows, shares] :
       {std::array{4, 3, 2}, {7, 5, 3}, {1, 1, 1}, {2, 100, 2}}) {
    const auto owners = frames::round_robin_tiles(columns, rows, frames::all_workers(shares));
    std::vector<ReconTile> made;
    for (int share = 0; share < shares; ++share) {
      std::vector<Tile> own = tiles_of(83, 57, columns, rows);
      std::erase_if(own,
                    [&](const Tile& tile) { return owners[std::size_t(tile.index)] != share; });
      for (auto& tile : reconstructor.reconstruct({silhouettes}, view, own, false)) {
        EXPECT_GE(tile.cost_s, 0);
        made.push_back(std::move(tile));
      }
    }
    EXPECT_EQ(made.size(), std::size_t(columns) * rows);
    EXPECT_EQ(assembled(made, all), whole);
  }
}

TEST_P(Recon, SeveralViewsOfAFrameEqualSingleOnes) {
  test::Random random(6);
  const auto silhouettes =
      test::silhouettes_of({test::random_cameras(random, 3), test::random_object(random, 3, 0.15)});
  const std::vector<Reconstructor::ViewTiles> views{
      {{test::random_camera(random, 83, 57, 0.7), 0.05, 3.0}, tiles_of(83, 57, 2, 2), false},
      {{test::random_camera(random, 40, 64, 0.9), 0.1, 4.0}, tiles_of(40, 64, 3, 1), false}};
  Reconstructor reconstructor({.backend = GetParam()}, kVolume);
  const auto together = reconstructor.reconstruct({silhouettes}, views);
  ASSERT_EQ(together.size(), 2u);
  for (std::size_t i = 0; i < views.size(); ++i) {
    const hull::PixelRect all = test::whole_image(views[i].view.camera);
    const auto alone = assembled(
        reconstructor.reconstruct({silhouettes}, views[i].view, views[i].tiles, false), all);
    EXPECT_EQ(assembled(together[i], all), alone) << i;
    EXPECT_GT(std::count_if(alone.begin(), alone.end(), [](float d) { return d != hull::kNoHull; }),
              50);
  }
}

TEST_P(Recon, FollowsTheViewsSizeAndTheSilhouettes) {
  test::Random random(4);
  const auto object = test::random_object(random, 3, 0.15);
  const auto silhouettes = test::silhouettes_of(object, test::random_cameras(random, 3));
  Reconstructor reconstructor({.backend = GetParam()}, kVolume);
  const hull::View small{test::random_camera(random, 40, 30, 0.7), 0.05, 3.0};
  hull::View large = small;
  large.camera.pinhole = geometry::resized(small.camera.pinhole, 81, 61);
  const auto tiles = tiles_of(40, 30, 4, 3), large_tiles = tiles_of(81, 61, 4, 3);
  const auto first = assembled(reconstructor.reconstruct({silhouettes}, small, tiles, false),
                               test::whole_image(small.camera));
  EXPECT_EQ(
      reconstructor.reconstruct({silhouettes}, large, large_tiles, false).back().tile.rect.u1_px,
      81);
  EXPECT_EQ(
      assembled(reconstructor.reconstruct({std::span(silhouettes).first(0)}, small, tiles, false),
                test::whole_image(small.camera)),
      std::vector<float>(1200, hull::kNoHull));
  EXPECT_EQ(assembled(reconstructor.reconstruct({silhouettes}, small, tiles, false),
                      test::whole_image(small.camera)),
            first);
}

TEST(ReconBackends, ExactBackendsGiveTheSameDepths) {
  const test::CheckedGlContext context;
  test::Random random(11);
  const auto silhouettes =
      test::silhouettes_of({test::random_cameras(random, 4), test::random_object(random, 3, 0.15)});
  const hull::View view{test::random_camera(random, 83, 57, 0.7), 0.05, 3.0};
  const auto tiles = tiles_of(83, 57, 3, 2);
  const auto depths = [&](const config::ReconConfig& config) {
    return assembled(Reconstructor(config, kVolume).reconstruct({silhouettes}, view, tiles, false),
                     test::whole_image(view.camera));
  };
  const auto cpu = depths({.backend = config::HullBackend::cpu});
  EXPECT_EQ(depths({.backend = config::HullBackend::cpu, .threads = 3}), cpu);
  const auto gl = depths({.backend = config::HullBackend::gl});
  for (std::size_t i = 0; i < cpu.size(); ++i) {
    ASSERT_EQ(cpu[i] == hull::kNoHull, gl[i] == hull::kNoHull);
    EXPECT_LE(std::abs(cpu[i] - gl[i]), 2e-6f * cpu[i]);
  }
}

// Each view changes only the width or only the height. Backend `sweep` has a framebuffer of the
// view's size.
TEST_P(Recon, DependsOnNoEarlierView) {
  test::Random random(4);
  const auto silhouettes =
      test::silhouettes_of({test::random_cameras(random, 3), test::random_object(random, 3, 0.15)});
  Reconstructor reconstructor({.backend = GetParam()}, kVolume);
  hull::View view{test::random_camera(random, 40, 30, 0.7), 0.05, 3.0};
  for (const auto& [width, height] : {std::pair{40, 30}, {64, 30}, {64, 55}, {40, 55}, {40, 30}}) {
    view.camera.pinhole = geometry::resized(view.camera.pinhole, width, height);
    const auto tiles = tiles_of(width, height, 2, 2);
    const hull::PixelRect all = test::whole_image(view.camera);
    const auto again = assembled(reconstructor.reconstruct({silhouettes}, view, tiles, false), all);
    EXPECT_EQ(again, assembled(Reconstructor({.backend = GetParam()}, kVolume)
                                   .reconstruct({silhouettes}, view, tiles, false),
                               all))
        << width << ' ' << height;
    EXPECT_GT(std::count_if(again.begin(), again.end(), [](float d) { return d > 0; }), 30);
  }
}

// The eye is inside the hull, so a depth costs little, and each pixel gets colour from ten images.
TEST_P(Recon, TheCostsOfTheTilesAreAPartOfTheElapsedTime) {
  const geometry::Camera camera{geometry::pinhole_from_fov(64, 48, 0.8),
                                geometry::look_at({0.3, 0, 0}, {0, 0, 0})};
  hull::ColourRegion region{camera, {64, 48}, test::whole_image(camera), {}};
  for (int v = 0; v < 48; ++v) region.pixels.set_run(0, 64, v);
  region.bgr.assign(3 * 64 * 48, 99);
  const std::vector<hull::Silhouette> silhouettes{{camera, region.pixels}};
  const std::vector<hull::ColourRegion> regions(10, region);
  const hull::View view{camera, 0.05, 3.0};
  Reconstructor reconstructor({.backend = GetParam()}, kVolume);
  const auto start = std::chrono::steady_clock::now();
  const auto tiles =
      reconstructor.reconstruct({silhouettes, {}, regions}, view, tiles_of(64, 48, 2, 1), true);
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  ASSERT_EQ(tiles.size(), 2u);
  for (const ReconTile& tile : tiles) EXPECT_GT(tile.cost_s, 0);
  EXPECT_LE(tiles[0].cost_s + tiles[1].cost_s, elapsed.count());
}

TEST(DividedByHits, AnEmptyTileCostsAsMuchAsAHundredHits) {
  const auto tile_with = [](std::size_t hits) {
    hull::DepthTile tile{{0, 0, 50, 10}, std::vector<float>(500, hull::kNoHull)};
    std::fill_n(tile.depth_m.begin() + 3, hits, 1.25f);
    return tile;
  };
  EXPECT_EQ(divided_by_hits(4.5, {tile_with(0), tile_with(50), tile_with(100)}),
            (std::vector<double>{1.0, 1.5, 2.0}));
}

TEST(CoveredPart, IsTheSmallestRectangleWithEveryHit) {
  hull::DepthTile depths{{10, 20, 15, 24}, std::vector<float>(20, hull::kNoHull)};
  const Tile tile{3, depths.rect};
  EXPECT_EQ(covered_part(tile, depths).covered, hull::PixelRect{});
  EXPECT_EQ(covered_part(tile, depths).cost_s, 0);
  depths.depth_m[1 * 5 + 3] = 1.5f;
  depths.depth_m[2 * 5 + 1] = 2.5f;
  const ReconTile part = covered_part(tile, depths);
  EXPECT_EQ(part.tile, tile);
  EXPECT_EQ(part.covered, (hull::PixelRect{11, 21, 14, 23}));
  EXPECT_EQ(part.depth_m, (std::vector<float>{hull::kNoHull, hull::kNoHull, 1.5f, 2.5f,
                                              hull::kNoHull, hull::kNoHull}));
}

using Bgr = std::array<std::uint8_t, 3>;
constexpr Bgr kBlue = {250, 0, 0}, kRed = {0, 0, 250};

hull::ColourRegion plain(const geometry::Camera& camera, const hull::PixelRect& region,
                         const Bgr& bgr) {
  hull::ColourRegion colour{
      camera, {camera.pinhole.width_px, camera.pinhole.height_px}, region, {}};
  for (int v = region.v0_px; v < region.v1_px; ++v)
    colour.pixels.set_run(region.u0_px, region.u1_px, v);
  for (std::size_t i = 0; i < region.area_px(); ++i)
    colour.bgr.insert(colour.bgr.end(), bgr.begin(), bgr.end());
  return colour;
}

// A ball at the origin, a blue camera at +x, a red camera at -y.
struct Colour : ::testing::Test {
  std::vector<hull::Capsule> object{{{0, 0, 0}, {0, 0, 0}, 0.05}};
  geometry::Camera at_x{geometry::pinhole_from_fov(200, 150, 0.8),
                        geometry::look_at({1, 0, 0}, {0, 0, 0})},
      at_y{geometry::pinhole_from_fov(200, 150, 0.8), geometry::look_at({0, -1, 0}, {0, 0, 0})};
  geometry::Camera at_z{geometry::pinhole_from_fov(200, 150, 0.8),
                        geometry::look_at({0, 0, 1}, {0, 0, 0}, Vector3d::UnitX())};

  // Those of the three cameras with a ball between the object and the blue camera, and of a fourth
  // camera that looks away.
  std::vector<hull::Silhouette> occluded_silhouettes() {
    object.push_back({{0.15, 0, 0}, {0.15, 0, 0}, 0.04});
    auto silhouettes = test::silhouettes_of(object, {at_x, at_y, at_z});
    geometry::Camera away = at_z;
    away.camera_from_world = geometry::look_at({0, 0, 1}, {0, 0, 2}, Vector3d::UnitY());
    silhouettes.push_back(
        {away, hull::ObjectPixels(away.pinhole.width_px, away.pinhole.height_px)});
    return silhouettes;
  }
  std::vector<hull::ColourRegion> blue_and_red() const {
    return {plain(at_x, test::whole_image(at_x), kBlue),
            plain(at_y, test::whole_image(at_y), kRed)};
  }
};

TEST_F(Colour, WeightsTheCameraClosestToTheEyeDirection) {
  const auto silhouettes = test::silhouettes_of(object, {at_x, at_y, at_z});
  const std::vector<hull::ColourRegion> regions{plain(at_x, test::whole_image(at_x), kBlue),
                                                plain(at_y, test::whole_image(at_y), kRed)};
  const HullColour colour(silhouettes, regions);
  const Vector3d p = 0.05 * Vector3d(1, -1, 0).normalized();
  const Bgr bluish = colour.at(p, {1, -0.5, 0}), reddish = colour.at(p, {0.5, -1, 0});
  EXPECT_GT(bluish[0], 3 * bluish[2]);
  EXPECT_GT(reddish[2], 3 * reddish[0]);
  EXPECT_NEAR(bluish[0], reddish[2], 1);  // mirrored views, mirrored blend
}

TEST_F(Colour, UsesOnlyObjectPixels) {
  const auto silhouettes = test::silhouettes_of(object, {at_x, at_y, at_z});
  hull::ColourRegion region = plain(at_x, test::whole_image(at_x), kRed);  // background
  for (int v = 0; v < 150; ++v)
    for (int u = 0; u < 200; ++u)
      if (silhouettes[0].pixels.contains(u, v))
        std::copy(kBlue.begin(), kBlue.end(), region.bgr.begin() + 3 * (v * 200 + u));
  const HullColour colour(silhouettes, std::span(&region, 1));
  for (int v = 0; v < 150; ++v)
    for (int u = 0; u < 200; ++u) {
      // Half a pixel off the centres, so that the four pixels around it straddle the border.
      const geometry::Ray ray = geometry::ray_through(at_x, {u + 0.5, v + 0.5});
      const Bgr bgr = colour.at(ray.origin_world_m + ray.direction_world, {1, 0, 0});
      EXPECT_TRUE(bgr == kBlue || bgr == kUnseenBgr) << u << ' ' << v;
    }
}

// If a camera gives no shape, pixels that capture_node did not send have no colour.
TEST_F(Colour, UsesOnlySentPixels) {
  const auto silhouettes = test::silhouettes_of(object, {at_y, at_z});
  hull::ColourRegion region = plain(at_x, test::whole_image(at_x), kRed);
  for (int v = 0; v < 150; ++v)
    for (int u = 0; u < 200; ++u) {
      const bool sent = (u - 100) * (u - 100) + (v - 75) * (v - 75) < 400;
      region.pixels.set(u, v, sent);
      if (sent) std::copy(kBlue.begin(), kBlue.end(), region.bgr.begin() + 3 * (v * 200 + u));
    }
  const HullColour colour(silhouettes, std::span(&region, 1));
  int blue = 0;
  for (int v = 0; v < 150; ++v)
    for (int u = 0; u < 200; ++u) {
      const geometry::Ray ray = geometry::ray_through(at_x, {u + 0.5, v + 0.5});
      const Bgr bgr = colour.at(ray.origin_world_m + ray.direction_world, {1, 0, 0});
      EXPECT_TRUE(bgr == kBlue || bgr == kUnseenBgr) << u << ' ' << v;
      blue += bgr == kBlue;
    }
  EXPECT_GT(blue, 1200);
}

// The regions contain the object pixels, as capture_node sends them. The border of the hull
// projects onto the border of the outermost pixels, and the rounding of the depth decides on which
// side of it a point is.
TEST_F(Colour, HullAtTheBorderOfTheSentPixelsHasColour) {
  object.push_back({{-0.1, -0.08, -0.06}, {0.12, 0.1, 0.08}, 0.02});
  const auto silhouettes = test::silhouettes_of(object, {at_x, at_y, at_z});
  for (const hull::Silhouette& sent : silhouettes) {
    hull::ColourRegion colour = plain(sent.camera, sent.pixels.bounds(), kBlue);
    colour.pixels = sent.pixels;
    const hull::View view{
        {geometry::pinhole_from_fov(320, 240, 0.4), geometry::look_at({0.6, -0.6, 0.5}, {0, 0, 0})},
        0.05,
        3};
    Reconstructor reconstructor({.backend = config::HullBackend::cpu}, kVolume);
    int hits = 0, unseen = 0;
    for (const ReconTile& tile : reconstructor.reconstruct({silhouettes, {}, std::span(&colour, 1)},
                                                           view, tiles_of(320, 240, 4, 3), true))
      for (std::size_t i = 0; i < tile.depth_m.size(); ++i) {
        if (tile.depth_m[i] == hull::kNoHull) continue;
        ++hits;
        unseen += Bgr{tile.bgr[3 * i], tile.bgr[3 * i + 1], tile.bgr[3 * i + 2]} != kBlue;
      }
    EXPECT_GT(hits, 3000);
    EXPECT_EQ(unseen, 0);
  }
}

TEST_F(Colour, IgnoresRegionsThatDoNotContainThePoint) {
  const auto silhouettes = test::silhouettes_of(object, {at_x, at_y, at_z});
  const Vector3d p = 0.05 * Vector3d(1, -1, 0).normalized(), eye(1, -0.1, 0);
  const std::vector<hull::ColourRegion> cut{plain(at_x, {0, 0, 60, 150}, kBlue),
                                            plain(at_y, test::whole_image(at_y), kRed)};
  EXPECT_EQ(HullColour(silhouettes, cut).at(p, eye), kRed);
  EXPECT_EQ(HullColour(silhouettes, {}).at(p, eye), kUnseenBgr);
  EXPECT_EQ(HullColour(silhouettes, std::span(cut).first(1)).at(p, eye), kUnseenBgr);
  const std::vector<hull::ColourRegion> empty{plain(at_x, {}, kBlue)};
  EXPECT_EQ(HullColour(silhouettes, empty).at(p, eye), kUnseenBgr);
}

TEST_F(Colour, OccludedCamerasAreUsedLast) {
  object.push_back({{0.15, 0, 0}, {0.15, 0, 0}, 0.04});  // between the ball and the blue camera
  const auto silhouettes = test::silhouettes_of(object, {at_x, at_y, at_z});
  const std::vector<hull::ColourRegion> regions{plain(at_x, test::whole_image(at_x), kBlue),
                                                plain(at_y, test::whole_image(at_y), kRed)};
  const Vector3d p = 0.05 * Vector3d(1, -0.2, 0).normalized(), eye(1, -0.3, 0);
  EXPECT_EQ(HullColour(silhouettes, regions).at(p, eye), kRed);
  EXPECT_EQ(HullColour(silhouettes, std::span(regions).first(1)).at(p, eye), kBlue);
}

// A camera that looks away limits nothing, so the ball in front of the blue camera still occludes.
TEST_F(Colour, TheCamerasThatSeeAPointDecideWhetherItOccludes) {
  auto silhouettes = occluded_silhouettes();
  const std::vector<hull::ColourRegion> regions = blue_and_red();
  const Vector3d p = 0.05 * Vector3d(1, -0.2, 0).normalized(), eye(1, -0.3, 0);
  EXPECT_EQ(HullColour(silhouettes, regions, {hull::Limits::seen, 3}).at(p, eye), kRed);
  EXPECT_EQ(HullColour(silhouettes, regions, {hull::Limits::seen, 4}).at(p, eye), kBlue)
      << "fewer see the occluder than the hull needs";
  // A camera that sees the place of the ball empty removes it.
  silhouettes.back().camera = at_z;
  EXPECT_EQ(HullColour(silhouettes, regions, {hull::Limits::seen, 3}).at(p, eye), kBlue);
}

// Without the rule, the camera that looks away would leave no hull that occludes.
TEST_F(Colour, OfAReconstructionIsOccludedByTheHullOfItsRule) {
  const auto silhouettes = occluded_silhouettes();
  const std::vector<hull::ColourRegion> regions = blue_and_red();
  const hull::View view{{geometry::pinhole_from_fov(61, 45, 0.4),
                         geometry::look_at({0.6, -0.6, 0}, {0.049, -0.01, 0})},
                        0.05,
                        3};
  Reconstructor reconstructor(
      {.backend = config::HullBackend::cpu, .hull_rule = {hull::Limits::seen, 3}}, kVolume);
  const ReconTile tile =
      reconstructor.reconstruct({silhouettes, {}, regions}, view, tiles_of(61, 45, 1, 1), true)
          .front();
  const auto centre =
      std::size_t((22 - tile.covered.v0_px) * tile.covered.width_px() + 30 - tile.covered.u0_px);
  ASSERT_LT(3 * centre, tile.bgr.size());
  ASSERT_NE(tile.depth_m[centre], hull::kNoHull);
  EXPECT_EQ((Bgr{tile.bgr[3 * centre], tile.bgr[3 * centre + 1], tile.bgr[3 * centre + 2]}), kRed);
}

TEST_F(Colour, IsInterpolatedBetweenPixelCentres) {
  hull::ColourRegion ramp = plain(at_x, {90, 60, 110, 90}, {});  // blue grows by 10 per pixel in u
  ramp.bgr.clear();
  for (int v = 60; v < 90; ++v)
    for (int u = 90; u < 110; ++u)
      ramp.bgr.insert(ramp.bgr.end(), {std::uint8_t((u - 90) * 10), 7, 9});
  const auto silhouettes = test::silhouettes_of(object, {at_x, at_y});
  const geometry::Ray ray = geometry::ray_through(at_x, {97.3, 75});
  EXPECT_EQ(HullColour(silhouettes, std::span(&ramp, 1))
                .at(ray.origin_world_m + 0.96 * ray.direction_world, {1, 0, 0}),
            (Bgr{73, 7, 9}));
}

// Returns the weighted mean of the images, computed by the definition: without skipping images and
// by projecting each point of a line of sight on its own. nullopt if no image contains the point.
std::optional<Vector3d> reference_bgr(std::span<const hull::Silhouette> silhouettes,
                                      std::span<const hull::ColourRegion> regions,
                                      const Vector3d& p_world_m, const Vector3d& eye_world_m) {
  const auto is_in = [](const hull::Silhouette& s, const Vector3d& at_world_m) {
    const auto uv = geometry::project(s.camera, at_world_m);
    return uv && s.pixels.contains(int(std::floor(uv->x() + 0.5)), int(std::floor(uv->y() + 0.5)));
  };
  Vector3d sum = Vector3d::Zero();
  double weights = 0;
  for (const hull::ColourRegion& region : regions) {
    const hull::Silhouette* own = nullptr;
    for (const hull::Silhouette& s : silhouettes)
      if (s.camera.pinhole == region.camera.pinhole &&
          s.camera.camera_from_world.isApprox(region.camera.camera_from_world))
        own = &s;
    const auto uv = geometry::project(region.camera, p_world_m);
    if (!uv) continue;
    const Vector3d to_camera_m = geometry::camera_center_world_m(region.camera) - p_world_m;
    const double cosine = to_camera_m.normalized().dot((eye_world_m - p_world_m).normalized());
    double weight = std::pow((1 + cosine) / 2, 16);
    const auto is_hull_at = [&](double distance_m) {
      const Vector3d at_m = p_world_m + distance_m * to_camera_m.normalized();
      return !silhouettes.empty() && distance_m < to_camera_m.norm() &&
             std::all_of(silhouettes.begin(), silhouettes.end(),
                         [&](const auto& s) { return is_in(s, &s == own ? p_world_m : at_m); });
    };
    if (is_hull_at(0.04) || is_hull_at(0.08) || is_hull_at(0.16))
      weight *= 1e-9;
    else if (is_hull_at(0.02))
      weight *= 0.3;
    for (int v = int(std::floor(uv->y())), corner = 0; corner < 4; ++corner) {
      const int u_px = int(std::floor(uv->x())) + corner % 2, v_px = v + corner / 2;
      if (!region.pixels.contains(u_px, v_px) || (own && !own->pixels.contains(u_px, v_px)))
        continue;
      const double bilinear = (1 - std::abs(uv->x() - u_px)) * (1 - std::abs(uv->y() - v_px));
      const std::uint8_t* bgr =
          &region.bgr[3 * std::size_t((v_px - region.region.v0_px) * region.region.width_px() +
                                      u_px - region.region.u0_px)];
      sum += weight * bilinear * Vector3d(bgr[0], bgr[1], bgr[2]);
      weights += weight * bilinear;
    }
  }
  return weights > 0 ? std::optional<Vector3d>(sum / weights) : std::nullopt;
}

// Cameras among the points, images with holes, cut regions, images without a silhouette.
TEST_F(Colour, EqualsTheDefinitionForRandomImages) {
  test::Random random(8);
  // Half a level of rounding, and a quarter for the images that are skipped.
  constexpr double kTolerance = 0.76;
  std::map<std::string, int> cases;
  for (int round = 0; round < 60; ++round) {
    std::vector<hull::Silhouette> silhouettes;
    std::vector<hull::ColourRegion> regions;
    const int cameras = 1 + round % 5;
    for (int i = 0; i < cameras; ++i) {
      geometry::Camera camera = test::random_camera(random, 37, 29, round % 3 ? 0.8 : 0.15);
      camera.pinhole.fy_px *= 1.2;
      camera.pinhole.cx_px += 1.5;
      const hull::ObjectPixels pixels = test::random_pixels(random, 37, 29, 0.93);
      if (round % 4 != 1 || i % 2 == 0) silhouettes.push_back({camera, pixels});
      if (round % 7 == 2 && i == 0) continue;
      const hull::PixelRect cut{int(random() % 5), int(random() % 5), 37 - int(random() % 5),
                                29 - int(random() % 5)};
      regions.push_back({camera, pixels, cut, std::vector<std::uint8_t>(3 * cut.area_px())});
      hull::ObjectPixels inside(37, 29);
      for (int v = cut.v0_px; v < cut.v1_px; ++v) inside.set_run(cut.u0_px, cut.u1_px, v);
      regions.back().pixels.keep(inside);
      for (std::uint8_t& level : regions.back().bgr) level = random() % 4 ? random() % 256 : 0;
    }
    if (round % 10 == 9) silhouettes.clear();
    std::shuffle(silhouettes.begin(), silhouettes.end(), random);
    const HullColour colour(silhouettes, regions);
    for (int i = 0; i < 150; ++i) {
      const Vector3d p = test::random_in_ball(random, 0.15);
      const Vector3d eye = p + test::random_direction(random);
      const auto expected = reference_bgr(silhouettes, regions, p, eye);
      const Bgr bgr = colour.at(p, eye);
      if (!expected) {
        EXPECT_EQ(bgr, (Bgr{128, 128, 128}));
        ++cases["unseen"];
        continue;
      }
      ++cases["seen"];
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(bgr[std::size_t(c)], (*expected)[c], kTolerance) << round << ' ' << i;
    }
  }
  EXPECT_GT(cases["seen"], 3000);
  EXPECT_GT(cases["unseen"], 300);
}

// Two images of equal weight see the origin. The blue one has hull on its line of sight, occluder_m
// from the origin. Returns the weight of the blue image, as a fraction of both.
double weight_of_occluded_image(double occluder_m, double camera_m = 1) {
  const auto camera_at = [](const Vector3d& eye) {
    return geometry::Camera{geometry::pinhole_from_fov(401, 101, 0.6),
                            geometry::look_at(eye, {0, 0, 0}, {1, 1, 1})};
  };
  const geometry::Camera blue = camera_at({camera_m, 0, 0}), red = camera_at({0, 0, 1});
  hull::Silhouette side{
      {geometry::pinhole_from_fov(401, 101, 0.6), geometry::look_at({0, -1, 0}, {0, 0, 0})},
      {401, 101}};
  const auto uv_px = geometry::project(side.camera, {occluder_m, 0, 0});
  side.pixels.set(int(std::lround(uv_px->x())), int(std::lround(uv_px->y())));
  const std::vector<hull::ColourRegion> regions{plain(blue, test::whole_image(blue), {240, 0, 0}),
                                                plain(red, test::whole_image(red), {0, 0, 240})};
  const Bgr bgr = HullColour(std::span(&side, 1), regions).at({0, 0, 0}, {1, 0, 1});
  return double(bgr[0]) / (bgr[0] + bgr[2]);
}

// A pixel of the silhouette is 1.5 mm wide at the line of sight.
TEST_F(Colour, HullInFrontOfThePointHidesItAtFourDistances) {
  constexpr double kRounding = 0.005;
  for (const double visible_m :
       {0.01, 0.016, 0.024, 0.037, 0.043, 0.077, 0.083, 0.12, 0.155, 0.165})
    EXPECT_NEAR(weight_of_occluded_image(visible_m), 0.5, kRounding) << visible_m;
  for (const double hidden_m : {0.04, 0.08, 0.16})
    EXPECT_NEAR(weight_of_occluded_image(hidden_m), 0, kRounding) << hidden_m;
  EXPECT_NEAR(weight_of_occluded_image(0.02), 0.3 / 1.3, kRounding);
  // Hull behind the camera hides nothing.
  EXPECT_NEAR(weight_of_occluded_image(0.08, 0.07), 0.5, kRounding);
}

// The eye sees the origin from the direction of the blue camera. The weight of the red one is
// ((1 + cos a) / 2) ^ 16 for the angle a between them.
TEST_F(Colour, AHiddenImageAndAnImageFromBehindCountByTheirWeights) {
  const auto weight_of_blue = [](double red_weight, bool blue_is_hidden) {
    const double cosine = 2 * std::pow(red_weight, 1.0 / 16) - 1;
    const auto camera_at = [](const Vector3d& eye) {
      return geometry::Camera{geometry::pinhole_from_fov(61, 45, 0.6),
                              geometry::look_at(eye, {0, 0, 0})};
    };
    const geometry::Camera blue = camera_at({1, 0, 0}),
                           red = camera_at({cosine, 0, std::sqrt(1 - cosine * cosine)});
    hull::Silhouette side{camera_at({0, -1, 0}), {61, 45}};
    const auto uv_px = geometry::project(side.camera, {0.08, 0, 0});
    if (blue_is_hidden) side.pixels.set(int(std::lround(uv_px->x())), int(std::lround(uv_px->y())));
    const std::vector<hull::ColourRegion> regions{plain(blue, test::whole_image(blue), {250, 0, 0}),
                                                  plain(red, test::whole_image(red), {0, 0, 250})};
    const Bgr bgr = HullColour(std::span(&side, 1), regions).at({0, 0, 0}, {1, 0, 0});
    return double(bgr[0]) / (bgr[0] + bgr[2]);
  };
  EXPECT_NEAR(weight_of_blue(0.25, false), 0.8, 0.005);
  EXPECT_NEAR(weight_of_blue(1e-9, true), 0.5, 0.005);  // a hidden image has a billionth
}

// The second image would add a third of a level, and less than the 1024th part of the weight.
TEST_F(Colour, SkipsImagesWithLessThanAThousandthOfTheWeight) {
  const auto blue_level = [](double weight) {
    const double cosine = 2 * std::pow(weight, 1.0 / 16) - 1;
    std::vector<hull::ColourRegion> regions;
    for (const Vector3d& eye : {Vector3d(1, 0, 0), {cosine, 0, std::sqrt(1 - cosine * cosine)}}) {
      const geometry::Camera camera{geometry::pinhole_from_fov(20, 20, 0.6),
                                    geometry::look_at(eye, {0, 0, 0})};
      regions.push_back(plain(camera, test::whole_image(camera), kBlue));
    }
    // The levels of the first image vary so that its mean is 10.4 at the center.
    for (std::size_t i = 0; i < regions[0].bgr.size(); i += 3)
      regions[0].bgr[i] = (i / 3) % 20 == 9 ? 10 : 11;
    const geometry::Ray ray = geometry::ray_through(regions[0].camera, {9.4, 9});
    return HullColour({}, regions).at(ray.origin_world_m + ray.direction_world, {1, 0, 0})[0];
  };
  EXPECT_EQ(blue_level(0.0008), 10);
  EXPECT_EQ(blue_level(0.0012), 11);
}

TEST_F(Colour, IsComputedForHitsOnlyAndOnRequest) {
  const auto silhouettes = test::silhouettes_of(object, {at_x, at_y, at_z});
  const std::vector<hull::ColourRegion> regions{plain(at_x, test::whole_image(at_x), kBlue)};
  const hull::View view{
      {geometry::pinhole_from_fov(60, 45, 0.4), geometry::look_at({0.8, -0.3, 0.2}, {0, 0, 0})},
      0.05,
      3};
  Reconstructor reconstructor({.backend = config::HullBackend::cpu}, kVolume);
  const auto tiles = tiles_of(60, 45, 4, 3);
  for (const ReconTile& tile :
       reconstructor.reconstruct({silhouettes, {}, regions}, view, tiles, false))
    EXPECT_TRUE(tile.bgr.empty());
  int coloured = 0;
  for (const ReconTile& tile :
       reconstructor.reconstruct({silhouettes, {}, regions}, view, tiles, true)) {
    ASSERT_EQ(tile.bgr.size(), 3 * tile.depth_m.size());
    for (std::size_t i = 0; i < tile.depth_m.size(); ++i) {
      EXPECT_EQ((Bgr{tile.bgr[3 * i], tile.bgr[3 * i + 1], tile.bgr[3 * i + 2]}),
                tile.depth_m[i] == hull::kNoHull ? Bgr{} : kBlue);
      coloured += tile.depth_m[i] != hull::kNoHull;
    }
  }
  EXPECT_GT(coloured, 50);
}

}  // namespace
}  // namespace fivepipe::recon
