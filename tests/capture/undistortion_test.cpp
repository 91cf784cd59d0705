#include "capture_node/lens/undistortion.h"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <random>

#include "tests/support/capture/capture_rig.h"

namespace fivepipe::capture {
namespace {

config::RigCamera lens_camera() {
  config::RigCamera camera = test::table_camera("lens", {0, -1.5, 1.2}, 645, 486);
  camera.distortion = {-0.36, 0.18, 0.0008, -0.0005, -0.05};
  camera.published.fx_px *= 1.1;
  camera.published.cx_px += 4;
  return camera;
}

// Returns the positions of points in the captured image, computed by OpenCV.
std::vector<Eigen::Vector2d> captured_uv(const config::RigCamera& camera,
                                         const std::vector<cv::Point3d>& points_camera_m) {
  const cv::Matx33d k(camera.source.fx_px, 0, camera.source.cx_px, 0, camera.source.fy_px,
                      camera.source.cy_px, 0, 0, 1);
  const std::vector<double> lens{camera.distortion.k1, camera.distortion.k2, camera.distortion.p1,
                                 camera.distortion.p2, camera.distortion.k3};
  std::vector<cv::Point2d> uv;
  cv::projectPoints(points_camera_m, cv::Vec3d(0, 0, 0), cv::Vec3d(0, 0, 0), k, lens, uv);
  std::vector<Eigen::Vector2d> result;
  for (const cv::Point2d& one : uv) result.emplace_back(one.x, one.y);
  return result;
}
Eigen::Vector2d captured_uv(const config::RigCamera& camera, const Eigen::Vector3d& p_world_m) {
  const Eigen::Vector3d p = camera.camera_from_mount * p_world_m;
  return captured_uv(camera, std::vector<cv::Point3d>{{p.x(), p.y(), p.z()}})[0];
}

TEST(Undistortion, MapsPointsToPinholeProjection) {
  const config::RigCamera camera = lens_camera();
  const Undistortion undistortion(camera);
  int seen = 0;
  for (double x = -0.9; x <= 0.9; x += 0.15)
    for (double y = -0.5; y <= 0.5; y += 0.25) {
      const Eigen::Vector3d p(x, y, 0.2);
      const Eigen::Vector2d from = captured_uv(camera, p),
                            to = geometry::project(config::published_camera(camera), p).value();
      if (!(from.x() > 3 && from.y() > 3 && from.x() < 641 && from.y() < 482 && to.x() > 3 &&
            to.y() > 3 && to.x() < 641 && to.y() < 482))
        continue;
      // Draws a Gaussian spot around the point in the captured image and compares its centroid in
      // the published one.
      cv::Mat image(486, 645, CV_8UC3, cv::Scalar(0, 0, 0));
      for (int v = std::max(0, int(from.y()) - 12); v < std::min(486, int(from.y()) + 13); ++v)
        for (int u = std::max(0, int(from.x()) - 12); u < std::min(645, int(from.x()) + 13); ++u)
          image.at<cv::Vec3b>(v, u)[1] = std::uint8_t(
              250 * std::exp(-0.5 * (Eigen::Vector2d(u, v) - from).squaredNorm() / 4.0) + 0.5);
      const cv::Mat flat = undistortion.published(image, {0, 0, 645, 486});
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      for (int v = 0; v < flat.rows; ++v)
        for (int u = 0; u < flat.cols; ++u)
          sum += double(flat.at<cv::Vec3b>(v, u)[1]) * Eigen::Vector3d(u, v, 1);
      const bool whole = from.x() > 12 && from.y() > 12 && from.x() < 632 && from.y() < 473 &&
                         to.x() > 16 && to.y() > 16 && to.x() < 628 && to.y() < 469;
      if (!whole) continue;
      ++seen;
      // The bound contains 1/32 px of the fixed-point map, and the distortion across the spot.
      EXPECT_LT((sum.head<2>() / sum.z() - to).norm(), 0.1)
          << from.transpose() << " -> " << to.transpose();
    }
  EXPECT_GT(seen, 20);
}

// Returns the positions of the published pixels, row by row.
std::vector<Eigen::Vector2d> captured_uv_of_published(const config::RigCamera& camera) {
  std::vector<cv::Point3d> rays;
  const geometry::Pinhole& k = camera.published;
  for (int v = 0; v < k.height_px; ++v)
    for (int u = 0; u < k.width_px; ++u)
      rays.emplace_back((u - k.cx_px) / k.fx_px, (v - k.cy_px) / k.fy_px, 1);
  return captured_uv(camera, rays);
}

// Each bit is that of the captured pixel that contains the published pixel's center, according to
// OpenCV's lens model.
TEST(Undistortion, TakesEachBitFromTheNearestCapturedPixel) {
  const config::RigCamera camera = lens_camera();
  const Undistortion undistortion(camera);
  hull::ObjectPixels captured(645, 486);
  std::mt19937 random(1);
  for (int v = 0; v < 486; ++v)
    for (int u = 0; u < 645; ++u) captured.set(u, v, random() % 2);
  const hull::ObjectPixels published = undistortion.published(captured);
  const std::vector<Eigen::Vector2d> from = captured_uv_of_published(camera);
  // OpenCV returns the position as double and this code computes it in double; a position this
  // close to the border of two pixels may round to either.
  constexpr double kRounding_px = 1e-6;
  int compared = 0;
  for (int v = 0; v < 486; ++v)
    for (int u = 0; u < 645; ++u) {
      const Eigen::Vector2d uv = from[std::size_t(v * 645 + u)];
      const Eigen::Vector2d nearest(std::round(uv.x()), std::round(uv.y()));
      if ((uv - nearest).cwiseAbs().maxCoeff() > 0.5 - kRounding_px) continue;
      const bool is_seen =
          nearest.x() >= 0 && nearest.y() >= 0 && nearest.x() < 645 && nearest.y() < 486;
      ASSERT_EQ(undistortion.sees(u, v), is_seen) << u << ' ' << v;
      ASSERT_EQ(published.contains(u, v),
                is_seen && captured.contains(int(nearest.x()), int(nearest.y())))
          << u << ' ' << v << " from " << uv.transpose();
      compared += is_seen;
    }
  EXPECT_GT(compared, 600 * 450);
}

// Coverage is interpolated bilinearly at the position according to OpenCV's lens model.
TEST(Undistortion, InterpolatesCoverage) {
  const config::RigCamera camera = lens_camera();
  const Undistortion undistortion(camera);
  hull::CoverageMap captured(645, 486);
  const auto coverage = [](double u, double v) { return 0.2 * u + 0.1 * v + 30; };
  for (int v = 0; v < 486; ++v)
    for (int u = 0; u < 645; ++u) captured.set(u, v, std::uint8_t(std::lround(coverage(u, v))));
  const hull::CoverageMap published = undistortion.published(captured);
  ASSERT_EQ(published.width_px(), 645);
  ASSERT_EQ(published.height_px(), 486);
  const std::vector<Eigen::Vector2d> from = captured_uv_of_published(camera);
  int compared = 0;
  for (int v = 0; v < 486; ++v)
    for (int u = 0; u < 645; ++u) {
      const Eigen::Vector2d uv = from[std::size_t(v * 645 + u)];
      if (!undistortion.sees(u, v)) {
        ASSERT_EQ(published.at(u, v), 0);
      } else if (uv.x() >= 0 && uv.y() >= 0 && uv.x() <= 644 && uv.y() <= 485) {
        // Twice rounded to whole levels.
        ASSERT_NEAR(published.at(u, v), coverage(uv.x(), uv.y()), 1.05) << u << ' ' << v;
        ++compared;
      }
    }
  EXPECT_GT(compared, 600 * 450);
  const config::RigCamera plain = test::table_camera("plain", {0, -1, 1}, 645, 486);
  EXPECT_EQ(Undistortion(plain).published(captured), captured);
}

// All numbers below are exact in binary. The published image has half the pixel size and a border
// of 3 to 5 pixels that the captured image does not see.
TEST(Undistortion, MapsTheFirstAndTheLastCapturedPixel) {
  config::RigCamera camera = test::table_camera("exact", {0, -1.5, 1.2});
  camera.source = {67, 5, 8, 8, 33, 2};
  camera.published = {141, 18, 16, 16, 70, 10};
  const Undistortion undistortion(camera);
  hull::ObjectPixels captured(67, 5);
  cv::Mat image(5, 67, CV_8UC3);
  std::mt19937 random(1);
  for (int v = 0; v < 5; ++v)
    for (int u = 0; u < 67; ++u) {
      captured.set(u, v, random() % 2);
      image.at<cv::Vec3b>(v, u) = cv::Vec3b(std::uint8_t(1 + u), std::uint8_t(1 + v), 255);
    }
  const hull::ObjectPixels published = undistortion.published(captured);
  const cv::Mat colours = undistortion.published(image, {0, 0, 141, 18});
  ASSERT_EQ(colours.size(), cv::Size(141, 18));
  for (int v = 0; v < 18; ++v)
    for (int u = 0; u < 141; ++u) {
      const bool is_seen = u >= 3 && u < 137 && v >= 5 && v < 15;
      const int from_u = (u - 3) / 2, from_v = (v - 5) / 2;
      ASSERT_EQ(undistortion.sees(u, v), is_seen) << u << ' ' << v;
      ASSERT_EQ(published.contains(u, v), is_seen && captured.contains(from_u, from_v))
          << u << ' ' << v;
      const cv::Vec3b colour = colours.at<cv::Vec3b>(v, u);
      if (!is_seen) {
        ASSERT_EQ(colour, cv::Vec3b(0, 0, 0)) << u << ' ' << v;
      } else if (u % 2 == 0 && v % 2 == 0) {  // the centre of a captured pixel
        ASSERT_EQ(colour, image.at<cv::Vec3b>(from_v, from_u)) << u << ' ' << v;
      }
    }
}

// Words of the published map are skipped whose source pixels are all outside the object's bounds.
TEST(Undistortion, SmallObjectsAreMappedLikeTheWholeImage) {
  config::RigCamera camera = test::table_camera("lens", {0, -1.5, 1.2}, 197, 131);
  camera.distortion = {-0.36, 0.18, 0.0008, -0.0005, -0.05};
  camera.published.fx_px *= 1.1;
  const Undistortion undistortion(camera);
  // Column and row of each published pixel's source, bit by bit.
  std::vector<int> column(197 * 131), row(197 * 131);
  for (int bit = 0; bit < 8; ++bit) {
    hull::ObjectPixels columns(197, 131), rows(197, 131);
    for (int v = 0; v < 131; ++v)
      for (int u = 0; u < 197; ++u) {
        columns.set(u, v, u >> bit & 1);
        rows.set(u, v, v >> bit & 1);
      }
    const hull::ObjectPixels of_columns = undistortion.published(columns),
                             of_rows = undistortion.published(rows);
    for (int v = 0; v < 131; ++v)
      for (int u = 0; u < 197; ++u) {
        column[std::size_t(v * 197 + u)] |= int(of_columns.contains(u, v)) << bit;
        row[std::size_t(v * 197 + u)] |= int(of_rows.contains(u, v)) << bit;
      }
  }
  std::mt19937 random(3);
  std::size_t found = 0;
  for (int i = 0; i < 400; ++i) {
    const int u0 = int(random() % 197), v0 = int(random() % 131),
              u1 = std::min(197, u0 + 1 + int(random() % 3)),
              v1 = std::min(131, v0 + 1 + int(random() % 3));
    hull::ObjectPixels captured(197, 131), expected(197, 131);
    for (int v = v0; v < v1; ++v) captured.set_run(u0, u1, v);
    for (int v = 0; v < 131; ++v)
      for (int u = 0; u < 197; ++u) {
        const int from_u = column[std::size_t(v * 197 + u)], from_v = row[std::size_t(v * 197 + u)];
        expected.set(
            u, v,
            undistortion.sees(u, v) && from_u >= u0 && from_u < u1 && from_v >= v0 && from_v < v1);
      }
    ASSERT_EQ(undistortion.published(captured), expected) << u0 << ' ' << v0;
    found += expected.count();
  }
  EXPECT_GT(found, 1000u);
}

// undistorted() is the inverse of OpenCV's lens model.
TEST(Undistortion, PointsReturnToTheirPixel) {
  config::RigCamera camera = lens_camera();
  for (const geometry::LensDistortion& lens :
       {camera.distortion, geometry::LensDistortion{0.2, -0.1, 0.01, 0.02, 0.03},
        geometry::LensDistortion{}}) {
    camera.distortion = lens;
    for (int v = 0; v < 486; v += 15)
      for (int u = 0; u < 645; u += 15) {
        const Eigen::Vector2d xy = geometry::undistorted(camera.source, camera.distortion, {u, v});
        const Eigen::Vector2d back =
            captured_uv(camera, std::vector<cv::Point3d>{{xy.x(), xy.y(), 1}})[0];
        ASSERT_LT((back - Eigen::Vector2d(u, v)).norm(), 2e-6) << u << ' ' << v;
      }
  }
}

// At radius 1 each iteration leaves 2 k1 / (1 + k1) = 2/3 of the error.
TEST(Undistortion, PointsReturnToTheirPixelIfTheIterationConvergesSlowly) {
  config::RigCamera camera = lens_camera();
  camera.source = {2000, 2000, 1000, 1000, 999.5, 999.5};
  camera.distortion = {-0.25, 0, 0, 0, 0};
  for (const Eigen::Vector2d& xy : {Eigen::Vector2d(1, 0), {0, -1}, {-0.6, 0.8}})
    EXPECT_LT((geometry::undistorted(camera.source, camera.distortion,
                                     Eigen::Vector2d(999.5, 999.5) + 750 * xy) -
               xy)
                  .norm(),
              1e-8);
}

TEST(Undistortion, ColoursOutsideTheCapturedImageAreBlack) {
  config::RigCamera camera = test::table_camera("narrow", {0, -1, 1}, 100, 80);
  camera.published = geometry::pinhole_from_fov(200, 160, 1.6);
  camera.distortion = {-0.05, 0, 0, 0, 0};
  const Undistortion undistortion(camera);
  const cv::Mat white(80, 100, CV_8UC3, cv::Scalar::all(255));
  const hull::PixelRect region{11, 7, 190, 153};
  const cv::Mat found = undistortion.published(white, region);
  ASSERT_EQ(found.size(), cv::Size(179, 146));
  // At the border of the captured image, bilinear interpolation mixes white and black.
  const auto sees_all = [&](int u, int v) {
    for (const int du : {-1, 0, 1})
      for (const int dv : {-1, 0, 1})
        if (!undistortion.sees(u + du, v + dv)) return false;
    return true;
  };
  int seen = 0;
  for (int v = 0; v < found.rows; ++v)
    for (int u = 0; u < found.cols; ++u) {
      const cv::Vec3b level = found.at<cv::Vec3b>(v, u);
      if (!undistortion.sees(u + 11, v + 7)) {
        ASSERT_EQ(level, cv::Vec3b(0, 0, 0)) << u << ' ' << v;
      } else if (sees_all(u + 11, v + 7)) {
        ASSERT_EQ(level, cv::Vec3b(255, 255, 255)) << u << ' ' << v;
        ++seen;
      }
    }
  EXPECT_GT(seen, 3000);
  EXPECT_TRUE(undistortion.published(white, {5, 5, 5, 9}).empty());
  const config::RigCamera plain = test::table_camera("plain", {0, -1, 1}, 100, 80);
  EXPECT_EQ(Undistortion(plain).published(white, {5, 5, 15, 9}).size(), cv::Size(10, 4));
  EXPECT_TRUE(Undistortion(plain).published(white, {5, 5, 5, 9}).empty());
}

TEST(Undistortion, KeepsStraightEdgesStraight) {
  // The object is the half-plane x < 0.3 m of the table, seen through the lens.
  const config::RigCamera camera = lens_camera();
  hull::ObjectPixels captured(645, 486);
  const Eigen::Isometry3d world_from_camera = camera.camera_from_mount.inverse();
  for (int v = 0; v < 486; ++v)
    for (int u = 0; u < 645; ++u) {
      const Eigen::Vector2d xy = geometry::undistorted(camera.source, camera.distortion, {u, v});
      const Eigen::Vector3d d = world_from_camera.linear() * Eigen::Vector3d(xy.x(), xy.y(), 1),
                            eye = world_from_camera.translation();
      if (d.z() < 0 && (eye - eye.z() / d.z() * d).x() < 0.3) captured.set(u, v);
    }
  const hull::ObjectPixels flat = Undistortion(camera).published(captured);
  int rows = 0;
  for (double y = -0.4; y < 0.6; y += 0.01) {
    const Eigen::Vector2d uv =
        geometry::project(config::published_camera(camera), {0.3, y, 0}).value();
    if (!(uv.x() > 5 && uv.x() < 640 && uv.y() > 5 && uv.y() < 480)) continue;
    ++rows;
    // Nearest-neighbour sampling moves the edge by half a captured pixel, times the scale between
    // the images (at most 1.5), plus half a published pixel.
    const auto at = [&](double offset_px) { return flat.contains_at(uv.x() + offset_px, uv.y()); };
    EXPECT_TRUE(at(-2)) << uv.transpose();
    EXPECT_FALSE(at(2)) << uv.transpose();
  }
  EXPECT_GT(rows, 50);
}

TEST(Undistortion, IsIdentityWithoutDistortion) {
  const config::RigCamera camera = test::table_camera("plain", {0, -1, 1});
  const Undistortion undistortion(camera);
  EXPECT_TRUE(undistortion.identity());
  hull::ObjectPixels pixels(720, 486);
  pixels.set(3, 4);
  EXPECT_EQ(undistortion.published(pixels), pixels);
}

TEST(Undistortion, PixelsThatTheSourceDoesNotSeeAreUnset) {
  config::RigCamera camera = test::table_camera("narrow", {0, -1, 1}, 100, 80);
  camera.published = geometry::pinhole_from_fov(200, 160, 1.6);  // the source has only 0.75 rad
  const Undistortion undistortion(camera);
  hull::ObjectPixels all(100, 80);
  for (int v = 0; v < 80; ++v) all.set_run(0, 100, v);
  const hull::ObjectPixels seen = undistortion.published(all);
  EXPECT_FALSE(seen.contains(0, 0));
  EXPECT_TRUE(seen.contains(100, 80));
  for (int v = 0; v < 160; ++v)
    for (int u = 0; u < 200; ++u) ASSERT_EQ(seen.contains(u, v), undistortion.sees(u, v));
  // The source sees the fraction tan(0.375) / tan(0.8) of the width, within a pixel on each side.
  EXPECT_NEAR(seen.bounds().width_px(), 200 * std::tan(0.375) / std::tan(0.8), 2);
}

TEST(Undistortion, ExcludesRadiiBeyondTheFold) {
  config::RigCamera camera = test::table_camera("fold", {0, -1, 1}, 200, 160);
  camera.distortion = {-0.4, 0, 0, 0, 0};  // folds at r = sqrt(1 / 1.2) = 0.913
  camera.published = geometry::pinhole_from_fov(200, 160, 2.4);
  EXPECT_NEAR(geometry::monotonic_radius(camera.distortion), std::sqrt(1 / 1.2), 0.006);
  EXPECT_TRUE(std::isinf(geometry::monotonic_radius({})));
  // The derivative of r (1 + k1 r^2 + k2 r^4 + k3 r^6) is negative beyond the radius.
  EXPECT_NEAR(geometry::monotonic_radius({0, -0.2, 0, 0, 0}), 1, 0.006);        // 1 = 5 * 0.2 r^4
  EXPECT_NEAR(geometry::monotonic_radius({0, 0, 0, 0, -1 / 7.0}), 1, 0.006);    // 1 = r^6
  EXPECT_TRUE(std::isinf(geometry::monotonic_radius({0.1, -0.2, 0, 0, 0.1})));  // never negative
  EXPECT_NEAR(geometry::monotonic_radius({-1e-3, 0, 0, 0, 0}), std::sqrt(1 / 3e-3), 0.006);
  EXPECT_TRUE(std::isinf(geometry::monotonic_radius({-8e-4, 0, 0, 0, 0})))
      << "at 20.4, beyond any image";
  for (const geometry::LensDistortion& lens : {geometry::LensDistortion{0.2, -0.3, 0, 0, 0.05},
                                               {-0.5, 0.3, 0, 0, -0.1},
                                               {-0.3, 0.1, 0, 0, -0.02},
                                               {0.3, -0.1, 0, 0, -0.02}}) {
    const auto radius = [&](double r) {
      const double r2 = r * r;
      return r * (1 + r2 * (lens.k1 + r2 * (lens.k2 + r2 * lens.k3)));
    };
    double fold = 0;
    while (radius(fold + 1e-4) > radius(fold)) fold += 1e-4;
    const double found = geometry::monotonic_radius(lens);
    EXPECT_LE(found, fold + 1e-3);
    EXPECT_GE(found, fold - 0.006);
  }
  const Undistortion undistortion(camera);
  for (int v = 0; v < 160; ++v)
    for (int u = 0; u < 200; ++u) {
      const double r = std::hypot((u - camera.published.cx_px) / camera.published.fx_px,
                                  (v - camera.published.cy_px) / camera.published.fy_px);
      ASSERT_FALSE(r > 0.92 && undistortion.sees(u, v)) << u << " " << v;
    }
}

// By default the published image contains all that the captured one shows.
TEST(OutsidePublished, IsWhatThePublishedImageDoesNotContain) {
  config::RigCamera camera = test::table_camera("wide", {0, -1, 1}, 320, 240);
  camera.distortion = {-0.25, 0.05, 0, 0, 0};
  camera.published = geometry::whole_pinhole(camera.source, camera.distortion);
  EXPECT_EQ(outside_published(camera).count(), 0u);
  camera.published = camera.source;
  const hull::ObjectPixels outside = outside_published(camera);
  for (int v = 0; v < 240; ++v)
    for (int u = 0; u < 320; ++u) {
      const Eigen::Vector2d xy =
          geometry::undistorted(camera.source, camera.distortion, Eigen::Vector2d(u, v));
      const double to_u = xy.x() * camera.source.fx_px + camera.source.cx_px,
                   to_v = xy.y() * camera.source.fy_px + camera.source.cy_px;
      ASSERT_EQ(outside.contains(u, v), std::round(to_u) < 0 || std::round(to_u) >= 320 ||
                                            std::round(to_v) < 0 || std::round(to_v) >= 240)
          << u << ' ' << v;
    }
  EXPECT_GT(outside.count(), 1000u);
  EXPECT_FALSE(outside.contains(160, 120));
  const config::RigCamera plain = test::table_camera("plain", {0, -1, 1}, 320, 240);
  EXPECT_EQ(outside_published(plain).count(), 0u);
}

// The user could not enlarge the image so that it contains them.
TEST(OutsidePublished, HasNoPixelBeyondTheFoldOfTheLensModel) {
  config::RigCamera camera = test::table_camera("fold", {0, -1, 1}, 400, 400);
  camera.source = {400, 400, 150, 150, 199.5, 199.5};
  camera.distortion = {-0.4, 0, 0, 0, 0};
  camera.published = geometry::whole_pinhole(camera.source, camera.distortion);
  ++camera.published.width_px;  // otherwise nothing is computed
  EXPECT_EQ(outside_published(camera).count(), 0u);
}

}  // namespace
}  // namespace fivepipe::capture
