#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "common/config/rig.h"
#include "tests/support/scene_files.h"

namespace fivepipe::config {
namespace {

using ::testing::ElementsAre;

// Returns a rig file with one camera that has the pose `pose` and the further keys `more`.
std::string rig_with(const std::string& pose, const std::string& more = "") {
  return "name: one\nvolume_m: {min: [-1, -1, 0], max: [1, 1, 1]}\ncameras:\n  - name: cam\n    "
         "image_size_px: [320, 240]\n    horizontal_fov_deg: 60\n" +
         pose + more;
}

class RigFile : public test::SceneFiles {
 protected:
  Rig load(const std::string& text) { return test::load_rig(write("rig.yaml", text)); }
  std::vector<std::string> problems(const std::string& text) {
    return problems_of([&] { load(text); });
  }
};

TEST_F(RigFile, ReadsEveryKey) {
  const Rig rig = load(R"(
name: bench
volume_m: {min: [-0.5, -0.4, 0], max: [0.5, 0.4, 1]}
cameras:
  - name: wall
    image_size_px: [640, 480]
    fx_px: 500.25
    fy_px: 501.5
    cx_px: 318
    cy_px: 242
    distortion: {k1: -0.3, k2: 0.1, p1: 0.001, p2: -0.002, k3: 0.01}
    calibration_error_px: 0.25
    published: {image_size_px: [320, 240], horizontal_fov_deg: 60}
    camera_from_world:
      rotation:
        - [1, 0, 0]
        - [0, 0, -1]
        - [0, 1, 0]
      translation_m: [0.1, 0.5, 2]
    gives_colour: false
  - name: hmd
    image_size_px: [640, 480]
    horizontal_fov_deg: 90
    mount: viewer
    look_at: {eye_m: [0.03, -0.05, 0], target_m: [0.03, -0.05, 1]}
)");
  EXPECT_EQ(rig.name, "bench");
  EXPECT_EQ(rig.volume_m.min(), Eigen::Vector3d(-0.5, -0.4, 0));
  EXPECT_EQ(rig.volume_m.max(), Eigen::Vector3d(0.5, 0.4, 1));
  ASSERT_EQ(rig.cameras.size(), 2u);

  const RigCamera& wall = rig.cameras[0];
  EXPECT_EQ(wall.source, (geometry::Pinhole{640, 480, 500.25, 501.5, 318, 242}));
  EXPECT_EQ(wall.distortion.k1, -0.3);
  EXPECT_EQ(wall.distortion.k2, 0.1);
  EXPECT_EQ(wall.distortion.p1, 0.001);
  EXPECT_EQ(wall.distortion.p2, -0.002);
  EXPECT_EQ(wall.distortion.k3, 0.01);
  EXPECT_EQ(wall.published, geometry::pinhole_from_fov(320, 240, std::numbers::pi / 3));
  EXPECT_TRUE(wall.gives_shape);
  EXPECT_FALSE(wall.gives_colour);
  EXPECT_EQ(wall.calibration_error_px, 0.25);
  EXPECT_TRUE(wall.camera_from_mount.translation().isApprox(Eigen::Vector3d(0.1, 0.5, 2)));
  EXPECT_TRUE((wall.camera_from_mount.linear() * Eigen::Vector3d(0, 1, 0))
                  .isApprox(Eigen::Vector3d(0, 0, 1)));

  const RigCamera& hmd = rig.cameras[1];
  EXPECT_EQ(hmd.mount, Mount::viewer);
  EXPECT_FALSE(hmd.gives_shape) << "cameras on the viewer never give shape";
  EXPECT_NEAR(hmd.source.fx_px, 320, 1e-9) << "90 degrees over 640 px";
  EXPECT_EQ(hmd.published, hmd.source);
  EXPECT_TRUE(hmd.gives_colour);
  EXPECT_EQ(hmd.calibration_error_px, std::nullopt);
  EXPECT_TRUE(hmd.distortion.none());
  EXPECT_FALSE(wall.distortion.none());
  EXPECT_EQ(shape_cameras(rig), std::vector<std::size_t>{0});
}

TEST(LensDistortion, IsNoneOnlyWithoutAnyCoefficient) {
  EXPECT_TRUE(geometry::LensDistortion{}.none());
  for (double geometry::LensDistortion::*coefficient :
       {&geometry::LensDistortion::k1, &geometry::LensDistortion::k2, &geometry::LensDistortion::p1,
        &geometry::LensDistortion::p2, &geometry::LensDistortion::k3}) {
    geometry::LensDistortion distortion;
    distortion.*coefficient = -1e-9;
    EXPECT_FALSE(distortion.none());
  }
}

TEST_F(RigFile, ByDefaultTheWholeCapturedImageIsPublished) {
  const std::string pose = "    look_at: {eye_m: [2, 0, 0.5], target_m: [0, 0, 0.5]}\n";
  const auto with = [&](const std::string& k1) {
    return rig_with(pose + "    distortion: {k1: " + k1 + ", k2: 0, p1: 0, p2: 0, k3: 0}\n");
  };
  const RigCamera barrel = load(with("-0.1")).cameras[0], plain = load(with("0")).cameras[0];
  EXPECT_EQ(plain.published, plain.source);
  EXPECT_EQ(barrel.published, geometry::whole_pinhole(barrel.source, barrel.distortion));
  EXPECT_GT(barrel.published.width_px, barrel.source.width_px);
  const std::string large =
      "name: one\nvolume_m: {min: [-1, -1, 0], max: [1, 1, 1]}\ncameras:\n  - name: cam\n    "
      "image_size_px: [16000, 12000]\n    fx_px: 8000\n    fy_px: 8000\n    cx_px: 8000\n    "
      "cy_px: 6000\n" +
      pose + "    distortion: {k1: -0.3, k2: 0, p1: 0, p2: 0, k3: 0}\n";
  EXPECT_THAT(problems(large),
              testing::ElementsAre(testing::HasSubstr(
                  "more than 16384: set published to a smaller one, or correct the distortion")));
  EXPECT_TRUE(problems(large + "    published: {image_size_px: [16000, 12000], fx_px: 8000, fy_px: "
                               "8000, cx_px: 8000, cy_px: 6000}\n")
                  .empty());
}

TEST_F(RigFile, FieldOfViewIsFromAHundredthTo170Degrees) {
  const auto with_angle = [&](const std::string& angle) {
    std::string text = rig_with("    look_at: {eye_m: [2, 0, 0.5], target_m: [0, 0, 0.5]}\n");
    return problems(text.replace(text.find("fov_deg: 60"), 11, "fov_deg: " + angle));
  };
  EXPECT_TRUE(with_angle("0.01").empty());
  EXPECT_TRUE(with_angle("170").empty());
  EXPECT_EQ(with_angle("0.009").size(), 1u);
  EXPECT_EQ(with_angle("170.1").size(), 1u);
}

TEST_F(RigFile, CalibrationErrorIsNotNegative) {
  const auto with = [&](const std::string& error_px) {
    return problems(rig_with("    look_at: {eye_m: [2, 0, 0.5], target_m: [0, 0, 0.5]}\n",
                             "    calibration_error_px: " + error_px + "\n"));
  };
  EXPECT_TRUE(with("0").empty());
  EXPECT_EQ(with("-0.1").size(), 1u);
  EXPECT_EQ(with("101").size(), 1u);
  EXPECT_EQ(with("nan").size(), 1u);
}

TEST_F(RigFile, EachPartOfThePinholeIsRequired) {
  const std::string pose = "    look_at: {eye_m: [2, 0, 0.5], target_m: [0, 0, 0.5]}\n";
  for (const std::string only : {"fx_px", "fy_px", "cx_px", "cy_px"}) {
    std::string text = rig_with(pose);
    const auto found =
        problems(text.replace(text.find("horizontal_fov_deg: 60"), 22, only + ": 100"));
    EXPECT_EQ(found.size(), 3u) << only;
    EXPECT_FALSE(test::contains(found, only + " is missing")) << only;
  }
  std::string text = rig_with(pose, "    published: {image_size_px: [32, 24]}\n");
  EXPECT_TRUE(test::contains(problems(text), "rig.yaml:8:16: focal length is missing"));
}

TEST_F(RigFile, ACameraHasOnePose) {
  const std::string look_at = "    look_at: {eye_m: [2, 0, 0.5], target_m: [0, 0, 0.5]}\n",
                    pose =
                        "    camera_from_world: {rotation: [[0, 1, 0], [0, 0, -1], [-1, 0, 0]], "
                        "translation_m: [0, 0.5, 2]}\n";
  EXPECT_TRUE(problems(rig_with(look_at)).empty());
  EXPECT_TRUE(problems(rig_with(pose)).empty());
  EXPECT_THAT(problems(rig_with(look_at, pose)),
              ElementsAre("rig.yaml:8:24: camera_from_world and look_at are both set: remove one"));
  std::string other = pose;
  other.replace(other.find("world"), 5, "viewer");
  EXPECT_THAT(problems(rig_with(other)),
              ElementsAre("rig.yaml:7:25: camera_from_viewer does not match the camera's mount: "
                          "use camera_from_world"));
  EXPECT_THAT(
      problems("name: a\nvolume_m: {min: [0, 0, 0], max: [1, 1, 1]}\ncameras:\n  - name: "
               "h\n    image_size_px: [4, 4]\n    horizontal_fov_deg: 60\n    mount: "
               "viewer\n"),
      ElementsAre("rig.yaml:4:3: no camera gives shape: set gives_shape to true for a "
                  "camera with mount world",
                  "rig.yaml:4:5: the camera has no pose: set look_at or camera_from_viewer"));
}

TEST_F(RigFile, LookAtProjectsTheTargetToTheImageCenter) {
  const Rig rig = load(rig_with("    look_at: {eye_m: [2, 1, 1.5], target_m: [0, 0, 0.5]}\n"));
  const auto uv_px = geometry::project(published_camera(rig.cameras[0]), {0, 0, 0.5});
  ASSERT_TRUE(uv_px);
  EXPECT_NEAR(uv_px->x(), 159.5, 1e-9);
  EXPECT_NEAR(uv_px->y(), 119.5, 1e-9);
  const Eigen::Matrix3d axes = rig.cameras[0].camera_from_mount.linear();
  EXPECT_NEAR(axes(0, 2), 0, 1e-12) << "the rows of the image are level";
  EXPECT_LT(axes(1, 2), 0) << "up in the world is up in the image";
}

TEST_F(RigFile, CameraOnTheViewerFollowsTheEye) {
  const Rig rig = load(R"(
name: head
volume_m: {min: [-1, -1, 0], max: [1, 1, 1]}
cameras:
  - name: wall
    image_size_px: [320, 240]
    horizontal_fov_deg: 60
    look_at: {eye_m: [2, 1, 1.5], target_m: [0, 0, 0.5]}
  - name: hmd
    image_size_px: [320, 240]
    horizontal_fov_deg: 60
    mount: viewer
    look_at: {eye_m: [0, -0.06, 0], target_m: [0, -0.06, 1]}
)");
  const Eigen::Isometry3d eye_from_world =
      geometry::look_at({0, -1, 0.5}, {0, 0, 0.5});  // level, towards +y
  EXPECT_TRUE(geometry::camera_center_world_m(published_camera(rig.cameras[1], eye_from_world))
                  .isApprox(Eigen::Vector3d(0, -1, 0.56), 1e-12))
      << "6 cm above the eye: the eye's frame has y down";
  EXPECT_TRUE(rig.cameras[1].camera_from_mount.linear().isIdentity(1e-12))
      << "looks ahead, without a roll";
  EXPECT_TRUE(published_camera(rig.cameras[0], eye_from_world)
                  .camera_from_world.isApprox(rig.cameras[0].camera_from_mount))
      << "cameras in the world do not move";
}

TEST_F(RigFile, NearRotationIsOrthonormalized) {
  // The rotation has six digits, as in calibration files.
  const Rig rig =
      load(rig_with("    camera_from_world: {rotation: [[0.707107, 0.707107, 0], [0, 0, -1], "
                    "[-0.707107, 0.707107, 0]], translation_m: [0, 0.5, 3]}\n"));
  const Eigen::Matrix3d r = rig.cameras[0].camera_from_mount.linear();
  EXPECT_LT((r.transpose() * r - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_NEAR(r(0, 0), std::sqrt(0.5), 1e-6);
}

TEST_F(RigFile, NonOrthonormalRotationIsRejected) {
  EXPECT_THAT(problems(rig_with("    camera_from_world: {rotation: [[1, 0.1, 0], [0, 0, -1], [0, "
                                "1, 0]], translation_m: [0, 0.5, 3]}\n")),
              ElementsAre("rig.yaml:4:5: camera cam: rotation is not orthonormal"));
}

TEST_F(RigFile, MirroredRotationIsRejected) {
  EXPECT_THAT(problems(rig_with("    camera_from_world: {rotation: [[-1, 0, 0], [0, 0, -1], [0, 1, "
                                "0]], translation_m: [0, 0.5, 3]}\n")),
              ElementsAre("rig.yaml:4:5: camera cam: rotation is mirrored (determinant -1)"));
}

TEST_F(RigFile, NanAndInfinityAreRejected) {
  EXPECT_THAT(problems(rig_with("    camera_from_world: {rotation: [[1, .nan, 0], [0, 0, -1], [0, "
                                "1, 0]], translation_m: [0, -.inf, 1e999]}\n",
                                "    distortion: {k1: nan, k2: 0, p1: 0, p2: 0, k3: inf}\n")),
              ElementsAre("rig.yaml:7:40: rotation[0][1] must be finite, is .nan",
                          "rig.yaml:7:93: translation_m[1] must be finite, is -.inf",
                          "rig.yaml:7:100: translation_m[2] must be finite, is 1e999",
                          "rig.yaml:8:22: k1 must be finite, is nan",
                          "rig.yaml:8:52: k3 must be finite, is inf"));
}

TEST_F(RigFile, ReportsEveryProblemWithItsLocation) {
  EXPECT_THAT(problems(R"(
name: Bad Name
volume_m: {min: [0, 0, 0], max: [1, -1, 1]}
colour: red
cameras:
  - name: a
    image_size: [320, 240]
    horizontal_fov_deg: 200
    look_at: {eye_m: [1, 1, 1], target_m: [1, 1, 0]}
  - name: b
    image_size_px: [320, 240.5]
    horizontal_fov_rad: 1
    look_at: {eye_m: [1, 1], target_m: [0, zero, 0]}
    gives_shape: yes
  - name: a
    image_size_px: [320, 240]
    horizontal_fov_deg: 60
    fx_px: 300
    mount: ceiling
    mount: world
)"),
              ElementsAre("rig.yaml:1:7: name must consist of a-z, 0-9 and _, is \"Bad Name\"",
                          "rig.yaml:2:33: max must be greater than min (0) in y, is -1",
                          "rig.yaml:3:1: unknown key colour; known keys: name, volume_m, cameras",
                          "rig.yaml:6:5: unknown key image_size: use image_size_px",
                          "rig.yaml:7:25: horizontal_fov_deg must be from 0.01 to 170, is 200",
                          "rig.yaml:8:14: look_at has no up direction: target_m is at eye_m, or "
                          "straight above or below it; use a rotation instead",
                          "rig.yaml:9:5: focal length is missing: set horizontal_fov_deg, or "
                          "fx_px, fy_px, cx_px and cy_px",
                          "rig.yaml:10:26: image_size_px[1] must be a whole number, is 240.5",
                          "rig.yaml:11:5: unknown key horizontal_fov_rad: use horizontal_fov_deg",
                          "rig.yaml:12:22: eye_m must be a list of 3, is a list of 2",
                          "rig.yaml:12:44: target_m[1] must be a number, is \"zero\"",
                          "rig.yaml:13:18: gives_shape must be true or false, is \"yes\"",
                          "rig.yaml:14:5: the camera has no pose: set look_at or camera_from_world",
                          "rig.yaml:14:11: camera name a is already used in line 5",
                          "rig.yaml:17:12: fx_px and horizontal_fov_deg are both set: remove one",
                          "rig.yaml:18:12: mount must be one of world, viewer; is \"ceiling\"",
                          "rig.yaml:19:5: duplicate key mount, already set in line 18"));
}

TEST_F(RigFile, PoseMustMatchMount) {
  EXPECT_TRUE(test::contains(
      problems(rig_with("    mount: viewer\n    camera_from_world: {rotation: [[1, 0, 0], [0, 1, "
                        "0], [0, 0, 1]], translation_m: [0, 0, 0]}\n")),
      "rig.yaml:8:24: camera_from_world does not match the camera's mount: use "
      "camera_from_viewer"));
  EXPECT_TRUE(
      test::contains(problems(rig_with("    mount: viewer\n    gives_shape: true\n    look_at: "
                                       "{eye_m: [0, 0, 0], target_m: [0, 0, 1]}\n")),
                     "rig.yaml:8:18: gives_shape must be false for a camera with mount viewer"));
}

TEST_F(RigFile, CameraThatMissesVolumeIsReported) {
  EXPECT_THAT(problems(rig_with("    look_at: {eye_m: [3, 0, 0.5], target_m: [6, 0, 0.5]}\n")),
              ElementsAre("rig.yaml:4:5: camera cam sees no part of volume_m: check its pose (is "
                          "it that from world "
                          "to camera, with translation_m in metres?) and volume_m"));
}

TEST_F(RigFile, APoseInMillimetresIsReported) {
  const auto pose = [](const char* z) {
    return "    camera_from_world: {rotation: [[1, 0, 0], [0, 0, -1], [0, 1, 0]], translation_m: "
           "[0, 0, " +
           std::string(z) + "]}\n";
  };
  EXPECT_TRUE(problems(rig_with(pose("3"))).empty());
  EXPECT_THAT(
      problems(rig_with(pose("3000"))),
      ElementsAre("rig.yaml:4:5: camera cam sees volume_m as less than 4 px: check its pose "
                  "(is translation_m in metres?) and volume_m"));
}

// One fault is one problem: the volume is unknown then.
TEST_F(RigFile, TheVolumeHasASizeInEachAxis) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const std::string max : {"-1", "-2"}) {
      std::array<std::string, 3> maxima{"1", "1", "1"};
      maxima[axis] = max;
      std::string text = rig_with("    look_at: {eye_m: [9, 0, 0.5], target_m: [0, 0, 0.5]}\n");
      const std::string before = "min: [-1, -1, 0], max: [1, 1, 1]";
      text.replace(
          text.find(before), before.size(),
          "min: [-1, -1, -1], max: [" + maxima[0] + ", " + maxima[1] + ", " + maxima[2] + "]");
      EXPECT_THAT(problems(text),
                  ElementsAre("rig.yaml:2:36: max must be greater than min (-1) in " +
                              std::string(1, "xyz"[axis]) + ", is " + max));
    }
}

TEST_F(RigFile, RigWithoutShapeIsRejected) {
  EXPECT_TRUE(
      test::contains(problems(rig_with("    look_at: {eye_m: [3, 0, 0.5], target_m: [0, 0, 0.5]}\n",
                                       "    gives_shape: false\n")),
                     "no camera gives shape"));
  EXPECT_TRUE(test::contains(
      problems("name: none\nvolume_m: {min: [0, 0, 0], max: [1, 1, 1]}\ncameras: []\n"),
      "cameras must be a list of at least one"));
}

TEST_F(RigFile, ReportsWhyAFileIsUnreadable) {
  EXPECT_THAT(problems_of([&] { test::load_rig(folder() / "absent.yaml"); }),
              ElementsAre("absent.yaml:0:0: there is no such file"));
  std::filesystem::create_directory(folder() / "dir.yaml");
  EXPECT_THAT(problems_of([&] { test::load_rig(folder() / "dir.yaml"); }),
              ElementsAre("dir.yaml:0:0: is a directory, not a file"));
  EXPECT_TRUE(test::contains(problems("name: [a, b\nvolume_m: 3\n"), ": not YAML: "));
  EXPECT_THAT(problems(""),
              ElementsAre("rig.yaml:1:1: the file must contain a mapping of keys to values"));
  EXPECT_THAT(problems("- 1\n"),
              ElementsAre("rig.yaml:1:1: the file must contain a mapping of keys to values"));
  EXPECT_TRUE(
      test::contains(problems(test::kGoodRig + "---\nname: second\n"), "a second YAML document"));
  EXPECT_TRUE(test::contains(problems(std::string(100000, '[')), ": not YAML: "))
      << "the nesting is too deep for the parser";
}

// yaml-cpp 0.7 reads empty documents without end at a comma.
TEST_F(RigFile, RejectsAFileThatStartsWithAComma) {
  const std::string what = ": not YAML: a value cannot start with a comma";
  EXPECT_THAT(problems(","), ElementsAre("rig.yaml:1:1" + what));
  EXPECT_THAT(problems("# cameras\n  , " + test::kGoodRig), ElementsAre("rig.yaml:2:3" + what));
  EXPECT_TRUE(test::contains(problems(test::kGoodRig + "...\n,\n"), "a second YAML document"));
}

TEST_F(RigFile, MissingValuesAndWrongTypesAreProblems) {
  EXPECT_TRUE(test::contains(problems("name: a\nvolume_m:\ncameras: 3\n"),
                             "rig.yaml:2:1: volume_m has no value"));
  EXPECT_TRUE(test::contains(problems("name: a\nvolume_m:\ncameras: 3\n"),
                             "rig.yaml:3:10: cameras must be a list of at least one, is \"3\""));
  EXPECT_TRUE(
      test::contains(problems("name: {a: 1}\nvolume_m: [1]\ncameras: [1, {name: [x]}]\n"),
                     "rig.yaml:3:11: cameras[0] must be a mapping of keys to values, is \"1\""));
  EXPECT_TRUE(test::contains(problems("? [a, b]\n: 3\n"), "a key must be a single word"));
}

// A truncated file, or one with a wrong byte, loads or throws ConfigError, never another exception.
TEST_F(RigFile, DamagedFilesLoadOrListProblems) {
  const std::string good = test::kGoodRig.substr(1);
  for (std::size_t length = 0; length < good.size(); ++length) problems(good.substr(0, length));
  std::mt19937 random(1);
  for (int i = 0; i < 1000; ++i) {
    std::string damaged = good;
    damaged[random() % damaged.size()] = "\0\t\n :-[]{},&*!|>'\"%@`#0a\xff"[random() % 25];
    problems(damaged);
  }
}

}  // namespace
}  // namespace fivepipe::config
