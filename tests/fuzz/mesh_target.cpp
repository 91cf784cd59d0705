// Mesh files of each format that read_mesh() accepts, with the files that they name.
#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "common/config/mesh/mesh_file.h"
#include "common/config/mesh/step_module.h"
#include "tests/fuzz/config_invariants.h"
#include "tests/fuzz/message_bytes.h"
#include "tests/fuzz/mutations.h"
#include "tests/support/base64.h"
#include "tests/support/gltf/image_bytes.h"

namespace fivepipe::fuzz {
namespace {

namespace fs = std::filesystem;

constexpr double kUnit_m = 0.01;
const std::vector<std::string_view> kWords = {"v",
                                              "vn",
                                              "vt",
                                              "f",
                                              "o",
                                              "g",
                                              "s",
                                              "usemtl",
                                              "mtllib",
                                              "l",
                                              "p",
                                              "cstype",
                                              "deg",
                                              "ply",
                                              "format",
                                              "ascii",
                                              "binary_little_endian",
                                              "binary_big_endian",
                                              "element",
                                              "property",
                                              "list",
                                              "uchar",
                                              "char",
                                              "short",
                                              "int",
                                              "float",
                                              "double",
                                              "vertex",
                                              "face",
                                              "tristrips",
                                              "vertex_indices",
                                              "end_header",
                                              "comment",
                                              "solid",
                                              "facet",
                                              "normal",
                                              "outer",
                                              "loop",
                                              "endloop",
                                              "endfacet",
                                              "endsolid",
                                              "null",
                                              "true",
                                              "[]",
                                              "{}",
                                              "{",
                                              "}",
                                              "[",
                                              "]",
                                              ",",
                                              ":",
                                              "\"\"",
                                              "1/1/1",
                                              "1//1",
                                              "-1",
                                              "/",
                                              "#",
                                              "\\",
                                              "\n",
                                              "POSITION",
                                              "NORMAL",
                                              "SCALAR",
                                              "VEC2",
                                              "VEC3",
                                              "VEC4",
                                              "MAT4",
                                              "5120",
                                              "5121",
                                              "5125",
                                              "5126",
                                              "part.bin",
                                              "part.mtl",
                                              "\"data:;base64,AAAA\"",
                                              "\"sparse\"",
                                              "\"extensions\"",
                                              "\"mode\": 6,",
                                              "map_Kd",
                                              "-clamp",
                                              "Kd",
                                              "part.png",
                                              "../part.png",
                                              "TEXCOORD_0",
                                              "\"material\": 0,",
                                              "\"texCoord\": 1,",
                                              "\"sampler\": 0,",
                                              "33071",
                                              "KHR_texture_transform",
                                              "extensionsRequired",
                                              "#11",
                                              "#64",
                                              "$",
                                              "*",
                                              ".F.",
                                              "1.E400",
                                              "ADVANCED_FACE('',(#17),#32,.F.)",
                                              "SPHERICAL_SURFACE('',#11,10.)",
                                              "TOROIDAL_SURFACE('',#11,10.,20.)",
                                              "CIRCLE('',#11,1.)",
                                              "SI_UNIT($,.METRE.)",
                                              "ENDSEC;"};

// Returns a small image whose pixels are missing. Its header is complete, so only render_node,
// which decodes it, refuses it.
std::string image() { return test::png_header(2, 2); }

std::string obj(Random& random, const geometry::Mesh& mesh) {
  std::string text = one_in(random, 2) ? "mtllib part.mtl\no part\nusemtl red\n" : "";
  const bool has_normals = one_in(random, 2);
  for (const auto& v : mesh.vertices_m) text += fmt::format("v {} {} {}\n", v.x(), v.y(), v.z());
  if (has_normals) text += "vn 0 0 1\nvt 0.5 0.5\n";
  for (const auto& t : mesh.triangles)
    text += has_normals ? fmt::format("f {}/1/1 {}//1 {}\n", t[0] + 1, t[1] + 1, t[2] + 1)
                        : fmt::format("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
  if (one_in(random, 3)) text += "f -1 -2 -3 -4\nl 1 2\np 1\n";
  return text;
}

std::string stl(Random& random, const geometry::Mesh& mesh) {
  const bool is_text = one_in(random, 2);
  std::string bytes = is_text ? "solid part\n" : std::string(80, 'x');
  if (!is_text) append_object(bytes, std::uint32_t(mesh.triangles.size()));
  for (const auto& triangle : mesh.triangles) {
    if (is_text)
      bytes += "facet normal 0 0 1\nouter loop\n";
    else
      append_object(bytes, std::array<float, 3>{0, 0, 1});
    for (const std::uint32_t index : triangle) {
      const Eigen::Vector3d& v = mesh.vertices_m[index];
      if (is_text)
        bytes += fmt::format("vertex {} {} {}\n", v.x(), v.y(), v.z());
      else
        append_object(bytes, std::array{float(v.x()), float(v.y()), float(v.z())});
    }
    if (is_text)
      bytes += "endloop\nendfacet\n";
    else
      append_object(bytes, std::uint16_t(0));
  }
  return is_text ? bytes + "endsolid part\n" : bytes;
}

std::string ply(Random& random, const geometry::Mesh& mesh) {
  const bool is_text = one_in(random, 2);
  std::string bytes = fmt::format(
      "ply\nformat {} 1.0\ncomment made up\nelement vertex {}\nproperty float x\nproperty float "
      "y\nproperty float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
      is_text ? "ascii" : "binary_little_endian", mesh.vertices_m.size(), mesh.triangles.size());
  for (const auto& v : mesh.vertices_m)
    if (is_text)
      bytes += fmt::format("{} {} {}\n", v.x(), v.y(), v.z());
    else
      append_object(bytes, std::array{float(v.x()), float(v.y()), float(v.z())});
  for (const auto& t : mesh.triangles) {
    if (is_text) {
      bytes += fmt::format("3 {} {} {}\n", t[0], t[1], t[2]);
    } else {
      bytes += char(3);
      append_object(bytes, t);
    }
  }
  return bytes;
}

// Vertices as floats, then indices as uint32, texture coordinates of the vertices, and an image.
std::string gltf_buffer(const geometry::Mesh& mesh) {
  std::string bytes;
  for (const auto& v : mesh.vertices_m)
    append_object(bytes, std::array{float(v.x()), float(v.y()), float(v.z())});
  for (const auto& t : mesh.triangles) append_object(bytes, t);
  for (const auto& v : mesh.vertices_m)
    append_object(bytes, std::array{float(v.x()), float(v.y())});
  return bytes + image();
}

// Members of a textured glTF file, whose image is in the buffer or beside it.
std::string gltf_materials(bool is_embedded) {
  return fmt::format(
      R"(, "materials": [{{"name": "a", "pbrMetallicRoughness":
   {{"baseColorFactor": [1, 0.5, 0, 1], "baseColorTexture": {{"index": 0, "texCoord": 0}}}}}}],
 "textures": [{{"source": 0, "sampler": 0}}], "samplers": [{{"wrapS": 33071, "wrapT": 33648}}],
 "images": [{{{}}}])",
      is_embedded ? R"("mimeType": "image/png", "bufferView": 3)" : R"("uri": "part.png")");
}

