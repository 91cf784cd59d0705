// Checks of the parts of a glTF 2.0 file that its importer ignores.
#pragma once
#include <filesystem>
#include <optional>
#include <string>

namespace fivepipe::config {

// Returns the JSON text of a .gltf or .glb file, or an empty one if there is none.
std::string gltf_json(const std::filesystem::path& file);

// Returns why a file with this JSON text cannot be imported, or nullopt. The file is unsupported if
// it requires an extension that fivepipe does not support; or, with materials, if a texture of a
// base colour has no image, or has a transform (KHR_texture_transform). Returns nullopt for a text
// that is not JSON, because the importer refuses it.
std::optional<std::string> why_unsupported(const std::string& json_text, bool with_materials);

}  // namespace fivepipe::config
