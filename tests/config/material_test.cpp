// Materials of mesh files and scenes; tests/render/texture_test.cpp draws them.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/config/mesh/gltf_check.h"
#include "common/config/mesh/image_header.h"
#include "common/config/mesh/material_bytes.h"
#include "common/config/mesh/mesh_file.h"
#include "tests/support/base64.h"
#include "tests/support/gltf/glb_file.h"
#include "tests/support/gltf/image_bytes.h"
#include "tests/support/scene_files.h"

namespace fivepipe::config {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// The checks of the configuration read only the header.
const std::string kImage = test::png_header(2, 2);

test::GlbContent board_and_red() {
  test::GlbContent content{
      {test::glb_rectangle(1, 1, 0), test::glb_rectangle(2, 2, 1)}, {kImage}, test::kBoardAndRed};
  for (auto& [x, y, z] : content.parts[1].corners) z = -1;
  return content;
}

class MeshMaterial : public test::SceneFiles {
 protected:
  std::shared_ptr<const MeshMaterials> materials_of(const std::filesystem::path& file) {
    const MeshOrReason mesh = read_mesh(file, 1, Materials::with);
    EXPECT_EQ(mesh.reason, "");
    return mesh.materials;
  }
  std::string reason_of(const test::GlbContent& content) {
    return read_mesh(write("part.glb", test::glb_of(content)), 1, Materials::with).reason;
  }
  std::string reason_of_obj(const std::string& mtl) {
    write("part.mtl", mtl);
    return read_mesh(write("part.obj",
                           "mtllib part.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 "
                           "1\nusemtl wood\nf 1/1 2/2 3/3\n"),
                     1, Materials::with)
        .reason;
  }
  static std::string part_scene(const std::string& file, const std::string& keys = "") {
    return "name: m\nobjects:\n  - name: part\n    position_m: [0, 0, 0]\n    mesh: {file: " +
           file + "}\n" + keys;
  }
};

TEST_F(MeshMaterial, OfAGlbHaveColoursTexturesAndCoordinatesByTriangle) {
  const auto materials = materials_of(write("part.glb", test::glb_of(board_and_red())));
  ASSERT_TRUE(materials);
  ASSERT_EQ(materials->materials.size(), 2u);
  const Material &board = materials->materials[0], &red = materials->materials[1];
  EXPECT_EQ(board.name, "board");
  EXPECT_EQ(board.base_rgb, (std::array<float, 3>{1, 1, 1}));
  ASSERT_TRUE(board.texture);
  EXPECT_EQ(*board.texture, (MaterialTexture{folder() / "part.glb", 0}));
  EXPECT_EQ(name_of(*board.texture), "image 0 in part.glb");
  EXPECT_EQ(red.name, "red");
  EXPECT_EQ(red.base_rgb, (std::array<float, 3>{0.5f, 0.25f, 0.125f}));
  EXPECT_FALSE(red.texture);
  EXPECT_THAT(materials->runs, ElementsAre(MaterialRun{2, 0}, MaterialRun{2, 1}));
  EXPECT_TRUE(materials->notes.empty());
  // By corner, as in the file: (0, 0) is the top left corner of the image.
  ASSERT_EQ(materials->corners_uv.size(), 12u);
  const MeshOrReason mesh = read_mesh(folder() / "part.glb", 1, Materials::with);
  for (std::size_t t = 0; t < 2; ++t)
    for (std::size_t c = 0; c < 3; ++c) {
      // glTF's y is z here.
      const Eigen::Vector3d& p = mesh.mesh.vertices_m[mesh.mesh.triangles[t][c]];
      EXPECT_NEAR(materials->corners_uv[3 * t + c][0], 0.5 + p.x(), 1e-6);
      EXPECT_NEAR(materials->corners_uv[3 * t + c][1], 0.5 - p.z(), 1e-6);
    }
}

// sim_node and render_node must have the same vertices and triangles.
TEST_F(MeshMaterial, DoNotChangeTheMesh) {
  test::GlbContent content = board_and_red();
  content.parts.push_back(test::glb_rectangle(3, 1, 0));
  content.parts.push_back(test::glb_rectangle(1, 3, -1));
  content.parts.push_back(test::glb_rectangle(1, 2, 1));
  content.parts.back().uv.clear();
  write("part.glb", test::glb_of(content));
  const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 2 0 1\nv 0 2 1\n",
                    faces =
                        "vt 0 0\nvt 1 0\nvt 0 1\nusemtl a\nf 1/1 2/2 3/3\nusemtl b\nf 2/3 4/1 "
                        "3/2\np 1\nusemtl a\nf 5/2 6/3 7/1\nf 1 2 5\n";
  write("part.mtl", "newmtl a\nKd 1 0 0\nnewmtl b\nKd 0 1 0\nmap_Kd part.png\n");
  write("part.png", kImage);
  write("part.obj", "mtllib part.mtl\n" + vertices + faces);
  for (const std::string name : {"part.glb", "part.obj"}) {
    const MeshOrReason plain = read_mesh(folder() / name, 1),
                       with = read_mesh(folder() / name, 1, Materials::with);
    EXPECT_EQ(plain.reason, "") << name;
    EXPECT_EQ(with.reason, "") << name;
    EXPECT_FALSE(plain.materials) << name;
    ASSERT_TRUE(with.materials) << name;
    EXPECT_EQ(plain.mesh.vertices_m, with.mesh.vertices_m) << name;
    EXPECT_EQ(plain.mesh.triangles, with.mesh.triangles) << name;
    EXPECT_EQ(with.materials->corners_uv.size(), 3 * with.mesh.triangles.size()) << name;
  }
}

TEST_F(MeshMaterial, OfAnObjFileHaveTheDiffuseColourAndItsMap) {
  write("part.mtl",
        "newmtl wood\nKd 0.5 0.5 1\nmap_Kd tex\\wood.png\nnewmtl unused\nmap_Kd no.png\n");
  std::filesystem::create_directory(folder() / "tex");
  write("tex/wood.png", kImage);
  const auto materials = materials_of(
      write("part.obj",
            "mtllib part.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 0.75\nusemtl "
            "wood\nf 1/1 2/2 3/3\n"));
  ASSERT_TRUE(materials);
  ASSERT_EQ(materials->materials.size(), 1u);
  const Material& wood = materials->materials[0];
  // sRGB 0.5 is 0.2140 linear.
  EXPECT_NEAR(wood.base_rgb[0], 0.2140, 1e-4);
  EXPECT_EQ(wood.base_rgb[2], 1);
  ASSERT_TRUE(wood.texture);
  EXPECT_EQ(*wood.texture, (MaterialTexture{folder() / "tex/wood.png", -1}));
  EXPECT_THAT(materials->corners_uv,
              ElementsAre(std::array<float, 2>{0, 1}, std::array<float, 2>{1, 1},
                          std::array<float, 2>{0, 0.25f}));
}

TEST_F(MeshMaterial, AbsentOnesAreNone) {
  EXPECT_FALSE(materials_of(write("part.glb", test::glb_of({{test::glb_rectangle(1, 1, -1)}}))));
  EXPECT_FALSE(materials_of(write("part.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")));
}

// As in a file that was copied without its material file.
TEST_F(MeshMaterial, AMissingMaterialFileIsReported) {
  const auto materials = materials_of(
      write("part.obj", "mtllib no.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl wood\nf 1 2 3\n"));
  ASSERT_TRUE(materials);
  EXPECT_TRUE(materials->runs.empty());
  ASSERT_FALSE(materials->notes.empty());
  EXPECT_THAT(materials->notes, ::testing::ElementsAre(HasSubstr("no.mtl cannot be read")));
}

TEST_F(MeshMaterial, TransparencyIsReported) {
  test::GlbContent content = board_and_red();
  content.members.replace(content.members.find("\"name\": \"red\""), 0,
                          "\"alphaMode\": \"BLEND\", ");
  EXPECT_THAT(materials_of(write("part.glb", test::glb_of(content)))->notes,
              ElementsAre("material 'red' is transparent in the file; it is drawn opaque"));
  const Scene scene = test::load_scene(write("scene.yaml", part_scene("part.glb")));
  EXPECT_THAT(material_warnings(scene),
              ElementsAre("object part, mesh " + (folder() / "part.glb").string() +
                          ": material 'red' is transparent in the file; it is drawn opaque"));
}

TEST_F(MeshMaterial, SamplersStateTheWrapMode) {
  test::GlbContent content = board_and_red();
  const auto wraps_with = [&](const std::string& sampler) {
    content.members = test::kBoardAndRed + ", \"samplers\": [" + sampler + "]";
    const std::string source = "{\"source\": 0";
    content.members.insert(content.members.find(source) + source.size(), ", \"sampler\": 0");
    const auto materials = materials_of(write("part.glb", test::glb_of(content)));
    return std::pair(materials->materials[0].texture->wrap_u,
                     materials->materials[0].texture->wrap_v);
  };
  EXPECT_EQ(wraps_with("{}"), std::pair(Wrap::repeat, Wrap::repeat));
  EXPECT_EQ(wraps_with(R"({"wrapS": 33071, "wrapT": 33648})"),
            std::pair(Wrap::clamp, Wrap::mirror));
  EXPECT_EQ(wraps_with(R"({"wrapS": 33648, "wrapT": 10497})"),
            std::pair(Wrap::mirror, Wrap::repeat));
}

TEST_F(MeshMaterial, BadTexturesAreProblemsOfTheScene) {
  const auto problem_with_image = [&](const std::string& image) {
    test::GlbContent content = board_and_red();
    content.images.clear();
    content.members += ", \"images\": [" + image + "]";
    write("part.glb", test::glb_of(content));
    const auto problems =
        problems_of([&] { test::load_scene(write("scene.yaml", part_scene("part.glb"))); });
    return problems.size() == 1 ? problems[0] : std::to_string(problems.size()) + " problems";
  };
  const std::string start =
      "scene.yaml:5:18: mesh " + (folder() / "part.glb").string() + ": material 'board': texture ";
  EXPECT_EQ(problem_with_image(R"({"uri": "wood%20oak.png"})"),
            start + "wood%20oak.png: there is no such file");
  write("wood oak.png", kImage);
  EXPECT_EQ(problem_with_image(R"({"uri": "wood%20oak.png"})"), "0 problems");
  EXPECT_EQ(problem_with_image(R"({"uri": "../wood.png"})"),
            start + "../wood.png: the file is outside the folder of the mesh file: move it there");
  EXPECT_EQ(problem_with_image(R"({"uri": "/etc/passwd"})"),
            start + "/etc/passwd: the file is outside the folder of the mesh file: move it there");
  write("text.png", "this is no image");
  EXPECT_EQ(problem_with_image(R"({"uri": "text.png"})"),
            start + "text.png: it is neither a PNG nor a JPEG image");
  write("huge.png", test::png_header(16385, 1));
  EXPECT_EQ(problem_with_image(R"({"uri": "huge.png"})"),
            start + "huge.png: it has 16385x1 pixels, the limit is 16384x16384");
  write("short.png", kImage.substr(0, 20));
  EXPECT_EQ(problem_with_image(R"({"uri": "short.png"})"),
            start + "short.png: the image is damaged: its header states no size");
  std::filesystem::resize_file(write("large.png", kImage), kMaxImageBytes + 1);  // sparse
  EXPECT_EQ(problem_with_image(R"({"uri": "large.png"})"),
            start + "large.png: the image file is larger than 256 MiB");
  EXPECT_EQ(problem_with_image(R"({"uri": "data:image/png;base64,)" + test::base64("text") + "\"}"),
            start + "image 0 in part.glb: it is neither a PNG nor a JPEG image");
}