std::string gltf(const geometry::Mesh& mesh, const std::string& buffer_uri, bool is_embedded) {
  const std::size_t vertex_bytes = 12 * mesh.vertices_m.size(),
                    index_bytes = 12 * mesh.triangles.size(), uv_bytes = 8 * mesh.vertices_m.size();
  return fmt::format(
      R"({{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0]}}],
 "nodes": [{{"mesh": 0, "translation": [1, 2, 3], "children": [1]}},
           {{"mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}}],
 "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0, "TEXCOORD_0": 2}},
   "indices": 1, "material": 0, "mode": 4}}]}}],
 "accessors": [{{"bufferView": 0, "componentType": 5126, "count": {}, "type": "VEC3",
                "min": [-1, -1, -1], "max": [1, 1, 1]}},
               {{"bufferView": 1, "componentType": 5125, "count": {}, "type": "SCALAR"}},
               {{"bufferView": 2, "componentType": 5126, "count": {}, "type": "VEC2"}}],
 "bufferViews": [{{"buffer": 0, "byteLength": {}}},
                 {{"buffer": 0, "byteOffset": {}, "byteLength": {}}},
                 {{"buffer": 0, "byteOffset": {}, "byteLength": {}}},
                 {{"buffer": 0, "byteOffset": {}, "byteLength": {}}}],
 "buffers": [{{"byteLength": {}{}}}]{}}})",
      mesh.vertices_m.size(), 3 * mesh.triangles.size(), mesh.vertices_m.size(), vertex_bytes,
      vertex_bytes, index_bytes, vertex_bytes + index_bytes, uv_bytes,
      vertex_bytes + index_bytes + uv_bytes, image().size(),
      vertex_bytes + index_bytes + uv_bytes + image().size(),
      buffer_uri.empty() ? "" : ", \"uri\": \"" + buffer_uri + '"', gltf_materials(is_embedded));
}

