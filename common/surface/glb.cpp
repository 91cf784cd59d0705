#include "common/surface/glb.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/surface/byte_buffer.h"

namespace fivepipe::surface {
namespace {

using Eigen::Vector3d;
using nlohmann::ordered_json;

// Constants of the specification.
constexpr int kFloat = 5126, kUint32 = 5125, kUint16 = 5123;
constexpr int kArrayBuffer = 34962, kElementArrayBuffer = 34963;
constexpr int kModePoints = 0, kModeTriangles = 4;
constexpr std::uint32_t kMagic = 0x46546C67, kVersion = 2, kJsonChunk = 0x4E4F534A,
                        kBinaryChunk = 0x004E4942;

Vector3d y_up(const Vector3d& v) { return {v.x(), v.z(), -v.y()}; }

// IEC 61966-2-1.
std::uint16_t linear16(std::uint8_t srgb) {
  const double s = srgb / 255.0,
               linear = s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
  return std::uint16_t(std::lround(65535 * linear));
}

// The views and accessors of one buffer.
class Builder {
 public:
  ordered_json views = ordered_json::array(), accessors = ordered_json::array();
  ByteBuffer bytes;

  // Describes the bytes that were added since `begin`. Returns the number of the accessor.
  int add(std::size_t begin, int target, std::size_t count, int component_type, const char* type) {
    views.push_back({{"buffer", 0},
                     {"byteOffset", begin},
                     {"byteLength", bytes.size() - begin},
                     {"target", target}});
    accessors.push_back({{"bufferView", views.size() - 1},
                         {"componentType", component_type},
                         {"count", count},
                         {"type", type}});
    return int(accessors.size()) - 1;
  }

  int add_vectors(const std::vector<Vector3d>& vectors) {
    const std::size_t begin = bytes.size();
    for (const Vector3d& v : vectors) bytes.add_floats(y_up(v));
    return add(begin, kArrayBuffer, vectors.size(), kFloat, "VEC3");
  }
};

ordered_json primitive_of(const MeshFile& content, Builder& builder) {
  const geometry::Mesh& mesh = content.mesh;
  ordered_json attributes{{"POSITION", builder.add_vectors(mesh.vertices_m)}};
  Eigen::Array3f low = Eigen::Array3f::Constant(INFINITY), high = -low;
  for (const Vector3d& p : mesh.vertices_m) {
    low = low.min(y_up(p).cast<float>().array());
    high = high.max(y_up(p).cast<float>().array());
  }
  builder.accessors.back()["min"] = {low[0], low[1], low[2]};
  builder.accessors.back()["max"] = {high[0], high[1], high[2]};
  if (!mesh.triangles.empty())
    attributes["NORMAL"] = builder.add_vectors(vertex_normals(mesh, content.normal_steps));
  if (!content.colours.empty()) {
    const std::size_t begin = builder.bytes.size();
    for (const Rgb& colour : content.colours) {
      for (const std::uint8_t value : colour) builder.bytes.add(linear16(value));
      builder.bytes.add(std::uint16_t{65535});  // opaque; also aligns the vertex to 4 bytes
    }
    attributes["COLOR_0"] =
        builder.add(begin, kArrayBuffer, content.colours.size(), kUint16, "VEC4");
    builder.accessors.back()["normalized"] = true;
  }
  ordered_json primitive{{"attributes", attributes}, {"material", 0}};
  if (mesh.triangles.empty()) {
    primitive["mode"] = kModePoints;
    return primitive;
  }
  const std::size_t begin = builder.bytes.size();
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t vertex : triangle) builder.bytes.add(vertex);
  primitive["indices"] =
      builder.add(begin, kElementArrayBuffer, 3 * mesh.triangles.size(), kUint32, "SCALAR");
  primitive["mode"] = kModeTriangles;
  return primitive;
}

void add_chunk(ByteBuffer& file, std::uint32_t type, std::string content, char padding) {
  content.resize((content.size() + 3) / 4 * 4, padding);
  file.add(std::uint32_t(content.size()));
  file.add(type);
  file.add_text(content);
}

}  // namespace

std::string glb_of(const MeshFile& content) {
  ordered_json json{{"asset", {{"version", "2.0"}, {"generator", "fivepipe"}}},
                    {"scene", 0},
                    {"scenes", {{{"name", "fivepipe"}}}}};
  ByteBuffer chunks;
  std::string binary;
  if (!content.mesh.vertices_m.empty()) {
    Builder builder;
    const ordered_json primitive = primitive_of(content, builder);
    binary = std::move(builder.bytes).text();
    json["scenes"][0]["nodes"] = {0};
    json["nodes"] = {{{"mesh", 0}}};
    json["meshes"] = {{{"primitives", {primitive}}}};
    json["materials"] = {
        {{"pbrMetallicRoughness",
          {{"baseColorFactor", {1, 1, 1, 1}}, {"metallicFactor", 0}, {"roughnessFactor", 0.9}}}}};
    json["buffers"] = {{{"byteLength", binary.size()}}};
    json["bufferViews"] = builder.views;
    json["accessors"] = builder.accessors;
  }
  add_chunk(chunks, kJsonChunk, json.dump(), ' ');
  if (!binary.empty()) add_chunk(chunks, kBinaryChunk, std::move(binary), '\0');
  const std::string body = std::move(chunks).text();
  ByteBuffer file;
  for (const std::uint32_t word : {kMagic, kVersion, std::uint32_t(12 + body.size())})
    file.add(word);
  return std::move(file).text() + body;
}

}  // namespace fivepipe::surface
