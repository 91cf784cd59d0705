// Variants of the GLSL sources that cmake/EmbedShaders.cmake embeds.
#pragma once
#include <stdexcept>
#include <string>
#include <string_view>

namespace fivepipe::gl {

// Inserts `defines` ("#define FLAT\n...") after the #version line of `source`. Throws
// std::invalid_argument if `source` has no #version line that ends with a newline.
inline std::string with_defines(std::string_view source, std::string_view defines) {
  const std::size_t version = source.find("#version");
  const std::size_t end = version == std::string_view::npos ? version : source.find('\n', version);
  if (end == std::string_view::npos) throw std::invalid_argument("shader without #version line");
  return std::string(source.substr(0, end + 1)).append(defines).append(source.substr(end + 1));
}

}  // namespace fivepipe::gl
