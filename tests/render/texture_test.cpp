// Textured meshes against the light of the shader computed in double.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "common/base/math/srgb.h"
#include "common/config/mesh/mesh_file.h"
#include "common/config/yaml/config_error.h"
#include "tests/render/composite_fixture.h"
#include "tests/support/gltf/glb_file.h"
#include "tests/support/gltf/image_bytes.h"
#include "tests/support/test_folder.h"

namespace fivepipe::render {
namespace {

using Eigen::Vector3d;

constexpr double kDepth_m = 1;
constexpr float kPlate_m = 0.6f;
const Vector3d kPlateLight_m(0.3, -0.5, 0.2);
// sRGB, as BGR: top left, top right, bottom left, bottom right.
const std::array<cv::Vec3b, 4> kQuarters = {cv::Vec3b(30, 40, 220), cv::Vec3b(60, 200, 50),
                                            cv::Vec3b(230, 90, 20), cv::Vec3b(128, 180, 240)};

cv::Mat four_colours(int size_px = 64) {
  cv::Mat image(size_px, size_px, CV_8UC3);
  for (int v = 0; v < size_px; ++v)
    for (int u = 0; u < size_px; ++u)
      image.at<cv::Vec3b>(v, u) = kQuarters[2 * (2 * v >= size_px) + (2 * u >= size_px)];
  return image;
}

std::string encoded(const cv::Mat& image, const std::string& extension = ".png") {
  std::vector<std::uint8_t> bytes;
  cv::imencode(extension, image, bytes);
  return {bytes.begin(), bytes.end()};
}

double level_of(double linear) {
  const double l = std::min(1.0, linear);
  return 255 * (l <= 0.0031308 ? 12.92 * l : 1.055 * std::pow(l, 1 / 2.4) - 0.055);
}

class Textured : public Composite {
 protected:
  const test::TestFolder folder_;
  geometry::Pinhole pinhole_ = config::render_pinhole(viewer_);

  // Returns an object with the mesh of a GLB file that faces the eye, at kDepth_m.
  config::SceneObject object_of(const test::GlbContent& content) {
    const std::filesystem::path file = folder_.path / ("part" + std::to_string(files_++) + ".glb");
    std::ofstream(file, std::ios::binary) << test::glb_of(content);
    config::MeshOrReason mesh = config::read_mesh(file, 1, config::Materials::with);
    EXPECT_EQ(mesh.reason, "");
    return test::object("part", config::MeshShape{file, 1, mesh.mesh, mesh.materials},
                        {0, kDepth_m, 0}, {0.8, 0.8, 0.8});
  }
  config::SceneObject plate_with(const cv::Mat& image) {
    return object_of(
        {{test::glb_rectangle(kPlate_m, kPlate_m, 0)}, {encoded(image)}, test::kBoardAndRed});
  }
  static config::Scene lit(const config::SceneObject& object) {
    return scene_of({object}, kPlateLight_m);
  }
  cv::Mat drawn(const config::SceneObject& object, const std::set<std::string>& colliding = {}) {
    return image(lit(object), empty_hull_, colliding);
  }

  // Returns the point of the plate's plane that a pixel shows.
  Vector3d on_plate_m(int u, int v) const {
    return {kDepth_m * (u - pinhole_.cx_px) / pinhole_.fx_px, kDepth_m,
            -kDepth_m * (v - pinhole_.cy_px) / pinhole_.fy_px};
  }
  // Returns the pixel that shows texture coordinates of the plate.
  cv::Point pixel_at(double s, double t) const {
    return {int(std::lround(pinhole_.cx_px + (s - 0.5) * kPlate_m * pinhole_.fx_px / kDepth_m)),
            int(std::lround(pinhole_.cy_px + (t - 0.5) * kPlate_m * pinhole_.fy_px / kDepth_m))};
  }
  // Returns the expected BGR levels of a pixel of the plate with a linear albedo.
  Vector3d expected_bgr(int u, int v, const Vector3d& albedo_rgb) const {
    const double reach_m = (Vector3d(0, kDepth_m, 0) - kPlateLight_m).norm();
    const Vector3d to_light = (kPlateLight_m - on_plate_m(u, v)) / reach_m;
    const double diffuse = 1.6 * -to_light.y() / to_light.norm() / (1 + to_light.squaredNorm());
    const Vector3d light = Vector3d(0.135, 0.1425, 0.155) + diffuse * Vector3d(1, 0.97, 0.92);
    return {level_of(albedo_rgb[2] * light[2]), level_of(albedo_rgb[1] * light[1]),
            level_of(albedo_rgb[0] * light[0])};
  }
  static Vector3d linear_rgb(const cv::Vec3b& bgr) {
    return {base::linear_from_srgb(bgr[2] / 255.0), base::linear_from_srgb(bgr[1] / 255.0),
            base::linear_from_srgb(bgr[0] / 255.0)};
  }
  void expect_colour(const cv::Mat& picture, const cv::Point& at, const Vector3d& albedo_rgb,
                     double tolerance_levels = kLevels) const {
    const Vector3d expected = expected_bgr(at.x, at.y, albedo_rgb);
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(picture.at<cv::Vec3b>(at)[c], expected[c], tolerance_levels)
          << "channel " << c << " at " << at;
  }

