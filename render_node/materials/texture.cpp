#include "render_node/materials/texture.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <set>

#include "common/config/mesh/image_header.h"
#include "common/config/mesh/mesh_file.h"
#include "common/config/yaml/config_error.h"
#include "common/gl/gl_error.h"
#include "common/images/image_codecs.h"

namespace fivepipe::render {
namespace {

GLuint new_texture() {
  GLuint name = 0;
  glCreateTextures(GL_TEXTURE_2D, 1, &name);
  return name;
}

GLint gl_wrap(config::Wrap wrap) {
  switch (wrap) {
    case config::Wrap::mirror: return GL_MIRRORED_REPEAT;
    case config::Wrap::clamp: return GL_CLAMP_TO_EDGE;
    case config::Wrap::repeat: break;
  }
  return GL_REPEAT;
}

}  // namespace

DecodedImage decoded(const std::string& bytes) {
  try {
    const cv::Mat bgr = images::decode(bytes, cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
    if (!bgr.empty() && bgr.type() == CV_8UC3) return {bgr, ""};
  } catch (const cv::Exception& error) {
    return {{}, "the image is damaged: " + error.err};
  }
  return {{}, "the image is damaged"};
}

Texture::Texture(const cv::Mat& bgr, config::Wrap wrap_u, config::Wrap wrap_v)
    : name_(new_texture()) {
  const GLuint name = name_.get();
  const int levels = std::bit_width(unsigned(std::max(bgr.cols, bgr.rows)));
  glTextureStorage2D(name, levels, GL_SRGB8_ALPHA8, bgr.cols, bgr.rows);
  if (glGetError() != GL_NO_ERROR)
    throw gl::GlError(
        fmt::format("OpenGL has no memory for a texture of {}x{} pixels", bgr.cols, bgr.rows));
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTextureSubImage2D(name, 0, 0, 0, bgr.cols, bgr.rows, GL_BGR, GL_UNSIGNED_BYTE, bgr.data);
  glGenerateTextureMipmap(name);
  glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  glTextureParameteri(name, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTextureParameteri(name, GL_TEXTURE_WRAP_S, gl_wrap(wrap_u));
  glTextureParameteri(name, GL_TEXTURE_WRAP_T, gl_wrap(wrap_v));
}

void Texture::bind(int unit) const { glBindTextureUnit(GLuint(unit), name_.get()); }

SceneTextures::SceneTextures(const config::Scene& scene) {
  std::vector<config::ConfigProblem> problems;
  std::set<config::MaterialTexture> failed;  // each is reported once
  for (const config::SceneObject& object : scene.objects) {
    const auto* const shape = std::get_if<config::MeshShape>(&object.shape);
    if (shape == nullptr || !shape->materials) continue;
    for (const config::Material& material : shape->materials->materials) {
      if (!material.texture || textures_.contains(*material.texture) ||
          failed.contains(*material.texture))
        continue;
      const std::string reason = load(*material.texture);
      if (reason.empty()) continue;
      failed.insert(*material.texture);
      problems.push_back({shape->file.string(), 0, 0,
                          fmt::format("object {}, material '{}': texture {}: {}", object.name,
                                      material.name, name_of(*material.texture), reason)});
    }
  }
  if (!problems.empty()) throw config::ConfigError(std::move(problems));
}

// Loads the texture. Returns why it cannot, or an empty string.
std::string SceneTextures::load(const config::MaterialTexture& texture) {
  const config::ImageOrReason file = config::read_texture_image(texture);
  if (!file.reason.empty()) return file.reason;
  const config::ImageSize size = *config::image_size(file.bytes);
  GLint max_px = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &max_px);
  if (std::max(size.width_px, size.height_px) > std::uint32_t(max_px))
    return fmt::format("it has {}x{} pixels, the limit of this OpenGL driver is {}x{}",
                       size.width_px, size.height_px, max_px, max_px);
  pixels_ += std::size_t(size.width_px) * size.height_px;
  if (pixels_ > kMaxTexturePixels)
    return fmt::format("the textures of the scene have more than {} pixels together",
                       kMaxTexturePixels);
  const DecodedImage image = decoded(file.bytes);
  if (!image.reason.empty()) return image.reason;
  textures_.emplace(texture, Texture(image.bgr, texture.wrap_u, texture.wrap_v));
  return "";
}

}  // namespace fivepipe::render
