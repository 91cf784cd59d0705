#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "common/pipeline/messages/camera_messages.h"
#include "common/pipeline/messages/object_pixels_codec.h"
#include "common/pipeline/messages/view_messages.h"
#include "tests/support/allocated_bytes.h"

namespace fivepipe::messages {
namespace {

hull::ObjectPixels random_pixels(int width_px, int height_px, double density, unsigned seed) {
  std::mt19937 random(seed);
  std::bernoulli_distribution starts(density), stays(0.9);
  hull::ObjectPixels pixels(width_px, height_px);
  for (int v = 0; v < height_px; ++v) {
    bool object = false;
    for (int u = 0; u < width_px; ++u) {
      object = object ? stays(random) : starts(random);
      if (object) pixels.set(u, v);
    }
  }
  return pixels;
}

config::Rig one_camera_rig(int width_px, int height_px) {
  config::Rig rig;
  rig.name = "test";
  config::RigCamera camera;
  camera.name = "wall1";
  camera.published =
      camera.source = {width_px, height_px, 500, 500, 0.5 * width_px, 0.5 * height_px};
  rig.cameras.push_back(camera);
  return rig;
}

TEST(ObjectPixelsCodec, BothEncodingsRoundTripAtEveryWidth) {
  for (const int width : {1, 7, 8, 9, 63, 64, 65, 127, 128, 130, 720})
    for (const double density : {0.0, 0.01, 0.3, 1.0}) {
      const hull::ObjectPixels pixels = random_pixels(width, 13, density, unsigned(width));
      const hull::PixelRect region = pixels.bounds();
      EXPECT_EQ(from_packed_bits(width, 13, region, packed_bits(pixels, region)), pixels)
          << width << ' ' << density;
      EXPECT_EQ(from_run_lengths(width, 13, region, run_lengths(pixels, region)), pixels)
          << width << ' ' << density;
    }
}

// Tests every width up to 200 pixels, more than three words, with maps from empty to full.
TEST(ObjectPixelsCodec, ChoosesRunLengthsOnlyIfTheyAreShorter) {
  int chose_runs = 0, chose_bits = 0;
  for (int width = 1; width <= 200; ++width)
    for (const double density : {0.0, 0.003, 0.03, 0.2, 0.5, 1.0}) {
      const hull::ObjectPixels pixels = random_pixels(width, 9, density, unsigned(width));
      for (const hull::PixelRect& region : {pixels.bounds(), hull::PixelRect{0, 0, width, 9}}) {
        const auto bits = packed_bits(pixels, region), runs = run_lengths(pixels, region);
        const EncodedPixels code = encoded(pixels, region);
        const bool is_runs = runs.size() < bits.size();
        ASSERT_EQ(code.encoding, is_runs ? fivepipe_v1_run_lengths : fivepipe_v1_packed_bits);
        ASSERT_EQ(code.payload, is_runs ? runs : bits);
        (is_runs ? chose_runs : chose_bits)++;
      }
    }
  EXPECT_GT(chose_runs, 100);
  EXPECT_GT(chose_bits, 100);
}

TEST(ObjectPixelsCodec, AllocatesOnlyTheChosenEncoding) {
  hull::ObjectPixels solid(720, 486), noise(720, 486);
  std::mt19937 random(1);
  for (int v = 0; v < 486; ++v) {
    solid.set_run(100, 600, v);
    for (int u = 0; u < 720; ++u)
      if (random() & 1) noise.set(u, v);
  }
  for (const hull::ObjectPixels* pixels : {&solid, &noise}) {
    const hull::PixelRect region = pixels->bounds();
    const std::size_t before = test::allocated_bytes();
    const EncodedPixels code = encoded(*pixels, region);
    EXPECT_EQ(test::allocated_bytes() - before, code.payload.size());
    EXPECT_EQ(code.encoding, pixels == &solid ? fivepipe_v1_run_lengths : fivepipe_v1_packed_bits);
  }
}

// Tests runs that begin and end at, before and behind the borders of words.
TEST(ObjectPixels, RunsMatchSetPixels) {
  for (const int width : {1, 63, 64, 65, 127, 128, 129, 200})
    for (const int begin : {0, 1, 62, 63, 64, 65, 127, 128, 199})
      for (const int end : {1, 2, 63, 64, 65, 127, 128, 129, 200}) {
        if (begin >= end || end > width) continue;
        hull::ObjectPixels pixels(width, 3);
        pixels.set_run(begin, end, 1);
        ASSERT_EQ(pixels.count(), std::size_t(end - begin));
        EXPECT_EQ(pixels.find(0, width, 1, true), begin);
        EXPECT_EQ(pixels.find(begin, width, 1, false), end);
        EXPECT_EQ(pixels.find(end, width, 1, true), width);
        EXPECT_EQ(pixels.find(0, width, 0, true), width);
        std::vector<std::array<int, 3>> runs;
        pixels.for_each_run({0, 0, width, 3}, [&](int v, int first, int last) {
          runs.push_back({v, first, last});
        });
        EXPECT_EQ(runs, (std::vector<std::array<int, 3>>{{1, begin, end}}));
      }
}

TEST(ObjectPixels, IntersectsPixels) {
  const hull::ObjectPixels a = random_pixels(130, 20, 0.5, 1), b = random_pixels(130, 20, 0.5, 2);
  hull::ObjectPixels both = a;
  both.keep(b);
  for (int v = 0; v < 20; ++v)
    for (int u = 0; u < 130; ++u)
      ASSERT_EQ(both.contains(u, v), a.contains(u, v) && b.contains(u, v));
}

// The pixels next to the region are object pixels, too.
TEST(ObjectPixelsCodec, EncodesThePixelsOfTheRegionAlone) {
  for (int width = 1; width <= 20; ++width)
    for (const int u0 : {0, 3, 55, 60, 63, 64}) {
      const hull::PixelRect region{u0, 1, u0 + width, 4};
      hull::ObjectPixels all(130, 6), expected(130, 6);
      for (int v = 0; v < 6; ++v) all.set_run(0, 130, v);
      for (int v = 1; v < 4; ++v) expected.set_run(u0, u0 + width, v);
      const auto bits = packed_bits(all, region);
      EXPECT_EQ(bits.size(), std::size_t(3 * ((width + 7) / 8)));
      EXPECT_EQ(from_packed_bits(130, 6, region, bits), expected) << u0 << ' ' << width;
      EXPECT_EQ(from_run_lengths(130, 6, region, run_lengths(all, region)), expected);
    }
}

TEST(ObjectPixelsCodec, RunsMayHaveThousandsOfPixels) {
  hull::ObjectPixels pixels(5000, 1);
  pixels.set_run(700, 1001, 0);
  pixels.set_run(2003, 4099, 0);
  const hull::PixelRect region{3, 0, 4999, 1};
  EXPECT_EQ(from_run_lengths(5000, 1, region, run_lengths(pixels, region)), pixels);
}

// Each map has one encoding.
TEST(ObjectPixelsCodec, RunsThatAreEmptyOrAdjacentAreRefused) {
  const auto decode = [](const std::vector<int>& values) {
    std::vector<std::uint8_t> payload;
    for (const int value : values) {
      payload.push_back(std::uint8_t(value & 0xff));
      payload.push_back(std::uint8_t(value >> 8));
    }
    return from_run_lengths(100, 1, {10, 0, 90, 1}, payload).has_value();
  };
  EXPECT_TRUE(decode({0, 5, 1, 2, 0, 0}));
  EXPECT_TRUE(decode({3, 5, 0, 0}));
  EXPECT_FALSE(decode({0, 5, 0, 2, 0, 0}));
  EXPECT_FALSE(decode({3, 0, 0, 0}));
  EXPECT_FALSE(decode({0, 5, 1, 0, 0, 0}));
}

TEST(ObjectPixelsCodec, EmptyMapIsNoBytes) {
  const hull::ObjectPixels none(720, 486);
  EXPECT_TRUE(packed_bits(none, none.bounds()).empty());
  EXPECT_EQ(from_run_lengths(720, 486, {}, {}), none);
}

TEST(ObjectPixelsCodec, TruncatedOrOverlongPayloadIsRefused) {
  const hull::ObjectPixels pixels = random_pixels(100, 20, 0.05, 3);
  const hull::PixelRect region = pixels.bounds();
  for (const auto& payload : {packed_bits(pixels, region), run_lengths(pixels, region)}) {
    auto shorter = payload, longer = payload;
    shorter.pop_back();
    longer.push_back(0);
    EXPECT_FALSE(from_packed_bits(100, 20, region, shorter));
    EXPECT_FALSE(from_run_lengths(100, 20, region, shorter));
    EXPECT_FALSE(from_packed_bits(100, 20, region, longer));
    EXPECT_FALSE(from_run_lengths(100, 20, region, longer));
  }
}

// The region ends inside a word, at its border, and at the image's border.
TEST(ObjectPixelsCodec, RunsReachTheRegionsLastPixelAndNoFurther) {
  for (const int end_px : {20, 63, 64, 65, 100})
    for (const int skipped : {0, 3}) {
      const hull::PixelRect region{10, 1, end_px, 2};
      const auto decode = [&](int run) {
        std::vector<std::uint8_t> payload;
        for (const int value : {skipped, run, 0, 0}) {
          payload.push_back(std::uint8_t(value & 0xff));
          payload.push_back(std::uint8_t(value >> 8));
        }
        return from_run_lengths(100, 3, region, payload);
      };
      const int longest = end_px - region.u0_px - skipped;
      hull::ObjectPixels expected(100, 3);
      expected.set_run(region.u0_px + skipped, end_px, 1);
      EXPECT_EQ(decode(longest), expected) << end_px << ' ' << skipped;
      for (const int more : {1, 2, 64, 0xffff - longest})
        EXPECT_FALSE(decode(longest + more)) << end_px << ' ' << skipped << ' ' << more;
    }
}

TEST(ObjectPixelsCodec, RandomBytesNeverWriteOutsideTheRegion) {
  std::mt19937 random(7);
  std::uniform_int_distribution<int> byte(0, 255), length(0, 80);
  const hull::PixelRect region{3, 2, 61, 9};
  for (int i = 0; i < 20000; ++i) {
    std::vector<std::uint8_t> payload(std::size_t(length(random)));
    for (auto& b : payload) b = std::uint8_t(i % 2 ? byte(random) : byte(random) % 4);
    for (const auto& pixels :
         {from_packed_bits(64, 12, region, payload), from_run_lengths(64, 12, region, payload)}) {
      if (!pixels || pixels->count() == 0) continue;
      EXPECT_EQ(hull::intersection(pixels->bounds(), region), pixels->bounds());
    }
  }
}

TEST(CameraMessages, MapRoundTrips) {
  const config::Rig rig = one_camera_rig(720, 486);
  const hull::ObjectPixels pixels = random_pixels(720, 486, 0.02, 5);
  OutgoingMap out = map_message("wall1", 42, 123456789, pixels);
  const auto received = object_pixels_from(out.message(), rig);
  ASSERT_TRUE(std::holds_alternative<frames::CameraMap>(received));
  EXPECT_EQ(std::get<frames::CameraMap>(received).pixels, pixels);
  EXPECT_EQ(std::get<frames::CameraMap>(received).frame, 42u);
  EXPECT_EQ(std::get<frames::CameraMap>(received).capture_stamp_ns, 123456789);
}

std::string why_bad(const fivepipe_v1_ObjectPixelMap& message, const config::Rig& rig) {
  const auto received = object_pixels_from(message, rig);
  return std::holds_alternative<BadMessage>(received) ? text_of(std::get<BadMessage>(received))
                                                      : "";
}

TEST(CameraMessages, InvalidMapsHaveReasons) {
  const config::Rig rig = one_camera_rig(720, 486);
  OutgoingMap out = map_message("wall1", 1, 1, random_pixels(720, 486, 0.02, 5));
  auto message = out.message();
  EXPECT_EQ(why_bad(message, rig), "");
  set_text(message.camera, "wall9");
  EXPECT_NE(why_bad(message, rig).find("wall9: unknown camera"), std::string::npos);
  message = out.message();
  message.image_width_px = 640;
  EXPECT_NE(why_bad(message, rig).find("wrong image size"), std::string::npos);
  message = out.message();
  message.image_height_px = 480;
  EXPECT_NE(why_bad(message, rig).find("wrong image size"), std::string::npos);
  for (const hull::PixelRect& outside :
       {hull::PixelRect{5, 5, 721, 9}, hull::PixelRect{5, 5, 9, 487}, hull::PixelRect{-1, 5, 9, 9},
        hull::PixelRect{5, -1, 9, 9}, hull::PixelRect{5, 5, 5, 9}, hull::PixelRect{5, 5, 9, 5},
        hull::PixelRect{9, 5, 5, 9}, hull::PixelRect{5, 9, 9, 5}}) {
    message = out.message();
    message.region = to_wire(outside);
    EXPECT_NE(why_bad(message, rig).find("region outside"), std::string::npos) << outside.u1_px;
  }
  message = out.message();
  message.payload._length -= 1;
  EXPECT_NE(why_bad(message, rig).find("truncated"), std::string::npos);
  message = out.message();
  message.object_pixels += 1;
  EXPECT_NE(why_bad(message, rig).find("count"), std::string::npos);
}

TEST(CameraMessages, CoverageRoundTrips) {
  const config::Rig rig = one_camera_rig(720, 486);
  hull::CoverageOutline outline{random_pixels(720, 486, 0.02, 5), {}};
  for (std::size_t i = 0; i < outline.pixels.count(); ++i)
    outline.coverage.push_back(std::uint8_t(i * 7));
  for (const hull::CoverageOutline& sent :
       {outline, hull::CoverageOutline{hull::ObjectPixels(720, 486), {}}}) {
    OutgoingCoverage out = coverage_message("wall1", 42, 123456789, sent);
    const auto received = coverage_from(out.message(), rig);
    ASSERT_TRUE(std::holds_alternative<CameraCoverage>(received));
    EXPECT_EQ(std::get<CameraCoverage>(received).outline, sent);
    EXPECT_EQ(std::get<CameraCoverage>(received).camera, 0u);
    EXPECT_EQ(std::get<CameraCoverage>(received).frame, 42u);
    EXPECT_EQ(std::get<CameraCoverage>(received).capture_stamp_ns, 123456789);
  }
}

TEST(CameraMessages, InvalidCoverageHasReasons) {
  config::Rig rig = one_camera_rig(720, 486);
  hull::CoverageOutline outline{random_pixels(720, 486, 0.02, 5), {}};
  outline.coverage.assign(outline.pixels.count(), 99);
  OutgoingCoverage out = coverage_message("wall1", 1, 1, outline);
  const auto why = [&](const fivepipe_v1_ObjectCoverage& message) {
    const auto received = coverage_from(message, rig);
    return std::holds_alternative<BadMessage>(received) ? text_of(std::get<BadMessage>(received))
                                                        : "";
  };
  auto message = out.message();
  EXPECT_EQ(why(message), "");
  set_text(message.camera, "wall9");
  EXPECT_EQ(why(message), "bad_coverage: wall9: unknown camera");
  message = out.message();
  message.image_width_px = 640;
  EXPECT_EQ(why(message), "bad_coverage: wall1: wrong image size");
  message = out.message();
  message.region.u1_px = 721;
  EXPECT_EQ(why(message), "bad_coverage: wall1: region outside the image");
  message = out.message();
  message.pixels._length -= 1;
  EXPECT_EQ(why(message), "bad_coverage: wall1: pixels truncated or undecodable");
  message = out.message();
  message.coverage._length -= 1;
  EXPECT_EQ(why(message), "bad_coverage: wall1: not as many coverages as pixels");
  rig.cameras[0].gives_shape = false;
  EXPECT_EQ(why(out.message()), "bad_coverage: wall1: the camera gives no shape");
}

TEST(CameraMessages, FixedCameraColourPoseIsBitExact) {
  config::Rig rig = one_camera_rig(720, 486);
  rig.cameras[0].camera_from_mount = geometry::look_at({1.3, -0.7, 0.9}, {0, 0.1, 0.2});
  hull::ObjectPixels pixels(720, 486);
  pixels.set_run(10, 12, 20);
  const hull::ColourRegion sent{
      config::published_camera(rig.cameras[0]), pixels, {10, 20, 12, 21}, {1, 2, 3, 4, 5, 6}};
  OutgoingColour out = colour_message("wall1", 1, 1, sent);
  const auto received = colour_from(out.message(), rig);
  ASSERT_TRUE(std::holds_alternative<CameraColour>(received));
  const hull::ColourRegion& colour = std::get<CameraColour>(received).colour;
  EXPECT_EQ(colour.camera.camera_from_world.matrix(),
            config::published_camera(rig.cameras[0]).camera_from_world.matrix());
  EXPECT_EQ(colour.bgr, (std::vector<std::uint8_t>{1, 2, 3, 4, 5, 6}));
  out.header.camera_from_world.translation_m.x += 0.01;
  EXPECT_TRUE(std::holds_alternative<BadMessage>(colour_from(out.message(), rig)));
}

TEST(CameraMessages, ScatteredPixelColoursRoundTrip) {
  const config::Rig rig = one_camera_rig(720, 486);
  for (const double share : {0.001, 0.5, 1.0}) {
    const hull::ObjectPixels pixels = random_pixels(720, 486, share, 11);
    hull::ColourRegion sent{config::published_camera(rig.cameras[0]), pixels, {0, 0, 720, 486}, {}};
    for (unsigned i = 0; i < 3 * 720 * 486; ++i) sent.bgr.push_back(std::uint8_t(i * 7919u >> 5));
    OutgoingColour out = colour_message("wall1", 1, 1, sent);
    EXPECT_EQ(out.bgr.size(), 3 * pixels.count());
    const auto received = colour_from(out.message(), rig);
    ASSERT_TRUE(std::holds_alternative<CameraColour>(received));
    const hull::ColourRegion& colour = std::get<CameraColour>(received).colour;
    EXPECT_EQ(colour.pixels, pixels);
    EXPECT_EQ(colour.region, pixels.bounds());
    const hull::PixelRect& r = colour.region;
    for (int v = r.v0_px; v < r.v1_px; ++v)
      for (int u = r.u0_px; u < r.u1_px; ++u)
        for (int c = 0; c < 3 && pixels.contains(u, v); ++c)
          ASSERT_EQ(colour.bgr[std::size_t(3 * ((v - r.v0_px) * r.width_px() + u - r.u0_px) + c)],
                    sent.bgr[std::size_t(3 * (v * 720 + u) + c)]);
  }
}

// A peer may send a region without a set pixel.
TEST(CameraMessages, ColoursWithoutPixelsRoundTrip) {
  const config::Rig rig = one_camera_rig(720, 486);
  const hull::ColourRegion sent{config::published_camera(rig.cameras[0]),
                                hull::ObjectPixels(720, 486),
                                {5, 5, 9, 9},
                                std::vector<std::uint8_t>(3 * 4 * 4)};
  OutgoingColour out = colour_message("wall1", 1, 1, sent);
  EXPECT_TRUE(out.bgr.empty());
  const auto received = colour_from(out.message(), rig);
  ASSERT_TRUE(std::holds_alternative<CameraColour>(received));
  EXPECT_EQ(std::get<CameraColour>(received).colour.pixels.count(), 0u);
}

TEST(CameraMessages, InvalidColoursHaveReasons) {
  const config::Rig rig = one_camera_rig(720, 486);
  hull::ColourRegion sent{config::published_camera(rig.cameras[0]),
                          random_pixels(720, 486, 0.02, 5),
                          {0, 0, 720, 486},
                          std::vector<std::uint8_t>(3 * 720 * 486, 9)};
  OutgoingColour out = colour_message("wall1", 1, 1, sent);
  const auto why = [&](const fivepipe_v1_ObjectColour& message) {
    const auto received = colour_from(message, rig);
    return std::holds_alternative<BadMessage>(received) ? text_of(std::get<BadMessage>(received))
                                                        : "";
  };
  auto message = out.message();
  EXPECT_EQ(why(message), "");
  message.bgr._length -= 3;
  EXPECT_NE(why(message).find("not as many colours"), std::string::npos);
  message = out.message();
  message.pixels._length -= 1;
  EXPECT_NE(why(message).find("truncated"), std::string::npos);
  message = out.message();
  message.region.v0_px = -1;
  EXPECT_NE(why(message).find("region outside"), std::string::npos);
}

TEST(CameraMessages, ReportsCalibrationMismatch) {
  const config::Rig rig = one_camera_rig(720, 486);
  auto info = camera_info_message(rig.cameras[0]);
  EXPECT_EQ(model_mismatch(info, rig), "");
  for (double fivepipe_v1_Pinhole::*field :
       {&fivepipe_v1_Pinhole::fx_px, &fivepipe_v1_Pinhole::fy_px, &fivepipe_v1_Pinhole::cx_px,
        &fivepipe_v1_Pinhole::cy_px}) {
    auto broken = info;
    broken.pinhole.*field = std::numeric_limits<double>::quiet_NaN();
    EXPECT_NE(model_mismatch(broken, rig), "");
  }
  info.pinhole.fx_px += 0.5;
  EXPECT_NE(model_mismatch(info, rig).find("intrinsics"), std::string::npos);
  info = camera_info_message(rig.cameras[0]);
  info.camera_from_mount.translation_m.x += 0.01;
  EXPECT_NE(model_mismatch(info, rig).find("pose"), std::string::npos);
}

TEST(CameraMessages, AnotherModelIsAMismatchBeyondAMillionth) {
  config::Rig rig = one_camera_rig(720, 486);
  rig.cameras[0].mount = config::Mount::viewer;
  const auto info = camera_info_message(rig.cameras[0]);
  EXPECT_STREQ(info.camera, "wall1");
  EXPECT_TRUE(info.carried_by_viewer);
  EXPECT_EQ(model_mismatch(info, rig), "");
  const auto with = [&](auto change) {
    auto changed = info;
    change(changed);
    return model_mismatch(changed, rig);
  };
  using Info = fivepipe_v1_CameraInfo;
  const std::string intrinsics = "published intrinsics differ from this node's rig",
                    pose = "published pose differs from this node's rig";
  EXPECT_EQ(with([](Info& i) { i.pinhole.width_px = 640; }), intrinsics);
  EXPECT_EQ(with([](Info& i) { i.pinhole.height_px = 480; }), intrinsics);
  EXPECT_EQ(with([](Info& i) { i.pinhole.fx_px += 0.9e-6; }), "");
  EXPECT_EQ(with([](Info& i) { i.pinhole.fx_px -= 1.1e-6; }), intrinsics);
  EXPECT_EQ(with([](Info& i) { i.camera_from_mount.translation_m.y -= 0.9e-6; }), "");
  EXPECT_EQ(with([](Info& i) { i.camera_from_mount.translation_m.y += 1.1e-6; }), pose);
  EXPECT_EQ(with([](Info& i) { i.carried_by_viewer = false; }), pose);
  EXPECT_EQ(with([](Info& i) { i.camera_from_mount.rotation.w = 2; }), pose);
  EXPECT_EQ(with([](Info& i) { set_text(i.camera, "wall2"); }),
            "published, but not in the rig 'test'");
}

TEST(ViewMessages, ViewInfoDescribesTheViewer) {
  config::Viewer viewer;
  viewer.name = "eye";
  const fivepipe_v1_ViewInfo message = view_info_message(viewer);
  EXPECT_STREQ(message.viewer, "eye");
  EXPECT_EQ(from_wire(message.render), config::render_pinhole(viewer));
  EXPECT_EQ(from_wire(message.recon), config::recon_pinhole(viewer));
  const auto received = view_geometry_from(message, viewer);
  ASSERT_TRUE(std::holds_alternative<ViewGeometry>(received));
  EXPECT_EQ(std::get<ViewGeometry>(received).near_m, viewer.near_m);
  EXPECT_EQ(std::get<ViewGeometry>(received).far_m, viewer.far_m);
  EXPECT_EQ(std::get<ViewGeometry>(received).recon, config::recon_pinhole(viewer));
  EXPECT_STREQ(head_pose_message(viewer, {9, 1, Eigen::Isometry3d::Identity(), {}}).header.viewer,
               "eye");
}

TEST(ViewMessages, DepthsOutOfOrderAreRefused) {
  const config::Viewer viewer;
  const double infinity = std::numeric_limits<double>::infinity(),
               nan = std::numeric_limits<double>::quiet_NaN();
  const auto accepts = [&](double near_m, double far_m) {
    fivepipe_v1_ViewInfo message = view_info_message(viewer);
    message.near_m = near_m;
    message.far_m = far_m;
    return std::holds_alternative<ViewGeometry>(view_geometry_from(message, viewer));
  };
  EXPECT_TRUE(accepts(0.1, 0.2));
  for (const auto& [near_m, far_m] : {std::pair{0.0, 1.0},
                                      {-1.0, 1.0},
                                      {1.0, 1.0},
                                      {2.0, 1.0},
                                      {0.1, infinity},
                                      {nan, 1.0},
                                      {0.1, nan}})
    EXPECT_FALSE(accepts(near_m, far_m)) << near_m << ' ' << far_m;
}

TEST(WireConversions, PosesThatAreNotFiniteOrNoRotationAreRefused) {
  const auto accepts = [](auto change) {
    fivepipe_v1_Pose pose = to_wire(Eigen::Isometry3d::Identity());
    change(pose);
    return from_wire(pose).has_value();
  };
  using Pose = fivepipe_v1_Pose;
  EXPECT_TRUE(accepts([](Pose& pose) { pose.translation_m.z = 1e6; }));
  EXPECT_FALSE(accepts([](Pose& pose) { pose.translation_m.z = INFINITY; }));
  EXPECT_FALSE(accepts([](Pose& pose) { pose.translation_m.x = NAN; }));
  EXPECT_TRUE(accepts([](Pose& pose) { pose.rotation.w = 1 - 0.9e-6; }));
  EXPECT_FALSE(accepts([](Pose& pose) { pose.rotation.w = 1 - 1.1e-6; }));
  EXPECT_FALSE(accepts([](Pose& pose) { pose.rotation.w = 1 + 1.1e-6; }));
}

TEST(ViewMessages, PosesRoundTripAndRejectNan) {
  config::Viewer viewer;
  const Eigen::Isometry3d pose = geometry::look_at({0, -0.75, 0.55}, {0, 0.05, 0.2});
  auto out = head_pose_message(viewer, {9, 1, pose, {1, 0, 1}});
  fivepipe_v1_HeadPose message = out.message();
  const auto received = head_pose_from(message);
  ASSERT_TRUE(std::holds_alternative<FramePose>(received));
  EXPECT_LT(
      (std::get<FramePose>(received).eye_from_world.matrix() - pose.matrix()).cwiseAbs().maxCoeff(),
      1e-14);
  message.eye_from_world.rotation.w = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(std::holds_alternative<BadMessage>(head_pose_from(message)));
  EXPECT_EQ(std::get<FramePose>(received).tile_owners, (std::vector<std::uint8_t>{1, 0, 1}));
  message = out.message();
  message.eye_from_world.rotation.w *= 1.1;
  EXPECT_TRUE(std::holds_alternative<BadMessage>(head_pose_from(message)));
}

// A received stamp is subtracted from others: the difference must not overflow.
TEST(WireConversions, ImplausibleFramesAndStampsAreRefused) {
  for (const std::int64_t stamp_ns : {std::int64_t(0), std::int64_t(1), kMaxStamp_ns})
    for (const std::uint64_t frame : {std::uint64_t(0), kMaxFrame})
      EXPECT_FALSE(why_implausible(frame, stamp_ns)) << frame << ' ' << stamp_ns;
  for (const std::int64_t stamp_ns :
       {INT64_MIN, INT64_MIN + 1, std::int64_t(-1), kMaxStamp_ns + 1, INT64_MAX})
    EXPECT_TRUE(why_implausible(1, stamp_ns)) << stamp_ns;
  EXPECT_TRUE(why_implausible(kMaxFrame + 1, 1));
  EXPECT_TRUE(why_implausible(UINT64_MAX, 1));
}

TEST(WireConversions, MessagesWithImplausibleFramesOrStampsAreRefused) {
  const config::Rig rig = one_camera_rig(40, 30);
  const hull::ObjectPixels pixels = random_pixels(40, 30, 0.1, 1);
  const hull::ColourRegion colour{config::published_camera(rig.cameras[0]), pixels, pixels.bounds(),
                                  std::vector<std::uint8_t>(3 * pixels.bounds().area_px())};
  const auto accepts = [&](std::uint64_t frame, std::int64_t stamp_ns) {
    const bool map = std::holds_alternative<frames::CameraMap>(object_pixels_from(
                   map_message("wall1", frame, stamp_ns, pixels).message(), rig)),
               coloured = std::holds_alternative<CameraColour>(
                   colour_from(colour_message("wall1", frame, stamp_ns, colour).message(), rig)),
               pose = std::holds_alternative<FramePose>(head_pose_from(
                   head_pose_message({}, {frame, stamp_ns, Eigen::Isometry3d::Identity(), {}})
                       .message()));
    EXPECT_EQ(map, coloured);
    EXPECT_EQ(map, pose);
    return map;
  };
  EXPECT_TRUE(accepts(7, 1'700'000'000'000'000'000));
  EXPECT_TRUE(accepts(kMaxFrame, kMaxStamp_ns));
  for (const std::int64_t stamp_ns : {INT64_MIN, std::int64_t(-1), INT64_MAX})
    EXPECT_FALSE(accepts(7, stamp_ns)) << stamp_ns;
  EXPECT_FALSE(accepts(UINT64_MAX, 1));
}

TEST(ViewMessages, ImageSizesOfAnotherDeploymentAreRefused) {
  const config::Viewer viewer;
  EXPECT_TRUE(
      std::holds_alternative<ViewGeometry>(view_geometry_from(view_info_message(viewer), viewer)));
  for (std::int32_t fivepipe_v1_Pinhole::*side :
       {&fivepipe_v1_Pinhole::width_px, &fivepipe_v1_Pinhole::height_px})
    for (const std::int32_t size_px : {INT32_MIN, -1, 0, 1, 1'000'000, INT32_MAX}) {
      fivepipe_v1_ViewInfo message = view_info_message(viewer);
      message.recon.*side = size_px;
      EXPECT_TRUE(std::holds_alternative<BadMessage>(view_geometry_from(message, viewer)))
          << size_px;
    }
}

}  // namespace
}  // namespace fivepipe::messages
