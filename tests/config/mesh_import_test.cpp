// The limits of an import. tests/config/scene_test.cpp tests the meshes.
#include "common/config/mesh/mesh_import.h"

#include <gtest/gtest.h>

#include "common/config/mesh/mesh_file.h"
#include "tests/support/scene_files.h"

namespace fivepipe::config {
namespace {

using MeshImport = test::SceneFiles;

// Assimp catches the exception of the allocation.
TEST_F(MeshImport, AFileThatAnnouncesTooManyVerticesNeedsTooMuchMemory) {
  const std::filesystem::path file =
      write("vertices.ply",
            "ply\nformat ascii 1.0\nelement vertex 2147483648\nproperty float x\n"
            "property float y\nproperty float z\nelement face 1\n"
            "property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  // A sanitizer's allocator ends the process instead of throwing std::bad_alloc.
  EXPECT_NE(read_mesh(file, 1).reason, "");
#else
  EXPECT_EQ(read_mesh(file, 1).reason,
            "the importer needs too much memory: the file is damaged or too large");
#endif
}

TEST_F(MeshImport, AFileOfMoreThan4GiBIsRefused) {
  const std::filesystem::path file = write("large.stl", "");
  std::filesystem::resize_file(file, kMaxFileBytes + 1);  // sparse
  EXPECT_EQ(read_mesh(file, 1).reason, "the file is larger than 4 GiB");
}

// The buffers of a glTF file count, too.
TEST_F(MeshImport, AFileThatNamesMoreThan4GiBIsRefused) {
  std::filesystem::resize_file(write("large.bin", ""), kMaxFileBytes);  // sparse
  const std::filesystem::path file = write("large.gltf", R"({"asset": {"version": "2.0"},
 "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
 "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
 "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
 "bufferViews": [{"buffer": 0, "byteLength": 36}],
 "buffers": [{"byteLength": 36, "uri": "large.bin"}]})");
  const std::string reason = read_mesh(file, 1).reason;
  EXPECT_NE(reason.find("large.bin"), std::string::npos) << reason;
}

}  // namespace
}  // namespace fivepipe::config
