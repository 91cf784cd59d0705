// Imports of mesh files and their limits. tests/config/scene_test.cpp tests the meshes of scenes.
#include "common/config/mesh/mesh_import.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <set>
#include <vector>

#include "common/config/mesh/mesh_bytes.h"
#include "common/config/mesh/mesh_file.h"
#include "tests/support/base64.h"
#include "tests/support/sanitizer.h"
#include "tests/support/scene_files.h"

namespace fivepipe::config {
namespace {

using MeshImport = test::SceneFiles;
using Corner = std::array<float, 3>;
using Corners = std::multiset<std::array<Corner, 3>>;

// Returns the corners of each triangle, the smallest one first.
Corners corners_of(const ImportedMesh& mesh) {
  Corners corners;
  for (const auto& [a, b, c] : mesh.triangles) {
    std::array<Corner, 3> triangle{mesh.vertices.at(a), mesh.vertices.at(b), mesh.vertices.at(c)};
    std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end()),
                triangle.end());
    corners.insert(triangle);
  }
  return corners;
}

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

// Returns a glTF file of these triangles, each in a mesh of its own.
std::string gltf_of(const std::vector<std::array<Corner, 3>>& triangles) {
  std::string nodes, ids, meshes, accessors, views, bytes;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const std::string n = std::to_string(i), comma = i == 0 ? "" : ", ";
    ids += comma + n;
    nodes += comma + "{\"mesh\": " + n + "}";
    meshes += comma + R"({"primitives": [{"attributes": {"POSITION": )" + n + "}}]}";
    accessors += comma + R"({"bufferView": )" + n +
                 R"(, "componentType": 5126, "count": 3, "type": "VEC3"})";
    views += comma + R"({"buffer": 0, "byteLength": 36, "byteOffset": )" +
             std::to_string(sizeof triangles[i] * i) + "}";
    bytes.append(reinterpret_cast<const char*>(&triangles[i]), sizeof triangles[i]);
  }
  return R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [)" + ids +
         R"(]}], "nodes": [)" + nodes + R"(], "meshes": [)" + meshes + R"(], "accessors": [)" +
         accessors + R"(], "bufferViews": [)" + views + R"(], "buffers": [{"byteLength": )" +
         std::to_string(bytes.size()) + R"(, "uri": "data:application/octet-stream;base64,)" +
         test::base64(bytes) + "\"}]}";
}

std::string ply_of(const std::string& vertices, const std::string& faces, int count) {
  return "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
         "float z\nelement face " +
         std::to_string(count) + "\nproperty list uchar int vertex_indices\nend_header\n" +
         vertices + faces;
}

// Quads become triangles. Points, lines, normals and texture coordinates are dropped, so that equal
// corners become one vertex.
TEST_F(MeshImport, ReadsTheTrianglesOfAllPartsOfAFile) {
  const std::filesystem::path file =
      write("two.obj",
            "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nvn 1 0 0\nvt 0 0\nvt 1 1\n"
            "o first\nf 1/1/1 2/1/1 3/1/1\nf 1/2/2 3/2/2 4/2/2\np 1\nl 1 2\n"
            "v 5 0 0\nv 6 0 0\nv 6 2 0\nv 5 2 0\no second\nf 5 6 7 8\n");
  const ImportedMesh mesh = import_mesh(file, "obj");
  EXPECT_EQ(mesh.reason, "");
  EXPECT_EQ(mesh.vertices.size(), 8u);
  const Corners corners = corners_of(mesh),
                first{{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}}}, {{{0, 0, 0}, {1, 1, 0}, {0, 1, 0}}}};
  EXPECT_EQ(corners.size(), 4u);
  for (const auto& triangle : first) EXPECT_EQ(corners.count(triangle), 1u);
  float area = 0;  // of the quad, which has two possible diagonals
  for (const auto& [a, b, c] : corners)
    if (a[0] >= 5) area += 0.5f * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
  EXPECT_EQ(area, 2);
}

TEST_F(MeshImport, ReadsEveryFormat) {
  const Corners expected{{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}}};
  const std::string stl =
      "solid one\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 "
      "0\nendloop\nendfacet\nendsolid one\n";
  const std::string ply = ply_of("0 0 0\n1 0 0\n0 1 0\n", "3 0 1 2\n", 1);
  for (const auto& [extension, text] :
       {std::pair<std::string, std::string>{"obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"},
        {"stl", stl},
        {"ply", ply},
        {"gltf", gltf_of({{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}}})}}) {
    const ImportedMesh mesh = import_mesh(write("part." + extension, text), extension);
    EXPECT_EQ(mesh.reason, "") << extension;
    EXPECT_EQ(corners_of(mesh), expected) << extension;
  }
}