TEST_F(MeshMaterial, ColourOfTheObjectReplacesThem) {
  test::GlbContent content = board_and_red();
  content.images = {"no image"};
  write("part.glb", test::glb_of(content));
  const Scene scene = test::load_scene(
      write("scene.yaml", part_scene("part.glb", "    colour_rgb: [1, 0.5, 0.25]\n")));
  EXPECT_FALSE(std::get<MeshShape>(scene.objects[0].shape).materials);
}

TEST_F(MeshMaterial, BadTextureCoordinatesAreAReason) {
  test::GlbContent content = board_and_red();
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(),
                          std::numeric_limits<float>::infinity(), 1.1e6f, -1.1e6f, 1000000.5f})
    for (const std::size_t axis : {0, 1}) {
      content = board_and_red();
      content.parts[0].uv[4][axis] = bad;
      EXPECT_EQ(reason_of(content),
                "material 'board': a texture coordinate is not finite, or beyond 1e6");
    }
  content.parts[0].uv.clear();
  EXPECT_EQ(reason_of(content),
            "material 'board': it has a texture, but a part of the mesh with it has no texture "
            "coordinates");
  content = board_and_red();
  content.parts[1].uv[0][0] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(reason_of(content), "") << "material 'red' needs none";
}

TEST_F(MeshMaterial, UnsupportedExtensionsAreAReason) {
  test::GlbContent content = board_and_red();
  content.members += R"(, "extensionsRequired": ["KHR_materials_unlit"])";
  EXPECT_EQ(reason_of(content), "");
  content.members = test::kBoardAndRed + R"(, "extensionsRequired": ["EXT_meshopt_compression"])";
  EXPECT_EQ(reason_of(content),
            "the file requires the extension EXT_meshopt_compression, which fivepipe does not "
            "support: export it without");
  const auto with = [&](const std::string& from, const std::string& to) {
    content.members = test::kBoardAndRed;
    content.members.replace(content.members.find(from), from.size(), to);
    return reason_of(content);
  };
  EXPECT_THAT(with(R"({"index": 0})",
                   R"({"index": 0, "extensions": {"KHR_texture_transform": {"scale": [2, 2]}}})"),
              HasSubstr("material 'board': its base colour texture has a KHR_texture_transform"));
  EXPECT_EQ(with(R"({"source": 0})", R"({"extensions": {"KHR_texture_basisu": {"source": 0}}})"),
            "material 'board': its base colour texture has no PNG or JPEG image (it has the "
            "extension KHR_texture_basisu)");
  EXPECT_EQ(with(R"({"index": 0})", R"({"index": 7})"),
            "material 'board': its base colour texture is not in the file");
  EXPECT_EQ(with("[0.5, 0.25", "[1.5, 0.25"),
            "material 'red': its base colour is not between 0 and 1");
  // A material that no mesh uses is not drawn.
  EXPECT_EQ(with("[0.5, 0.25, 0.125, 1]}}]",
                 R"([0.5, 0.25, 0.125, 1]}},
 {"pbrMetallicRoughness": {"baseColorTexture": {"index": 7}}}])"),
            "");
}

