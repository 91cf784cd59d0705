// Textures of virtual objects.
#pragma once
#include <cstddef>
#include <map>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "common/config/scene.h"
#include "common/gl/objects.h"

namespace fivepipe::render {

// An image, 8-bit BGR with row 0 at the top, or the reason why there is none.
struct DecodedImage {
  cv::Mat bgr;
  std::string reason;  // empty: usable
};
// Decodes a PNG or JPEG file: colours are sRGB, alpha is dropped, grey becomes BGR, and the
// EXIF orientation is ignored. `bytes` must have passed config::why_no_texture().
DecodedImage decoded(const std::string& bytes);

// An sRGB texture with mipmaps and trilinear filtering; shaders read linear colours. Texture
// coordinate (0, 0) is the top left corner of the image. Needs a current GL context. Throws
// gl::GlError if the GPU's memory is too small.
class Texture {
 public:
  Texture(const cv::Mat& bgr, config::Wrap wrap_u, config::Wrap wrap_v);
  void bind(int unit) const;

 private:
  gl::GlName<gl::delete_texture> name_;
};

// The textures of a scene's objects, each loaded once. Needs a current GL context.
class SceneTextures {
 public:
  // Throws config::ConfigError that lists every unusable image: unreadable, damaged, larger than
  // the driver allows, or beyond kMaxTexturePixels. Throws gl::GlError as Texture does.
  explicit SceneTextures(const config::Scene& scene);

  // Returns the texture of a material of the scene.
  const Texture& at(const config::MaterialTexture& texture) const { return textures_.at(texture); }

 private:
  std::string load(const config::MaterialTexture& texture);

  std::map<config::MaterialTexture, Texture> textures_;
  std::size_t pixels_ = 0;
};

// The textures of a scene have at most this many pixels together, without mipmaps: 1.4 GB of GPU
// memory with them.
inline constexpr std::size_t kMaxTexturePixels = std::size_t(1) << 28;

}  // namespace fivepipe::render