TEST_F(MeshImport, TheExtensionMayBeInUpperCase) {
  const std::filesystem::path file = write("PART.Obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_EQ(read_mesh(file, 1).reason, "");
  EXPECT_TRUE(is_gltf("A.GLB"));
  EXPECT_TRUE(is_gltf("a.gltf"));
  EXPECT_FALSE(is_gltf("gltf"));
}

TEST_F(MeshImport, NamesTheVertexThatIsNotFinite) {
  const std::array<Corner, 3> good{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};
  for (std::size_t vertex = 0; vertex < 6; ++vertex)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::vector<std::array<Corner, 3>> triangles{good, good};
      triangles[vertex / 3][vertex % 3][axis] = axis == 1 ? kNan : INFINITY;
      EXPECT_EQ(import_mesh(write("nan.gltf", gltf_of(triangles)), "gltf").reason,
                "vertex " + std::to_string(vertex) + " of the mesh is not finite");
    }
}

TEST_F(MeshImport, RefusesEachFaceThatRefersToNoVertex) {
  const std::string vertices = "0 0 0\n1 0 0\n0 1 0\n";
  EXPECT_EQ(import_mesh(write("good.ply", ply_of(vertices, "3 0 1 2\n3 0 2 1\n", 2)), "ply").reason,
            "");
  for (const std::string faces : {"3 3 1 2\n3 0 1 2\n", "3 0 1 2\n3 0 1 3\n"})
    EXPECT_EQ(import_mesh(write("bad.ply", ply_of(vertices, faces, 2)), "ply").reason,
              "a face of the mesh refers to a vertex that does not exist");
}

TEST_F(MeshImport, AFileWithoutTrianglesIsUnusable) {
  const std::string vertices = "0 0 0\n1 0 0\n0 1 0\n";
  for (const std::filesystem::path& file :
       {write("line.obj", "v 0 0 0\nv 1 0 0\nl 1 2\n"), write("points.obj", "v 0 0 0\nv 1 0 0\n"),
        write("points.ply", ply_of(vertices, "", 0)),
        write("line.ply", ply_of(vertices, "2 0 1\n", 1))})
    EXPECT_TRUE(read_mesh(file, 1).reason.starts_with("cannot read the mesh: ")) << file;
}

// The content of a file does not choose the importer. Assimp would read both.
TEST_F(MeshImport, OnlyTheImportersOfTheExtensionRead) {
  const std::string x_file =
      "xof 0303txt 0032\nMesh m {\n3;\n0;0;0;,\n1;0;0;,\n0;1;0;;\n1;\n3;0,1,2;;\n}\n";
  EXPECT_EQ(import_mesh(write("part.x", x_file), "x").reason, "") << "an importer for it exists";
  const std::string obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  for (const std::string& text : {x_file, obj}) {
    const std::string reason = import_mesh(write("part.ply", text), "ply").reason;
    EXPECT_TRUE(reason.starts_with("cannot read the mesh: ")) << reason;
  }
}

// The second buffer is the same file as the first.
TEST_F(MeshImport, AFileMayNameAnotherOneTwice) {
  const std::array<std::array<Corner, 3>, 2> triangles{
      {{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}}, {{{0, 0, 3}, {1, 0, 3}, {0, 1, 3}}}}};
  std::string gltf = gltf_of({triangles[0], triangles[1]});
  const std::string second_view = R"("buffer": 0, "byteLength": 36, "byteOffset": 36)",
                    two = R"([{"byteLength": 72, "uri": "two.bin"}, )"
                          R"({"byteLength": 72, "uri": "two.bin"}]})";
  ASSERT_NE(gltf.find(second_view), std::string::npos);
  gltf[gltf.find(second_view) + second_view.find('0')] = '1';
  const std::size_t list = gltf.find('[', gltf.find("\"buffers\""));
  write("two.bin", std::string(reinterpret_cast<const char*>(&triangles), sizeof triangles));
  const ImportedMesh mesh = import_mesh(write("part.gltf", gltf.substr(0, list) + two), "gltf");
  EXPECT_EQ(mesh.reason, "");
  EXPECT_EQ(corners_of(mesh), (Corners{triangles[0], triangles[1]}));
}

// Reading a pipe would wait for its writer until the time limit.
TEST_F(MeshImport, RefusesAPipeThatTheFileNames) {
  ASSERT_EQ(mkfifo((folder() / "pipe.bin").c_str(), 0600), 0);
  std::string gltf = gltf_of({{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}}});
  const std::size_t uri = gltf.find("data:"), end = gltf.find('"', uri);
  const std::filesystem::path file = write("part.gltf", gltf.replace(uri, end - uri, "pipe.bin"));
  const std::string reason = import_mesh(file, "gltf").reason;
  EXPECT_TRUE(reason.starts_with("cannot read the mesh: ")) << reason;
}