TEST_F(MeshMaterial, BadMapsOfObjFilesAreAReason) {
  EXPECT_EQ(reason_of_obj("newmtl wood\nmap_Kd wood.png\n"),
            "material 'wood': texture wood.png: there is no such file");
  EXPECT_EQ(reason_of_obj("newmtl wood\nmap_Kd ..\\wood.png\n"),
            "material 'wood': texture ..\\wood.png: the file is outside the folder of the mesh "
            "file: move it there");
  EXPECT_EQ(reason_of_obj("newmtl wood\nKd 0 0 2\n"),
            "material 'wood': its base colour is not between 0 and 1");
}

TEST(MaterialBytes, RoundTrip) {
  const MeshMaterials materials{
      {{"a", {0, 0.5f, 1}, MaterialTexture{"b.png", -1, Wrap::clamp, Wrap::mirror}},
       {"", {1, 1, 1}}},
      {{1, 1}, {1, 0}, {1, kNoMaterial}},
      std::vector<std::array<float, 2>>(9, {0.25f, -3}),
      {"note", ""}};
  const std::string bytes = bytes_of(materials);
  ASSERT_TRUE(materials_from(bytes, 3));
  EXPECT_EQ(*materials_from(bytes, 3), materials);
  EXPECT_EQ(*materials_from(bytes_of(MeshMaterials{}), 3), MeshMaterials{});
}

