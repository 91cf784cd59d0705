// Depth images as files.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "common/hull/hull.h"

namespace fivepipe::exports {

// png: 16 bits, in millimetres, at most 65,535 mm. exr: 32-bit floats, in metres. 0: no hull.
enum class DepthFormat { png, exr };
// Returns nullopt if the text is neither png nor exr.
std::optional<DepthFormat> depth_format_from(std::string_view text);
std::string extension_of(DepthFormat format);  // ".png"

// Call it before threads start, if depth is written as EXR: OpenCV reads an environment variable.
void enable_exr();
// `depth`: of a whole image. Throws std::runtime_error if the file cannot be written. The folder
// must exist.
void write_depth(const std::filesystem::path& file, const hull::DepthTile& depth,
                 DepthFormat format);

}  // namespace fivepipe::exports