TEST(MeshBytes, RoundTrip) {
  for (const ImportedMesh& mesh :
       {ImportedMesh{}, ImportedMesh{{}, {}, "why"}, ImportedMesh{{{1, 2, 3}}, {}, ""},
        ImportedMesh{{{1, 2, 3}}, {{0, 0, 0}}, "x"},
        ImportedMesh{{{1, 2, 3}, {4, 5, 6}, {7, 8, 9}}, {{0, 1, 2}, {2, 1, 0}}, ""},
        ImportedMesh{{{1, 2, 3}}, {{0, 0, 0}}, "", MeshMaterials{{{"a", {1, 0, 0}}}, {{1, 0}}}},
        ImportedMesh{{{1, 2, 3}},
                     {{0, 0, 0}},
                     "",
                     MeshMaterials{{{"a", {1, 0, 0}}}, {{1, 0}}},
                     {"part.bin", "folder/part two.mtl"}}}) {
    const auto again = mesh_from(bytes_of(mesh));
    ASSERT_TRUE(again);
    EXPECT_EQ(again->vertices, mesh.vertices);
    EXPECT_EQ(again->triangles, mesh.triangles);
    EXPECT_EQ(again->reason, mesh.reason);
    EXPECT_EQ(again->materials, mesh.materials);
    EXPECT_EQ(again->files, mesh.files);
  }
}

TEST(MeshBytes, BytesOfADamagedChildAreNoMesh) {
  const std::string bytes = bytes_of({{{1, 2, 3}, {4, 5, 6}}, {{0, 1, 0}}, "why", {}, {"a.bin"}});
  ASSERT_TRUE(mesh_from(bytes));
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_FALSE(mesh_from(bytes.substr(0, size))) << size;
  EXPECT_FALSE(mesh_from(
      bytes_of({{{1, 2, 3}}, {{0, 0, 0}}, "", MeshMaterials{{{"a", {1, 0, 0}}}, {{2, 0}}}})));
  EXPECT_FALSE(mesh_from(bytes + 'x'));
  for (std::size_t corner = 0; corner < 3; ++corner) {
    ImportedMesh mesh{{{1, 2, 3}, {4, 5, 6}}, {{0, 1, 0}}, ""};
    mesh.triangles[0][corner] = 2;
    EXPECT_FALSE(mesh_from(bytes_of(mesh))) << corner;
  }
  // Sizes with which the sum of the sizes overflows to that of the bytes.
  const auto with_sizes = [](const std::array<std::uint64_t, 5>& sizes) {
    return std::string(reinterpret_cast<const char*>(&sizes), sizeof sizes);
  };
  EXPECT_TRUE(mesh_from(with_sizes({0, 0, 0, 0, 0})));
  EXPECT_FALSE(mesh_from(with_sizes({std::uint64_t(0) - 12, 1, 0, 0, 0})));
  EXPECT_FALSE(mesh_from(with_sizes({0, std::uint64_t(1) << 62, 0, 0, 0})));
  EXPECT_FALSE(mesh_from(with_sizes({0, 0, std::uint64_t(1) << 62, 0, 0})));
  EXPECT_FALSE(mesh_from(with_sizes({0, 1, 0, std::uint64_t(0) - 12, 0})));
  EXPECT_FALSE(mesh_from(with_sizes({0, 1, 0, 0, std::uint64_t(0) - 12})));
  EXPECT_FALSE(mesh_from(with_sizes({0, 0, 0, 1, 0}) + 'a')) << "a name without its end";
  EXPECT_FALSE(mesh_from(with_sizes({0, 0, 0, 1, 1}) + std::string("a\0", 2)));
  for (const std::size_t vertices : {kMaxMeshElements, kMaxMeshElements + 1})
    EXPECT_EQ(mesh_from(with_sizes({0, vertices, 0, 0, 0}) + std::string(12 * vertices, '\0'))
                  .has_value(),
              vertices == kMaxMeshElements);
}

// Assimp catches the exception of the allocation.
TEST_F(MeshImport, AFileThatAnnouncesTooManyVerticesNeedsTooMuchMemory) {
  const std::filesystem::path file =
      write("vertices.ply",
            "ply\nformat ascii 1.0\nelement vertex 2147483648\nproperty float x\n"
            "property float y\nproperty float z\nelement face 1\n"
            "property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  // A sanitizer's allocator ends the process instead of throwing std::bad_alloc.
  if (test::kHasSanitizer)
    EXPECT_NE(read_mesh(file, 1).reason, "");
  else
    EXPECT_EQ(read_mesh(file, 1).reason,
              "the importer needs too much memory: the file is damaged or too large");
}

TEST_F(MeshImport, AFileOfMoreThan4GiBIsRefused) {
  const std::filesystem::path file = write("large.stl", "");
  std::filesystem::resize_file(file, (std::uintmax_t(4) << 30) + 1);  // sparse
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
