// `fivepipe study new` with glTF files that name their buffers, from the built command.
#include <gtest/gtest.h>

#include <array>
#include <fstream>

#include "launch/study/folder/study_folder.h"
#include "tests/study/study_command.h"
#include "tests/support/deployments.h"
#include "tests/support/test_folder.h"
#include "tests/support/text.h"

namespace fivepipe::study {
namespace {

namespace fs = std::filesystem;
using test::contains;

class GltfBuffers : public testing::Test {
 protected:
  // A triangle of these legs along x and y, in metres; glTF's y is up. Its corners are in the
  // buffer.
  void write(const fs::path& gltf, const fs::path& buffer, const std::string& uri, float leg_m) {
    fs::create_directories(gltf.parent_path());
    fs::create_directories(buffer.parent_path());
    std::ofstream(gltf) << R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
 "nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
 "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
   "min": [0, 0, 0], "max": [1, 1, 0]}],
 "bufferViews": [{"buffer": 0, "byteLength": 36}],
 "buffers": [{"byteLength": 36, "uri": ")"
                        << uri << "\"}]}";
    const std::array<float, 9> corners{0, 0, 0, leg_m, 0, 0, 0, leg_m, 0};
    std::ofstream(buffer, std::ios::binary)
        .write(reinterpret_cast<const char*>(corners.data()), sizeof corners);
  }
  test::ShellAnswer made(const std::string& meshes) {
    fs::remove_all(study_);
    return study_command("new " + study_.string() + " --deployment " + test::kSmallDeployment +
                         meshes);
  }
  // Nothing is left of the study. The message names the user's file, not that of a removed copy.
  void expect_refused(const test::ShellAnswer& answer, const std::string& why) {
    EXPECT_EQ(answer.exit_code, 2) << answer.text;
    EXPECT_TRUE(contains(answer.text, (parts_ / "part.gltf").string())) << answer.text;
    EXPECT_TRUE(contains(answer.text, why)) << answer.text;
    EXPECT_FALSE(contains(answer.text, study_.string() + "/deployment")) << answer.text;
    EXPECT_FALSE(fs::exists(study_));
  }

  test::TestFolder folder_;
  const fs::path parts_ = folder_.path / "parts", study_ = folder_.path / "study";
};

// Two files that name different buffers by the same name, one in a folder of its own.
TEST_F(GltfBuffers, AreCopiedAndReadFromTheCopies) {
  write(parts_ / "part.gltf", parts_ / "data" / "corners.bin", "data/corners.bin", 0.3f);
  write(parts_ / "other" / "part.gltf", parts_ / "other" / "data" / "corners.bin",
        "data/corners.bin", 0.7f);
  const test::ShellAnswer answer = made(" --mesh one=" + (parts_ / "part.gltf").string() +
                                        " --mesh two=" + (parts_ / "other" / "part.gltf").string());
  ASSERT_EQ(answer.exit_code, 0) << answer.text;
  EXPECT_TRUE(contains(answer.text, "30.0 x 0.0 x 30.0 cm")) << answer.text;
  EXPECT_TRUE(contains(answer.text, "70.0 x 0.0 x 70.0 cm")) << answer.text;
  fs::remove_all(parts_);
  const config::Deployment deployment = StudyFolder(study_).deployment();
  ASSERT_EQ(deployment.scene.objects.size(), 2u);
  for (const std::size_t i : {0, 1}) {
    const geometry::Mesh mesh = config::mesh_of(deployment.scene.objects[i]);
    EXPECT_TRUE(geometry::bounds_m(mesh).sizes().isApprox(
        Eigen::Vector3d(i == 0 ? 0.3 : 0.7, 0, i == 0 ? 0.3 : 0.7), 1e-6));
  }
}

TEST_F(GltfBuffers, ThatAreMissingAreNamed) {
  write(parts_ / "part.gltf", parts_ / "corners.bin", "corners.bin", 0.3f);
  fs::remove(parts_ / "corners.bin");
  expect_refused(made(" --mesh one=" + (parts_ / "part.gltf").string()), "corners.bin");
  // Shorter than the file states.
  write(parts_ / "part.gltf", parts_ / "corners.bin", "corners.bin", 0.3f);
  fs::resize_file(parts_ / "corners.bin", 20);
  expect_refused(made(" --mesh one=" + (parts_ / "part.gltf").string()), "cannot read the mesh: ");
}

// A copy that names it would change with the original.
TEST_F(GltfBuffers, OutsideTheFolderOfTheMeshAreRefused) {
  const fs::path outside = folder_.path / "corners.bin";
  write(parts_ / "part.gltf", outside, "../corners.bin", 0.3f);
  expect_refused(made(" --mesh one=" + (parts_ / "part.gltf").string()),
                 outside.string() + ", which is not below its folder; use one .glb file");
  // No address of glTF 2.0 (section 3.6.1.1).
  write(parts_ / "part.gltf", outside, outside.string(), 0.3f);
  expect_refused(made(" --mesh one=" + (parts_ / "part.gltf").string()), "cannot read the mesh: ");
}

}  // namespace
}  // namespace fivepipe::study
