// Overlays in the composite: their places, colours and depths.
#include <cmath>

#include "common/geometry/gl_camera.h"
#include "render_node/overlays/overlay_painter.h"
#include "tests/render/composite_fixture.h"

namespace fivepipe::render {
namespace {

using config::Overlay;

class OverlayPicture : public Composite {
 protected:
  // A dark wall at 2 m, and a box of 20 cm at 1 m whose faces are parallel to the image.
  config::Scene scene_ = scene_of({plate("wall", 2, 8, 8)});
  geometry::Pinhole pinhole_ = config::render_pinhole(viewer_);
  const HullFrame* hull_ = &empty_hull_;

  void SetUp() override {
    config::SceneObject box =
        test::object("box", config::BoxShape{{0.2, 0.2, 0.2}}, {0.35, 1.1, -0.25}, {0.1, 0.1, 0.1});
    box.requests.response.emplace();
    box.requests.response->four_points = box.requests.response->closed_form = true;
    box.requests.proximity.emplace();
    scene_.objects.push_back(box);
    scene_.objects[0].colour_rgb = {0.1, 0.1, 0.1};
    scene_.overlays = {Overlay::collision_points, Overlay::recovery, Overlay::hull_normals,
                       Overlay::proximity};
  }
  cv::Mat with(const CollisionMarks& marks) const {
    Renderer renderer(scene_, viewer_);
    OverlayPainter painter(scene_, viewer_);
    renderer.draw(*hull_, {}, {});
    painter.draw(0, eye_, {&marks, 1});
    return renderer.image_bgr();
  }
  static CollisionMarks point(float x_m, float y_m, float z_m) {
    return {.object = 1, .points_world_m = {Eigen::Vector3f(x_m, y_m, z_m)}};
  }
  // x and z of the world are right and up in the image; y is the depth.
  cv::Point pixel(double x_m, double y_m, double z_m) const {
    return {int(std::lround(pinhole_.cx_px + pinhole_.fx_px * x_m / y_m)),
            int(std::lround(pinhole_.cy_px - pinhole_.fy_px * z_m / y_m))};
  }
  cv::Vec3b at(const cv::Mat& image, double x_m, double y_m, double z_m) const {
    return image.at<cv::Vec3b>(pixel(x_m, y_m, z_m));
  }
  // The number of pixels in which two images differ.
  static int different_px(const cv::Mat& a, const cv::Mat& b) {
    int count = 0;
    for (int v = 0; v < a.rows; ++v)
      for (int u = 0; u < a.cols; ++u) count += a.at<cv::Vec3b>(v, u) != b.at<cv::Vec3b>(v, u);
    return count;
  }
  static int white_px(const cv::Mat& image) {
    int count = 0;
    for (int v = 0; v < image.rows; ++v)
      for (int u = 0; u < image.cols; ++u) count += is_white(image.at<cv::Vec3b>(v, u));
    return count;
  }
  static bool is_white(const cv::Vec3b& bgr) { return bgr == cv::Vec3b(255, 255, 255); }
  static bool is_green(const cv::Vec3b& bgr) { return bgr[1] > 200 && bgr[0] < 90 && bgr[2] < 60; }
  static bool is_orange(const cv::Vec3b& bgr) {
    return bgr[2] > 200 && bgr[1] > 100 && bgr[1] < 180 && bgr[0] < 40;
  }
  static bool is_cyan(const cv::Vec3b& bgr) { return bgr[0] > 200 && bgr[1] > 180 && bgr[2] < 40; }
  static bool is_magenta(const cv::Vec3b& bgr) {
    return bgr[0] > 200 && bgr[1] < 90 && bgr[2] > 200;
  }
};

TEST_F(OverlayPicture, WithoutMarksNoPixelDiffers) {
  Renderer renderer(scene_, viewer_);
  renderer.draw(*hull_, {}, {});
  const cv::Mat before = renderer.image_bgr();
  OverlayPainter painter(scene_, viewer_);
  painter.draw(0, eye_, {});
  const CollisionMarks nothing{.object = 1};
  painter.draw(0, eye_, {&nothing, 1});
  EXPECT_EQ(different_px(before, renderer.image_bgr()), 0);
}

// The next frame and the depths of this one are as without overlays.
TEST_F(OverlayPicture, ChangesNeitherDepthsNorTheNextFrame) {
  Renderer renderer(scene_, viewer_);
  renderer.draw(*hull_, {}, {});
  const cv::Mat image = renderer.image_bgr(), depth_m = renderer.depth_m();
  OverlayPainter painter(scene_, viewer_);
  const CollisionMarks marks = point(0.1f, 1, 0.1f);
  painter.draw(0, eye_, {&marks, 1});
  EXPECT_GT(different_px(image, renderer.image_bgr()), 0);
  EXPECT_EQ(cv::norm(depth_m, renderer.depth_m(), cv::NORM_INF), 0);
  renderer.draw(*hull_, {}, {});
  EXPECT_EQ(different_px(image, renderer.image_bgr()), 0);
  painter.draw(0, eye_, {});
  EXPECT_EQ(different_px(image, renderer.image_bgr()), 0);
}

TEST_F(OverlayPicture, CollisionPointsAreWhiteDiscsAtTheirPlaces) {
  const cv::Mat image = with(point(0.2f, 1, 0.1f));
  EXPECT_TRUE(is_white(at(image, 0.2, 1, 0.1)));
  // Discs of 5 pixels; a pixel's centre may be on either side of the border.
  EXPECT_NEAR(white_px(image), M_PI * 2.5 * 2.5, 4);
  // With a dark outline.
  const cv::Point centre = pixel(0.2, 1, 0.1);
  EXPECT_LT(brightness(image.at<cv::Vec3b>(centre.y, centre.x + 3)), 60);
}

TEST_F(OverlayPicture, EachEyeHasItsOwnMarks) {
  viewer_.eye_distance_m = 0.06;
  Renderer renderer(scene_, viewer_);
  OverlayPainter painter(scene_, viewer_);
  renderer.draw(std::vector{*hull_, *hull_}, {}, {});
  const CollisionMarks left = point(-0.2f, 1, 0.1f), right = point(0.1f, 1, 0.1f);
  painter.draw(0, eye_, {&left, 1});
  painter.draw(1, eye_, {&right, 1});
  const cv::Mat image = renderer.image_bgr();
  ASSERT_EQ(image.cols, 2 * pinhole_.width_px);
  const auto half = [&](int eye) {
    return image.colRange(eye * pinhole_.width_px, (eye + 1) * pinhole_.width_px);
  };
  EXPECT_TRUE(is_white(at(half(0), -0.2, 1, 0.1)));
  EXPECT_FALSE(is_white(at(half(0), 0.1, 1, 0.1)));
  EXPECT_TRUE(is_white(at(half(1), 0.1, 1, 0.1)));
  EXPECT_FALSE(is_white(at(half(1), -0.2, 1, 0.1)));
}

// The marks keep their size relative to the image.
TEST_F(OverlayPicture, IsLargerInALargerImage) {
  viewer_.render_width_px = 1280, viewer_.render_height_px = 960;
  EXPECT_NEAR(white_px(with(point(0, 1, 0))), M_PI * 5 * 5, 8);
}

TEST_F(OverlayPicture, PartsBehindASurfaceAreFaint) {
  const int visible_px = white_px(with(point(-0.3f, 1.5f, 0)));
  EXPECT_EQ(white_px(with(point(-0.3f, 2.005f, 0))), visible_px) << "on the wall's surface";
  const int behind_wall_px = white_px(with(point(-0.3f, 2.02f, 0)));
  EXPECT_NEAR(behind_wall_px, 0.5 * visible_px, 2);
  const HullFrame hull =
      test::hull_of(eye_, config::recon_pinhole(viewer_), &kHullBgr, [](int, int) { return 1.4; });
  hull_ = &hull;
  EXPECT_NEAR(white_px(with(point(-0.3f, 1.5f, 0))), 0.5 * visible_px, 2);
  // Many hidden points at one place are no stronger.
  CollisionMarks many = point(-0.3f, 1.5f, 0);
  many.points_world_m.resize(100, many.points_world_m[0]);
  EXPECT_NEAR(white_px(with(many)), 0.5 * visible_px, 2);
}

TEST_F(OverlayPicture, PointsOutsideTheViewAreNotDrawn) {
  const cv::Mat nothing = with({.object = 1});
  for (const auto& [x_m, y_m] : {std::pair{0.0f, -1.0f}, {0.0f, 0.0f}, {0.0f, 0.04f}, {9.0f, 1.0f}})
    EXPECT_EQ(different_px(with(point(x_m, y_m, 0)), nothing), 0) << x_m << ' ' << y_m;
  // Just beyond the near plane, although the lift moves it nearer.
  EXPECT_GT(white_px(with(point(0, 0.0501f, 0))), 0);
}

TEST_F(OverlayPicture, TheRecoveryIsAnArrowWhoseEndIsMarked) {
  CollisionMarks marks{.object = 1};
  marks.recovery = RecoveryMark{{-0.2, 1, 0}, {0, 1, 0.2}, false};
  const cv::Mat image = with(marks);
  for (const double t : {0.03, 0.25, 0.5, 0.75, 0.97})
    EXPECT_TRUE(is_green(at(image, 0.2 * t - 0.2, 1, 0.2 * t))) << t;
  EXPECT_FALSE(is_green(at(image, -0.21, 1, -0.01)));
  const auto is_wide_at = [&](double t, double across_px) {
    const cv::Point on = pixel(0.2 * t - 0.2, 1, 0.2 * t);
    const int offset_px = int(std::lround(across_px / std::sqrt(2)));
    return is_green(image.at<cv::Vec3b>(on.y + offset_px, on.x + offset_px)) &&
           is_green(image.at<cv::Vec3b>(on.y - offset_px, on.x - offset_px));
  };
  // The shaft is 2 pixels wide. The head is 10 long and 10 wide at its base; the arrow is 166 long.
  EXPECT_FALSE(is_wide_at(0.5, 3));
  EXPECT_TRUE(is_wide_at(0.95, 3));
  // The disc at CP_hull has 10 pixels.
  const cv::Point end = pixel(0, 1, 0.2);
  EXPECT_TRUE(is_green(image.at<cv::Vec3b>(end.y, end.x + 4)));
  EXPECT_TRUE(is_green(image.at<cv::Vec3b>(end.y - 4, end.x)));
  EXPECT_FALSE(is_green(image.at<cv::Vec3b>(end.y - 7, end.x)));
  marks.recovery->still_colliding = true;
  EXPECT_TRUE(is_orange(at(with(marks), -0.1, 1, 0.1)));
}

TEST_F(OverlayPicture, NormalsAreArrowsOfTheirLength) {
  CollisionMarks marks{.object = 1};
  marks.hull_normals = {{{0, 1, 0}, {1, 0, 0}, true}, {{0, 1, 0}, {0, 0, -1}, false}};
  const cv::Mat image = with(marks);
  for (const double of_length : {0.2, 0.5, 0.9}) {
    EXPECT_TRUE(is_cyan(at(image, of_length * kNormalLength_m, 1, 0))) << of_length;
    EXPECT_TRUE(is_magenta(at(image, 0, 1, -of_length * kNormalLength_m))) << of_length;
  }
  EXPECT_FALSE(is_cyan(at(image, 1.05 * kNormalLength_m, 1, 0)));
  EXPECT_FALSE(is_magenta(at(image, 0, 1, -1.05 * kNormalLength_m)));
}

// Half of the arrow is behind the wall.
TEST_F(OverlayPicture, TheHiddenPartOfAnArrowIsFaint) {
  CollisionMarks marks{.object = 1};
  marks.recovery = RecoveryMark{{-0.4, 1.6, 0}, {0.4, 2.4, 0}, false};
  const cv::Mat image = with(marks);
  // Whether it is green in both of two neighbouring columns of the arrow.
  const auto is_strong = [&](double x_m) {
    const cv::Point on = pixel(x_m, 2 + x_m, 0);
    return is_green(image.at<cv::Vec3b>(on)) && is_green(image.at<cv::Vec3b>(on.y, on.x + 1));
  };
  EXPECT_TRUE(is_strong(-0.3) && is_strong(-0.1));
  EXPECT_FALSE(is_strong(0.1) || is_strong(0.3));
}

TEST_F(OverlayPicture, ProximityColoursTheVerticesBelowTheCap) {
  EXPECT_LT((proximity_rgb(0.5f) - Eigen::Vector3f(1, 0.9f, 0.3f)).norm(), 1e-6f);
  CollisionMarks marks{.object = 1};
  marks.proximity.assign(8, 1);
  std::map<double, std::size_t> front;  // by x + 2 z, of the vertices at depth 1 m
  const geometry::Mesh mesh = config::mesh_of(scene_.objects[1]);
  for (std::size_t i = 0; i < 8; ++i)
    if (mesh.vertices_m[i].y() < 0) front[mesh.vertices_m[i].x() + 2 * mesh.vertices_m[i].z()] = i;
  ASSERT_EQ(front.size(), 4u);
  std::vector<std::size_t> corners;  // bottom left, bottom right, top left, top right
  for (const auto& [place, vertex] : front) corners.push_back(vertex);
  marks.proximity[corners[0]] = 0, marks.proximity[corners[1]] = 0.5f;
  marks.proximity[corners[2]] = 0.99f;
  const cv::Mat image = with(marks);
  const auto near = [&](double x_m, double z_m, const Eigen::Vector3f& rgb) {
    const cv::Vec3b bgr = at(image, x_m, 1, z_m);
    return (Eigen::Vector3f(bgr[2], bgr[1], bgr[0]) - 255 * rgb).norm() < 2;
  };
  EXPECT_TRUE(near(0.25, -0.35, proximity_rgb(0)));
  EXPECT_TRUE(near(0.45, -0.35, proximity_rgb(0.5f)));
  EXPECT_TRUE(near(0.25, -0.15, proximity_rgb(0.99f)));
  EXPECT_EQ(at(image, 0.45, 1, -0.15), at(with({.object = 1}), 0.45, 1, -0.15)) << "at the cap";
}

TEST_F(OverlayPicture, ProximityOfTrianglesIsAtTheirCentroids) {
  scene_.objects[1].requests.proximity->of = config::ProximityOf::triangles;
  const OverlaidObject object = overlaid_objects(scene_).at("box");
  const std::vector<Eigen::Vector3f> places =
      proximity_places_world_m(object, object.mesh.vertices_m, scene_.objects[1].world_from_object);
  ASSERT_EQ(places.size(), 12u);
  for (std::size_t i = 0; i < places.size(); ++i) {
    Eigen::Vector3d sum_m = Eigen::Vector3d::Zero();
    for (const std::uint32_t v : object.mesh.triangles[i]) sum_m += object.mesh.vertices_m[v];
    EXPECT_LT((places[i] - Eigen::Vector3f(0.35f, 1.1f, -0.25f) - (sum_m / 3).cast<float>()).norm(),
              1e-6f);
  }
}

TEST_F(OverlayPicture, ProximityMovesWithItsObject) {
  Renderer renderer(scene_, viewer_);
  OverlayPainter painter(scene_, viewer_);
  CollisionMarks marks{.object = 1};
  marks.proximity.assign(8, 0);
  const auto red_at = [&](double x_m, double z_m) {
    renderer.draw(*hull_, {}, {});
    painter.draw(0, eye_, {&marks, 1});
    const cv::Vec3b bgr = at(renderer.image_bgr(), x_m, 0.9, z_m);
    return bgr[2] > 150 && bgr[1] < 60 && bgr[0] < 60;
  };
  Eigen::Isometry3d world_from_object = Eigen::Isometry3d::Identity();
  world_from_object.translation() = Eigen::Vector3d(-0.3, 1, 0);
  EXPECT_FALSE(red_at(-0.4, -0.1));
  painter.place("box", world_from_object, {});
  EXPECT_TRUE(red_at(-0.4, -0.1) && red_at(-0.2, 0.1));
  // Twice as high.
  std::vector<float> vertices_m;
  for (const Eigen::Vector3d& v : config::mesh_of(scene_.objects[1]).vertices_m)
    vertices_m.insert(vertices_m.end(), {float(v.x()), float(v.y()), float(2 * v.z())});
  painter.place("box", world_from_object, vertices_m);
  EXPECT_TRUE(red_at(-0.4, -0.2) && red_at(-0.2, 0.2));
  EXPECT_FALSE(red_at(-0.4, -0.1));
  painter.place("wall", world_from_object, {});
  painter.place("unknown", world_from_object, {});
  EXPECT_TRUE(red_at(-0.4, -0.2));
}

class Strokes : public OverlayPicture {
 protected:
  StrokeView view_{eye_, geometry::gl_clip_from_camera(pinhole_, 0.05, 5), 0.05, 640, 480, 0};
  std::vector<StrokeCorner> corners_of(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m,
                                       double margin_px = 0) const {
    const Arrow arrow{from_m, to_m, {1, 1, 1}};
    return strokes({&arrow, 1}, view_, 2, margin_px);
  }
};

TEST_F(Strokes, AreCutAtTheNearPlane) {
  const Eigen::Vector3d behind(0.1, -1, 0), before(0.1, 1, 0);
  EXPECT_TRUE(corners_of(behind, {0, 0.04, 0}).empty());
  EXPECT_EQ(corners_of(behind, before).size(), 9u) << "with its head";
  EXPECT_EQ(corners_of(before, behind).size(), 6u) << "without its head";
  for (const auto& corners : {corners_of(behind, before), corners_of(before, behind)})
    for (const StrokeCorner& corner : corners) {
      EXPECT_TRUE(corner.p_ndc.allFinite());
      EXPECT_GE(corner.p_ndc.z(), -1);
    }
}

TEST_F(Strokes, WithoutADirectionInTheImageAreSkipped) {
  EXPECT_TRUE(corners_of({0.1, 1, 0}, {0.1, 1, 0}).empty());
  EXPECT_TRUE(corners_of({0, 1, 0}, {0, 2, 0}).empty()) << "away from the eye";
}

TEST_F(Strokes, OfAnOutlineAreAMarginFartherOut) {
  const auto inner = corners_of({-0.1, 1, 0}, {0.1, 1, 0}),
             outer = corners_of({-0.1, 1, 0}, {0.1, 1, 0}, 3);
  ASSERT_EQ(inner.size(), 9u);
  ASSERT_EQ(outer.size(), 9u);
  const auto px = [](const StrokeCorner& corner) {
    return Eigen::Vector2d(0.5 * 640 * (corner.p_ndc.x() + 1), 0.5 * 480 * (corner.p_ndc.y() + 1));
  };
  EXPECT_NEAR(px(outer[0]).x(), px(inner[0]).x() - 3, 1e-3);
  EXPECT_NEAR(px(outer[0]).y(), px(inner[0]).y() - 3, 1e-3);
  EXPECT_NEAR(px(outer[2]).y(), px(inner[2]).y() + 3, 1e-3);
  // The distances of the head's outer corners from the lines of its inner edges.
  const auto distance_px = [&](int p, int a, int b) {
    const Eigen::Vector2d along = (px(inner[b]) - px(inner[a])).normalized(),
                          to_p = px(outer[p]) - px(inner[a]);
    return std::abs(along.x() * to_p.y() - along.y() * to_p.x());
  };
  for (const auto& [p, a, b] : {std::array{6, 6, 7}, {7, 6, 7}, {6, 6, 8}, {8, 7, 8}, {7, 7, 8}})
    EXPECT_NEAR(distance_px(p, a, b), 3, 1e-3) << p << a << b;
}

}  // namespace
}  // namespace fivepipe::render
