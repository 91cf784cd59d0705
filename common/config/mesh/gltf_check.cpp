#include "common/config/mesh/gltf_check.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

namespace fivepipe::config {

namespace {

using nlohmann::json;

// glTF 2.0, section 4.4: the header and the first chunk's header, in 32-bit little-endian numbers.
struct GlbStart {
  std::uint32_t magic, version, file_bytes, json_bytes, chunk_type;
};

// Returns a member of an object, or null.
const json& member(const json& of, const char* key) {
  static const json null;
  const auto found = of.is_object() ? of.find(key) : of.end();
  return of.is_object() && found != of.end() ? *found : null;
}
// Returns an element of an array, or null.
const json& element(const json& of, const json& index) {
  static const json null;
  return of.is_array() && index.is_number_unsigned() && index.get<std::size_t>() < of.size()
             ? of[index.get<std::size_t>()]
             : null;
}
std::string text(const json& value) { return value.is_string() ? value.get<std::string>() : ""; }

// The importer decodes Draco's compression. Materials have a base colour without their extensions.
bool is_supported(const std::string& extension) {
  constexpr std::array kSupported = {"KHR_draco_mesh_compression", "KHR_lights_punctual",
                                     "KHR_texture_transform"};  // refused at the textures
  return extension.starts_with("KHR_materials_") || std::ranges::count(kSupported, extension) > 0;
}

std::string names_of(const json& extensions) {
  std::string names;
  if (extensions.is_object())
    for (const auto& [name, value] : extensions.items())
      names += (names.empty() ? "" : ", ") + name;
  return names.empty() ? "" : " (it has the extension " + names + ')';
}

std::optional<std::string> why_unsupported_texture(const json& file, const json& material) {
  const json& use = member(member(material, "pbrMetallicRoughness"), "baseColorTexture");
  if (!use.is_object()) return std::nullopt;
  const std::string name = "material '" + text(member(material, "name")) + "': ";
  if (!member(member(use, "extensions"), "KHR_texture_transform").is_null())
    return name +
           "its base colour texture has a KHR_texture_transform, which fivepipe does not support: "
           "export the transformed texture coordinates";
  const json& texture = element(member(file, "textures"), member(use, "index"));
  if (texture.is_null()) return name + "its base colour texture is not in the file";
  const json& image = element(member(file, "images"), member(texture, "source"));
  if (image.is_null())
    return name + "its base colour texture has no PNG or JPEG image" +
           names_of(member(texture, "extensions"));
  return std::nullopt;
}

}  // namespace

std::string gltf_json(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::error_code error;
  std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error) return "";
  GlbStart start{};
  if (size >= sizeof start && in.read(reinterpret_cast<char*>(&start), sizeof start) &&
      std::memcmp(&start.magic, "glTF", 4) == 0)
    size = std::min<std::uintmax_t>(start.json_bytes, size - sizeof start);
  else
    in.seekg(0);
  std::string json_text(size, '\0');
  in.read(json_text.data(), std::streamsize(size));
  return in ? json_text : "";
}

std::optional<std::string> why_unsupported(const std::string& json_text, bool with_materials) {
  const json file = json::parse(json_text, nullptr, false);
  for (const json& extension : member(file, "extensionsRequired"))
    if (!is_supported(text(extension)))
      return "the file requires the extension " + text(extension) +
             ", which fivepipe does not support: export it without";
  if (!with_materials) return std::nullopt;
  const json& meshes = member(file, "meshes");
  if (!meshes.is_array()) return std::nullopt;  // glTF 1.0 has an object
  std::set<std::size_t> checked;                // a material that no mesh uses is not drawn
  for (const json& mesh : meshes)
    for (const json& primitive : member(mesh, "primitives")) {
      const json& index = member(primitive, "material");
      const json& material = element(member(file, "materials"), index);
      if (!material.is_object() || !checked.insert(index.get<std::size_t>()).second) continue;
      if (const auto why = why_unsupported_texture(file, material)) return why;
    }
  return std::nullopt;
}

}  // namespace fivepipe::config