std::string glb(std::string json, std::string buffer) {
  json.resize((json.size() + 3) / 4 * 4, ' ');
  std::string bytes = "glTF";
  append_object(bytes, std::array{2u, std::uint32_t(12 + 8 + json.size() + 8 + buffer.size())});
  append_object(bytes, std::array{std::uint32_t(json.size()), 0x4E4F534Au});
  bytes += json;
  append_object(bytes, std::array{std::uint32_t(buffer.size()), 0x004E4942u});
  return bytes + buffer;
}

std::string step(Random& random) {
  const char* const name = one_in(random, 2) ? "plate_with_hole.step" : "assembly.step";
  std::ifstream in(fs::path(FIVEPIPE_SOURCE_DIR "/tests/config/step") / name);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::vector<File> valid_files(Random& random) {
  const geometry::Mesh mesh = one_in(random, 2)
                                  ? geometry::box_mesh({1, 0.5, 0.25}, one_in(random, 2) ? 0.2 : 0)
                                  : geometry::sphere_mesh(1, int(below(random, 3)));
  const std::string buffer = gltf_buffer(mesh);
  switch (below(random, base::exists(config::kStepModule) ? 7 : 6)) {
    case 0:
      return {{"part.obj", obj(random, mesh)},
              {"part.mtl", "newmtl red\nKd 1 0 0\nmap_Kd -clamp on part.png\n"},
              {"part.png", image()}};
    case 1: return {{"part.stl", stl(random, mesh)}};
    case 2: return {{"part.ply", ply(random, mesh)}};
    case 3:
      return {{"part.gltf",
               gltf(mesh, "data:application/octet-stream;base64," + test::base64(buffer), true)}};
    case 4:
      return {{"part.gltf", gltf(mesh, "part.bin", false)},
              {"part.bin", buffer},
              {"part.png", image()}};
    case 5: return {{"part.glb", glb(gltf(mesh, "", true), buffer)}};
    default: return {{"part.step", step(random)}};
  }
}

std::vector<File> input(Random& random) {
  std::vector<File> files = valid_files(random);
  for (std::size_t mutations = below(random, 5); mutations > 0; --mutations) {
    std::string& bytes = files[one_in(random, 5) ? below(random, files.size()) : 0].bytes;
    if (one_in(random, 2))
      mutate_word(random, bytes, kWords);
    else
      mutate_bytes(random, bytes);
  }
  return files;
}

std::string broken_materials(const config::MeshMaterials& materials, const geometry::Mesh& mesh) {
  std::size_t triangles = 0;
  for (const config::MaterialRun& run : materials.runs) {
    triangles += run.triangles;
    if (run.material == config::kNoMaterial) continue;
    if (run.material >= materials.materials.size()) return "a run without its material";
    if (materials.materials[run.material].texture && materials.corners_uv.empty())
      return "a texture without coordinates";
  }
  if (!materials.runs.empty() && triangles != mesh.triangles.size())
    return "runs of other triangles";
  if (!materials.corners_uv.empty() && materials.corners_uv.size() != 3 * mesh.triangles.size())
    return "texture coordinates of other corners";
  for (const auto& [u, v] : materials.corners_uv)
    if (!std::isfinite(u) || !std::isfinite(v)) return "a texture coordinate that is not finite";
  return "";
}

Verdict check(const fs::path& folder) {
  for (const char* name :
       {"part.obj", "part.stl", "part.ply", "part.gltf", "part.glb", "part.step"}) {
    if (!fs::exists(folder / name)) continue;
    const auto unit_m = config::has_unit(name) ? std::nullopt : std::optional(kUnit_m);
    const config::MeshOrReason mesh =
        config::read_mesh(folder / name, unit_m, config::Materials::with);
    if (!mesh.reason.empty()) return {};
    if (mesh.materials)
      if (std::string broken = broken_materials(*mesh.materials, mesh.mesh); !broken.empty())
        return {true, broken};
    return {true, broken_invariant(mesh.mesh)};
  }
  throw std::runtime_error("no mesh file");
}

}  // namespace

Target mesh_target() { return {"mesh", "mesh files of every format", input, check}; }

}  // namespace fivepipe::fuzz
