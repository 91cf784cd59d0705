// Checks of the parts of a glTF 2.0 file that its importer ignores.
#pragma once
#include <filesystem>
#include <optional>
#include <string>

namespace fivepipe::config {

// Returns the JSON text of a .gltf or .glb file, or an empty one if there is none.
std::string gltf_json(const std::filesystem::path& file);

// Returns why a file with this JSON text cannot be imported, or nullopt: it requires an extension
// that fivepipe does not support; or, with its materials, a texture of a base colour has no image,
// or a transform (KHR_texture_transform). Returns nullopt for a text that is no JSON: the importer
// refuses it.
std::optional<std::string> why_unsupported(const std::string& json_text, bool with_materials);

}  // namespace fivepipe::config