  // Half a level of rounding, 0.41 of the shader's sRGB curve, and llvmpipe's conversion of sRGB
  // texels, which has 8 bits of fraction.
  static constexpr double kLevels = 1.5;

 private:
  int files_ = 0;
};

// Rows, columns and colours: each pixel of the plate except those at a filtered edge.
TEST_F(Textured, ThePlateShowsTheImageAtItsProjectedPlace) {
  const cv::Mat picture = drawn(plate_with(four_colours()));
  const double texel_px = kPlate_m * pinhole_.fx_px / kDepth_m / 64;
  ASSERT_GT(texel_px, 2);
  int compared = 0;
  for (int v = 0; v < picture.rows; ++v)
    for (int u = 0; u < picture.cols; ++u) {
      const Vector3d p_m = on_plate_m(u, v);
      const double s = p_m.x() / kPlate_m + 0.5, t = 0.5 - p_m.z() / kPlate_m;
      const auto is_near = [](double x, double edge) { return std::abs(x - edge) < 1.0 / 64; };
      if (!(s > 1.0 / 64 && s < 63.0 / 64 && t > 1.0 / 64 && t < 63.0 / 64) || is_near(s, 0.5) ||
          is_near(t, 0.5))
        continue;
      ++compared;
      const Vector3d expected =
          expected_bgr(u, v, linear_rgb(kQuarters[2 * (t > 0.5) + (s > 0.5)]));
      for (int c = 0; c < 3; ++c)
        ASSERT_NEAR(picture.at<cv::Vec3b>(v, u)[c], expected[c], kLevels) << u << " " << v;
    }
  EXPECT_GT(compared, 50'000);
}

TEST_F(Textured, AJpegFileBesideTheMeshIsDrawn) {
  test::GlbContent content{{test::glb_rectangle(kPlate_m, kPlate_m, 0)},
                           {},
                           test::kBoardAndRed + R"(, "images": [{"uri": "four.jpg"}])"};
  std::ofstream(folder_.path / "four.jpg", std::ios::binary) << encoded(four_colours(), ".jpg");
  const cv::Mat picture = drawn(object_of(content));
  // JPEG changes a uniform area by a few levels of its colour, which the light brightens.
  for (int i = 0; i < 4; ++i)
    expect_colour(picture, pixel_at(i % 2 ? 0.75 : 0.25, i / 2 ? 0.75 : 0.25),
                  linear_rgb(kQuarters[std::size_t(i)]), 6);
}

TEST_F(Textured, TheColourFactorMultipliesLinearColours) {
  test::GlbContent content{
      {test::glb_rectangle(kPlate_m, kPlate_m, 0)}, {encoded(four_colours())}, test::kBoardAndRed};
  content.members.replace(content.members.find("\"baseColorTexture\""), 0,
                          "\"baseColorFactor\": [0.5, 0.25, 0.75, 1], ");
  expect_colour(drawn(object_of(content)), pixel_at(0.75, 0.75),
                linear_rgb(kQuarters[3]).cwiseProduct(Vector3d(0.5, 0.25, 0.75)));
}

// The right half of the file's two parts has a colour alone; the order of the file is kept.
TEST_F(Textured, PartsWithAndWithoutTextureAreDrawnByTheirMaterials) {
  test::GlbContent content{{test::glb_rectangle(kPlate_m, kPlate_m, 1),
                            test::glb_rectangle(kPlate_m / 2, kPlate_m / 2, 0),
                            test::glb_rectangle(kPlate_m / 4, kPlate_m / 4, -1)},
                           {encoded(four_colours())},
                           test::kBoardAndRed};
  for (auto& corner : content.parts[1].corners) corner[2] += 0.001f;
  for (auto& corner : content.parts[2].corners) corner[2] += 0.002f;
  const cv::Mat picture = drawn(object_of(content));
  expect_colour(picture, pixel_at(0.1, 0.1), {0.5, 0.25, 0.125});
  expect_colour(picture, pixel_at(0.3, 0.3), linear_rgb(kQuarters[0]));
  const double grey = base::linear_from_srgb(0.8);  // the default of colour_rgb
  expect_colour(picture, pixel_at(0.5, 0.5), {grey, grey, grey});
}

TEST_F(Textured, CoordinatesOutsideTheImageWrapAsTheSamplerStates) {
  const auto with_wrap = [&](const std::string& sampler) {
    test::GlbContent content{{test::glb_rectangle(kPlate_m, kPlate_m, 0)},
                             {encoded(four_colours())},
                             test::kBoardAndRed};
    for (auto& uv : content.parts[0].uv) uv = {2 * uv[0], 2 * uv[1]};
    const std::string source = "{\"source\": 0";
    content.members.insert(content.members.find(source) + source.size(), ", \"sampler\": 0");
    content.members += ", \"samplers\": [" + sampler + "]";
    return drawn(object_of(content));
  };
  // Texture coordinates (1.25, 1.25).
  const cv::Point at = pixel_at(0.625, 0.625);
  expect_colour(with_wrap("{}"), at, linear_rgb(kQuarters[0]));
  expect_colour(with_wrap(R"({"wrapS": 33071, "wrapT": 33071})"), at, linear_rgb(kQuarters[3]));
  expect_colour(with_wrap(R"({"wrapS": 33648, "wrapT": 10497})"), at, linear_rgb(kQuarters[1]));
}

// A board of black and white texels that are much smaller than a pixel has half of white's light.
TEST_F(Textured, SmallTexelsAreAveragedInLinearLight) {
  cv::Mat board(2048, 2048, CV_8UC3);
  for (int v = 0; v < board.rows; ++v)
    for (int u = 0; u < board.cols; ++u)
      board.at<cv::Vec3b>(v, u) = (u + v) % 2 ? cv::Vec3b(255, 255, 255) : cv::Vec3b(0, 0, 0);
  const cv::Mat picture = drawn(plate_with(board));
  for (const double at : {0.2, 0.45, 0.8})
    expect_colour(picture, pixel_at(at, 0.6), {0.5, 0.5, 0.5}, kLevels + 1);  // mipmaps are 8-bit
}

TEST_F(Textured, ACollidingObjectIsHighlightedAsAPlainOne) {
  const cv::Mat picture = drawn(plate_with(four_colours()), {"part"});
  for (const std::size_t i : {0u, 3u})
    expect_colour(picture, pixel_at(i % 2 ? 0.75 : 0.25, i / 2 ? 0.75 : 0.25),
                  0.2 * linear_rgb(kQuarters[i]) + 0.8 * Vector3d(0.80, 0.02, 0.02));
}

TEST_F(Textured, ThePatternDarkensOddCellsOfTheTexture) {
  config::SceneObject object = plate_with(four_colours());
  object.pattern = config::Pattern::checker;
  object.pattern_size_m = 0.1;
  const cv::Mat picture = drawn(object);
  // Cells of the object's frame: (-2, 1) at the first place, (-2, 2) at the second.
  const auto at = [&](double x_m, double z_m) {
    return pixel_at(0.5 + x_m / kPlate_m, 0.5 - z_m / kPlate_m);
  };
  const Vector3d albedo = linear_rgb(kQuarters[0]);
  const cv::Point odd = at(-0.15, 0.15), even = at(-0.15, 0.25);
  const bool is_first_odd = picture.at<cv::Vec3b>(odd)[2] < picture.at<cv::Vec3b>(even)[2];
  expect_colour(picture, odd, (is_first_odd ? 0.62 : 1) * albedo);
  expect_colour(picture, even, (is_first_odd ? 1 : 0.62) * albedo);
}

TEST_F(Textured, AWarmObjectHasTheColourOfAPlainWarmOne) {
  config::SceneObject textured = plate_with(four_colours());
  textured.warming = config::Warming{};
  config::SceneObject plain = textured;
  std::get<config::MeshShape>(plain.shape).materials.reset();
  const auto with_warmth = [&](const config::SceneObject& object, float warmth) {
    Renderer renderer(lit(object), viewer_);
    const ObjectPose pose{"part", object.world_from_object, {}, std::vector<float>(4, warmth)};
    renderer.draw(empty_hull_, std::vector{pose}, {});
    return renderer.image_bgr();
  };
  // A GPU may round the two programs differently.
  EXPECT_LE(cv::norm(with_warmth(textured, 1), with_warmth(plain, 1), cv::NORM_INF), 1);
  EXPECT_GT(cv::norm(with_warmth(textured, 0), with_warmth(plain, 0), cv::NORM_INF), 50);
  expect_colour(with_warmth(textured, 0), pixel_at(0.25, 0.25), linear_rgb(kQuarters[0]));
}

TEST_F(Textured, TheTextureMovesWithTheVertices) {
  const config::SceneObject object = plate_with(four_colours());
  Renderer renderer(lit(object), viewer_);
  ObjectPose pose{"part", object.world_from_object, {}, {}};
  for (const Vector3d& v : config::mesh_of(object).vertices_m)
    pose.vertices_m.insert(pose.vertices_m.end(),
                           {float(v.x()) + kPlate_m / 2, float(v.y()), float(v.z())});
  renderer.draw(empty_hull_, std::vector{pose}, {});
  expect_colour(renderer.image_bgr(), pixel_at(0.75, 0.25), linear_rgb(kQuarters[0]));
}

TEST_F(Textured, APlateIsShadowed) {
  config::Scene scene = lit(plate_with(four_colours()));
  scene.objects.push_back(plate("occluder", 0.5, 0.05, 0.05));
  const cv::Mat bright = image(scene, empty_hull_);
  scene.shadows = config::ShadowView{.target_world_m = {0, 1, 0}, .fov_rad = 1.2};
  const cv::Mat dark = image(scene, empty_hull_);
  // The line from the light through the occluder's centre meets the plate here.
  const Vector3d p_m = kPlateLight_m + 1.5 * (Vector3d(0, 0.5, 0) - kPlateLight_m);
  const cv::Point shadowed = pixel_at(0.5 + p_m.x() / kPlate_m, 0.5 - p_m.z() / kPlate_m);
  EXPECT_LT(3 * brightness(dark.at<cv::Vec3b>(shadowed)),
            2 * brightness(bright.at<cv::Vec3b>(shadowed)));
  EXPECT_EQ(dark.at<cv::Vec3b>(pixel_at(0.9, 0.9)), bright.at<cv::Vec3b>(pixel_at(0.9, 0.9)));
}

TEST_F(Textured, DamagedImagesAreProblemsWithTheirNames) {
  const std::string good = encoded(four_colours());
  std::string bad_crc = good;
  bad_crc[good.size() / 2] = char(bad_crc[good.size() / 2] ^ 1);
  for (const std::string& image : {good.substr(0, good.size() / 2), bad_crc}) {
    const config::SceneObject object =
        object_of({{test::glb_rectangle(1, 1, 0)}, {image}, test::kBoardAndRed});
    const std::string file = std::get<config::MeshShape>(object.shape).file.string();
    try {
      // Two objects use the image. It is one problem.
      Renderer renderer(scene_of({object, object}), viewer_);
      ADD_FAILURE() << "accepted";
    } catch (const config::ConfigError& error) {
      EXPECT_EQ(error.problems().size(), 1u);
      EXPECT_EQ(
          std::string(error.what())
              .find(file + ": object part, material 'board': texture image 0 in " +
                    std::filesystem::path(file).filename().string() + ": the image is damaged"),
          0u)
          << error.what();
    }
  }
}

TEST_F(Textured, ImagesOfTheSceneHaveALimitTogether) {
  config::SceneObject object = object_of(
      {{test::glb_rectangle(1, 1, 0)}, {test::png_header(16384, 8193)}, test::kBoardAndRed});
  config::SceneObject other = object_of(
      {{test::glb_rectangle(1, 1, 0)}, {test::png_header(16384, 8193)}, test::kBoardAndRed});
  try {
    Renderer renderer(scene_of({object, other}), viewer_);
    ADD_FAILURE() << "accepted";
  } catch (const config::ConfigError& error) {
    ASSERT_EQ(error.problems().size(), 2u);
    EXPECT_TRUE(error.problems()[1].what.ends_with(
        "the textures of the scene have more than 268435456 pixels together"))
        << error.what();
  }
}

TEST(DecodedImage, HasEightBitColourFromEveryKindOfPng) {
  const cv::Mat grey(4, 4, CV_8UC1, cv::Scalar(77)),
      deep(4, 4, CV_16UC3, cv::Scalar(256, 512, 768)),
      clear(4, 4, CV_8UC4, cv::Scalar(10, 20, 30, 0));
  EXPECT_EQ(decoded(encoded(grey)).bgr.at<cv::Vec3b>(1, 1), cv::Vec3b(77, 77, 77));
  EXPECT_EQ(decoded(encoded(deep)).bgr.at<cv::Vec3b>(1, 1), cv::Vec3b(1, 2, 3));
  EXPECT_EQ(decoded(encoded(clear)).bgr.at<cv::Vec3b>(1, 1), cv::Vec3b(10, 20, 30));
}

TEST(DecodedImage, OfDamagedBytesIsAReason) {
  const std::string png = encoded(four_colours());
  for (std::size_t size : {std::size_t(8), std::size_t(33), png.size() / 2})
    EXPECT_NE(decoded(png.substr(0, size)).reason, "") << size;
  EXPECT_NE(decoded(test::png_header(5, 5)).reason, "");
}

}  // namespace
}  // namespace fivepipe::render