TEST(MaterialBytes, BytesOfADamagedChildAreNone) {
  const MeshMaterials good{{{"a", {0, 0.5f, 1}, MaterialTexture{"b.png", -1}}},
                           {{1, 0}},
                           std::vector<std::array<float, 2>>(3, {0, 0}),
                           {"note"}};
  const std::string bytes = bytes_of(good);
  ASSERT_TRUE(materials_from(bytes, 1));
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_FALSE(materials_from(bytes.substr(0, size), 1)) << size;
  EXPECT_FALSE(materials_from(bytes + 'x', 1));
  EXPECT_FALSE(materials_from(bytes, 2));
  const auto refused = [&](auto change) {
    MeshMaterials bad = good;
    change(bad);
    return !materials_from(bytes_of(bad), 1);
  };
  EXPECT_TRUE(refused([](MeshMaterials& m) { m.runs[0].material = 1; }));
  EXPECT_TRUE(refused([](MeshMaterials& m) { m.runs[0].triangles = 2; }));
  EXPECT_TRUE(refused([](MeshMaterials& m) { m.corners_uv.clear(); }));
  EXPECT_TRUE(refused([](MeshMaterials& m) { m.corners_uv.pop_back(); }));
  EXPECT_TRUE(refused([](MeshMaterials& m) { m.corners_uv[1][1] = NAN; }));
  EXPECT_TRUE(refused([](MeshMaterials& m) { m.materials[0].base_rgb[2] = NAN; }));
  EXPECT_TRUE(refused([](MeshMaterials& m) { m.materials[0].base_rgb[2] = 1.5f; }));
  EXPECT_TRUE(refused([](MeshMaterials& m) { m.materials[0].texture->embedded = -2; }));
  EXPECT_TRUE(refused([](MeshMaterials& m) { m.materials[0].texture->wrap_v = Wrap(3); }));
}

