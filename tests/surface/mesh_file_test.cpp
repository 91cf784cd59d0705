// Meshes and point clouds as files, read by a library that did not write them (Assimp).
#include "common/surface/mesh_file.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <gtest/gtest.h>
#include <assimp/Importer.hpp>

#include "common/config/mesh/mesh_file.h"
#include "common/geometry/closed_mesh.h"
#include "tests/support/source_text.h"
#include "tests/support/test_folder.h"

namespace fivepipe::surface {
namespace {

using Eigen::Vector3d;

constexpr MeshFormat kAll[] = {MeshFormat::ply, MeshFormat::obj, MeshFormat::stl, MeshFormat::glb};

// Not symmetric, so that exchanged axes are noticed.
geometry::Mesh part() {
  geometry::Mesh mesh = geometry::box_mesh({0.1, 0.2, 0.4});
  for (Vector3d& p : mesh.vertices_m) p += Vector3d(1, 2, 3);
  return mesh;
}

// From 0 to 255 along z.
std::vector<Rgb> colours_of(const geometry::Mesh& mesh) {
  std::vector<Rgb> colours;
  for (const Vector3d& p : mesh.vertices_m)
    colours.push_back(p.z() > 3 ? Rgb{255, 128, 0} : Rgb{0, 64, 255});
  return colours;
}

class MeshFiles : public testing::Test {
 protected:
  std::filesystem::path written(const MeshFile& content, MeshFormat format) {
    const auto file = folder_.path / "new" / ("mesh" + extension_of(format));
    write_mesh(file, content, format);
    return file;
  }
  // Valid until the next call.
  const aiScene* read(const std::filesystem::path& file) {
    return importer_.ReadFile(file.string(), aiProcess_ValidateDataStructure);
  }
  const test::TestFolder folder_;
  Assimp::Importer importer_;
};

TEST_F(MeshFiles, AnotherReaderFindsTheMesh) {
  for (const MeshFormat format : kAll) {
    const geometry::Mesh mesh = part();
    const auto read = config::read_mesh(written({mesh}, format), 1);
    ASSERT_EQ(read.reason, "") << extension_of(format);
    EXPECT_EQ(read.mesh.triangles.size(), mesh.triangles.size());
    EXPECT_EQ(geometry::open_edges(read.mesh), 0u) << extension_of(format);
    EXPECT_NEAR(geometry::enclosed_volume_m3(read.mesh), 0.1 * 0.2 * 0.4, 1e-7)
        << extension_of(format);
    EXPECT_TRUE(geometry::bounds_m(read.mesh).isApprox(geometry::bounds_m(mesh), 1e-6))
        << extension_of(format);
  }
}

TEST_F(MeshFiles, HaveTheirColours) {
  const geometry::Mesh mesh = part();
  for (const MeshFormat format : {MeshFormat::ply, MeshFormat::obj, MeshFormat::glb}) {
    const aiScene* const scene = read(written({mesh, colours_of(mesh)}, format));
    ASSERT_TRUE(scene) << importer_.GetErrorString();
    ASSERT_EQ(scene->mNumMeshes, 1u);
    const aiMesh& found = *scene->mMeshes[0];
    ASSERT_TRUE(found.HasVertexColors(0)) << extension_of(format);
    for (unsigned i = 0; i < found.mNumVertices; ++i) {
      const bool is_glb = format == MeshFormat::glb;
      const bool is_high = (is_glb ? found.mVertices[i].y : found.mVertices[i].z) > 3;
      const aiColor4D& colour = found.mColors[0][i];
      // glTF's colours are linear: sRGB 128 is 0.2159, 64 is 0.0513.
      EXPECT_NEAR(colour.r, is_high ? 1 : 0, 1e-4);
      EXPECT_NEAR(colour.g, is_high ? (is_glb ? 0.2159 : 0.502) : (is_glb ? 0.0513 : 0.251), 1e-3);
      EXPECT_NEAR(colour.b, is_high ? 0 : 1, 1e-4);
    }
  }
}

TEST_F(MeshFiles, HaveNormalsOutward) {
  const geometry::Mesh mesh = part();
  for (const MeshFormat format : {MeshFormat::ply, MeshFormat::stl, MeshFormat::glb}) {
    const aiScene* const scene = read(written({mesh}, format));
    ASSERT_TRUE(scene) << importer_.GetErrorString();
    const aiMesh& found = *scene->mMeshes[0];
    ASSERT_TRUE(found.HasNormals());
    const aiVector3D center =
        format == MeshFormat::glb ? aiVector3D(1, 3, -2) : aiVector3D(1, 2, 3);
    for (unsigned i = 0; i < found.mNumVertices; ++i) {
      EXPECT_NEAR(found.mNormals[i].Length(), 1, 1e-5);
      EXPECT_GT(found.mNormals[i] * (found.mVertices[i] - center), 0);
    }
  }
}

TEST_F(MeshFiles, PointCloudsHavePointsAndColours) {
  geometry::Mesh cloud;
  for (int i = 0; i < 7; ++i) cloud.vertices_m.emplace_back(0.1 * i, 0.2 * i, 1 + 0.3 * i);
  const std::vector<Rgb> colours(7, Rgb{255, 0, 0});
  for (const MeshFormat format : {MeshFormat::obj, MeshFormat::glb}) {
    const aiScene* const scene = read(written({cloud, colours}, format));
    ASSERT_TRUE(scene) << importer_.GetErrorString();
    const aiMesh& found = *scene->mMeshes[0];
    EXPECT_EQ(found.mPrimitiveTypes, unsigned(aiPrimitiveType_POINT)) << extension_of(format);
    EXPECT_EQ(found.mNumVertices, 7u) << extension_of(format);
  }
  // Assimp reads no PLY file without faces; the file is short enough to state it.
  const std::string ply = test::text_of(written({cloud, colours}, MeshFormat::ply));
  const std::string header =
      "ply\nformat binary_little_endian 1.0\ncomment fivepipe: metres, z up\nelement vertex 7\n"
      "property float x\nproperty float y\nproperty float z\nproperty uchar red\n"
      "property uchar green\nproperty uchar blue\nend_header\n";
  ASSERT_EQ(ply.substr(0, header.size()), header);
  ASSERT_EQ(ply.size(), header.size() + 7 * 15);
  float z = 0;
  std::memcpy(&z, ply.data() + header.size() + 6 * 15 + 8, sizeof z);
  EXPECT_FLOAT_EQ(z, 2.8f);
  EXPECT_EQ(std::uint8_t(ply[header.size() + 6 * 15 + 12]), 255);
  EXPECT_THROW(written({cloud}, MeshFormat::stl), std::invalid_argument);
}

TEST_F(MeshFiles, WithoutVerticesAreWritten) {
  for (const MeshFormat format : kAll)
    EXPECT_TRUE(std::filesystem::exists(written({}, format))) << extension_of(format);
  EXPECT_THROW(written({part(), std::vector<Rgb>(3)}, MeshFormat::ply), std::invalid_argument);
  EXPECT_THROW(write_mesh("/proc/no/such.ply", {part()}, MeshFormat::ply), std::runtime_error);
}

TEST(MeshFormats, AreNamedByTheirExtension) {
  for (const MeshFormat format : kAll)
    EXPECT_EQ(mesh_format_from(extension_of(format).substr(1)), format);
  EXPECT_FALSE(mesh_format_from("fbx"));
  EXPECT_FALSE(mesh_format_from(""));
}

}  // namespace
}  // namespace fivepipe::surface
