// Writes GLB files (glTF 2.0, section 4) of a few triangles with materials and images.
#pragma once
#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace fivepipe::test {

// Triangles with one material: three corners each.
struct GlbPart {
  std::vector<std::array<float, 3>> corners;  // x right, y up, z towards the viewer
  std::vector<std::array<float, 2>> uv = {};  // by corner; empty: none
  int material = -1;                          // -1: none
};

struct GlbContent {
  std::vector<GlbPart> parts = {};
  std::vector<std::string> images = {};  // bytes of image files, which become "images"
  // Further members, such as R"("materials": [], "textures": [])".
  std::string members = {};
};

// Returns a rectangle of two triangles in the plane z = 0, with its corners at (+-width / 2,
// +-height / 2). Its texture coordinates are (0, 0) at the top left, (1, 1) at the bottom right.
inline GlbPart glb_rectangle(float width, float height, int material) {
  const float x = width / 2, y = height / 2;
  return {{{-x, y, 0}, {-x, -y, 0}, {x, -y, 0}, {-x, y, 0}, {x, -y, 0}, {x, y, 0}},
          {{0, 0}, {0, 1}, {1, 1}, {0, 0}, {1, 1}, {1, 0}},
          material};
}

namespace glb_detail {

template <typename T>
std::string bytes_of_values(const std::vector<T>& values) {
  std::string bytes(sizeof(T) * values.size(), '\0');
  if (!values.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

inline void append_item(std::string& list, const std::string& item) {
  list += (list.empty() ? "" : ", ") + item;
}

// The buffer, and the lists that describe it.
struct Buffer {
  std::string bytes, views, accessors;
  int view_count = 0, accessor_count = 0;

  int add_view(const std::string& content) {
    append_item(views, fmt::format(R"({{"buffer": 0, "byteOffset": {}, "byteLength": {}}})",
                                   bytes.size(), content.size()));
    bytes += content;
    bytes.resize((bytes.size() + 3) / 4 * 4);
    return view_count++;
  }
  int add_accessor(const std::string& content, std::size_t count, const char* type) {
    append_item(
        accessors,
        fmt::format(R"({{"bufferView": {}, "componentType": 5126, "count": {}, "type": "{}"}})",
                    add_view(content), count, type));
    return accessor_count++;
  }
};

inline std::string chunk(std::string content, const char* type, char padding) {
  content.resize((content.size() + 3) / 4 * 4, padding);
  const std::vector<std::uint32_t> size{std::uint32_t(content.size())};
  return bytes_of_values(size) + std::string(type, 4) + content;
}

}  // namespace glb_detail

inline std::string glb_of(const GlbContent& content) {
  glb_detail::Buffer buffer;
  std::string primitives, images;
  for (const GlbPart& part : content.parts) {
    std::string attributes = fmt::format(
        R"("POSITION": {})", buffer.add_accessor(glb_detail::bytes_of_values(part.corners),
                                                 part.corners.size(), "VEC3"));
    if (!part.uv.empty())
      attributes += fmt::format(
          R"(, "TEXCOORD_0": {})",
          buffer.add_accessor(glb_detail::bytes_of_values(part.uv), part.uv.size(), "VEC2"));
    glb_detail::append_item(
        primitives,
        fmt::format(R"({{"attributes": {{{}}}{}}})", attributes,
                    part.material < 0 ? "" : fmt::format(R"(, "material": {})", part.material)));
  }
  for (const std::string& image : content.images)
    glb_detail::append_item(images, fmt::format(R"({{"mimeType": "image/png", "bufferView": {}}})",
                                                buffer.add_view(image)));
  const std::string json = fmt::format(
      R"({{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0]}}],
 "nodes": [{{"mesh": 0}}], "meshes": [{{"primitives": [{}]}}], "accessors": [{}],
 "bufferViews": [{}], "buffers": [{{"byteLength": {}}}]{}{}}})",
      primitives, buffer.accessors, buffer.views, buffer.bytes.size(),
      images.empty() ? "" : ", \"images\": [" + images + "]",
      content.members.empty() ? "" : ", " + content.members);
  const std::string chunks =
      glb_detail::chunk(json, "JSON", ' ') + glb_detail::chunk(buffer.bytes, "BIN\0", '\0');
  const std::vector<std::uint32_t> header{2, std::uint32_t(12 + chunks.size())};
  return "glTF" + glb_detail::bytes_of_values(header) + chunks;
}

// Members of a file whose material 0, 'board', has image 0 as its texture, and whose material 1,
// 'red', has a colour alone.
inline const std::string kBoardAndRed = R"("materials": [
 {"name": "board", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}},
 {"name": "red", "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 0.125, 1]}}],
 "textures": [{"source": 0}])";

}  // namespace fivepipe::test