// Segments: JFIF, a Huffman table, and a frame header of 320x200.
TEST(ImageHeader, OfAJpegFileIsFoundBehindOtherSegments) {
  using namespace std::string_literals;
  const std::string start = "\xff\xd8\xff\xe0\0\x04xx\xff\xc4\0\x03x"s,
                    frame = "\xff\xff\xc0\0\x11\x08\0\xc8\x01\x40\x03xxxxxxxxx"s,
                    scan = "\xff\xda\0\x02xxxx"s, end = "\xff\xd9"s;
  const auto size = image_size(start + frame);
  ASSERT_TRUE(size);
  EXPECT_EQ(size->width_px, 320u);
  EXPECT_EQ(size->height_px, 200u);
  EXPECT_FALSE(image_size(start));
  EXPECT_EQ(why_no_texture(start, false), std::nullopt);
  EXPECT_NE(why_no_texture(start, true), std::nullopt);
  EXPECT_EQ(why_no_texture(start + frame + scan + end, true), std::nullopt);
  EXPECT_EQ(why_no_texture(start + frame + scan, true), "the image is damaged: its end is missing");
  for (std::size_t bytes = 0; bytes < start.size() + 10; ++bytes)
    EXPECT_FALSE(image_size((start + frame).substr(0, bytes))) << bytes;
}

}  // namespace
}  // namespace fivepipe::config
