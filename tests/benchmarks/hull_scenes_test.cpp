#include "benchmarks/hull/scenes.h"

#include <gtest/gtest.h>

#include <fstream>

#include "common/hull/pbm.h"
#include "tests/support/test_folder.h"
#include "tests/support/text.h"

namespace fivepipe::hull_bench {
namespace {

// As `fivepipe maps` writes the maps of a user's rig.
class RealMaps : public testing::Test {
 protected:
  RealMaps() {
    std::filesystem::create_directories(folder_);
    write("cameras.txt",
          "# a comment\nleft 20 10 30 31 9.5 4.5 1 0 0 0.1 0 1 0 0.2 0 0 1 3\n"
          "right 20 10 30 31 9.5 4.5 1 0 0 0 0 1 0 0 0 0 1 2\n");
    write("volume.txt", "# a comment\n-1 -0.5 0 1.5 0.5 2\n");
    hull::ObjectPixels pixels(20, 10);
    pixels.set(3, 4);
    for (const std::string camera : {"left", "right"})
      hull::write_pbm(folder_ / (camera + ".pbm"), pixels);
  }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }
  std::string refusal() const {
    try {
      real_scene(folder_);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "none";
  }

  const test::TestFolder test_folder_;
  const std::filesystem::path folder_ = test_folder_.path / "my_rig";
};

TEST_F(RealMaps, OfAnyRigAreSeenAsAWhole) {
  const HullScene scene = real_scene(folder_);
  EXPECT_EQ(scene.name, "my_rig");
  ASSERT_EQ(scene.silhouettes.size(), 2u);
  EXPECT_EQ(scene.silhouettes[0].camera.pinhole, (geometry::Pinhole{20, 10, 30, 31, 9.5, 4.5}));
  EXPECT_EQ(scene.silhouettes[0].camera.camera_from_world.translation(),
            Eigen::Vector3d(0.1, 0.2, 3));
  EXPECT_TRUE(scene.silhouettes[1].pixels.contains(3, 4));
  EXPECT_EQ(scene.volume_world_m.min(), Eigen::Vector3d(-1, -0.5, 0));
  EXPECT_EQ(scene.volume_world_m.max(), Eigen::Vector3d(1.5, 0.5, 2));
  for (const auto& [width_px, height_px] : {std::pair{640, 480}, {1920, 1080}})
    for (int i = 0; i < 8; ++i) {
      const hull::View view = view_of(scene, width_px, height_px);
      const Eigen::Vector3d corner_m =
          scene.volume_world_m.corner(Eigen::AlignedBox3d::CornerType(i));
      const auto uv_px = geometry::project(view.camera, corner_m);
      ASSERT_TRUE(uv_px);
      EXPECT_TRUE(
          Eigen::AlignedBox2d(Eigen::Vector2d(0, 0), Eigen::Vector2d(width_px - 1, height_px - 1))
              .contains(*uv_px))
          << i;
      const double depth_m = (view.camera.camera_from_world * corner_m).z();
      EXPECT_GT(depth_m, view.near_m);
      EXPECT_LT(depth_m, view.far_m);
    }
}

TEST_F(RealMaps, WithoutAVolumeAreRefused) {
  const std::string why =
      ": expected six numbers, min and max of the volume; write the maps with "
      "`fivepipe maps`";
  for (const std::string text :
       {"", "# only a comment\n", "1 2 3 4 5\n", "0 0 0 1 -1 1\n", "x\n"}) {
    write("volume.txt", text);
    EXPECT_EQ(refusal(), (folder_ / "volume.txt").string() + why) << text;
  }
  std::filesystem::remove(folder_ / "volume.txt");
  EXPECT_EQ(refusal(), (folder_ / "volume.txt").string() + why);
}

}  // namespace
}  // namespace fivepipe::hull_bench
