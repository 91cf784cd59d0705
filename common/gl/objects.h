// RAII owners of OpenGL objects. Construction, use and destruction need a current context.
#pragma once
#include <epoxy/gl.h>

#include <Eigen/Core>
#include <optional>
#include <string>
#include <utility>

namespace fivepipe::gl {

// Owns a GL object name and deletes it. Movable, not copyable.
template <void (*Delete)(GLuint)>
class GlName {
 public:
  explicit GlName(GLuint name = 0) : name_(name) {}
  GlName(GlName&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
  GlName& operator=(GlName&& other) noexcept {
    std::swap(name_, other.name_);
    return *this;
  }
  ~GlName() {
    if (name_) Delete(name_);
  }
  GLuint get() const { return name_; }

 private:
  GLuint name_;
};
// Deleters of GlName.
void delete_texture(GLuint name);
void delete_buffer(GLuint name);
void delete_framebuffer(GLuint name);
void delete_vertex_array(GLuint name);
void delete_program(GLuint name);
void delete_query(GLuint name);

// A 2D texture with immutable storage, one level and nearest sampling. Samples outside the image
// return the border colour, zero.
class GlTexture {
 public:
  GlTexture(int width_px, int height_px, GLenum internal_format);
  GLuint get() const { return name_.get(); }
  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }
  // Uploads the whole image: rows tightly packed, row 0 first.
  void upload(GLenum format, GLenum type, const void* pixels) const;
  // Uploads a rectangle. Rows are packed unless GL_UNPACK_ROW_LENGTH is set.
  void upload(int x_px, int y_px, int width_px, int height_px, GLenum format, GLenum type,
              const void* pixels) const;
  // Binds the texture to a texture unit.
  void bind(int unit) const;

 private:
  GlName<delete_texture> name_;
  int width_px_, height_px_;
};

// A buffer object of variable size.
class GlBuffer {
 public:
  GlBuffer();
  GLuint get() const { return name_.get(); }
  // Replaces the content and the size.
  void upload(const void* bytes, std::size_t size_bytes, GLenum usage);
  // Reserves at least size_bytes and keeps a larger allocation. The content is undefined if the
  // buffer grew.
  void reserve(std::size_t size_bytes);
  // Reserves size_bytes, then writes the bytes at offset 0.
  void write(const void* bytes, std::size_t size_bytes);
  void bind_storage(int binding) const;  // binds the whole buffer as a shader storage block
  void bind_uniform(int binding) const;  // binds the whole buffer as a uniform block

 private:
  GlName<delete_buffer> name_;
  std::size_t reserved_bytes_ = 0;
};

// A vertex array object with float attributes.
class GlVertexArray {
 public:
  GlVertexArray();
  GLuint get() const { return name_.get(); }
  void bind() const;
  // Sets attribute `location` to `components` floats at offset_bytes of each element of the buffer;
  // elements are stride_bytes apart.
  void attribute(int location, const GlBuffer& buffer, int components, int stride_bytes,
                 int offset_bytes) const;

 private:
  GlName<delete_vertex_array> name_;
};

// A linked program of a vertex and a fragment shader, or of one compute shader. The constructors
// throw GlError with the program's name and the compiler's log.
class GlProgram {
 public:
  GlProgram(const std::string& name, const std::string& vertex_source,
            const std::string& fragment_source);
  GlProgram(const std::string& name, const std::string& compute_source);
  GLuint get() const { return name_.get(); }
  void use() const;
  // Sets a uniform. A name that the linked program does not use has no effect.
  void set(const char* uniform, int value) const;
  void set(const char* uniform, float value) const;
  void set(const char* uniform, const Eigen::Vector2f& value) const;
  void set(const char* uniform, const Eigen::Vector3f& value) const;
  void set(const char* uniform, const Eigen::Vector4f& value) const;
  void set(const char* uniform, const Eigen::Matrix4f& value) const;

 private:
  GlName<delete_program> name_;
};

// Throws GlError if the GPU was reset since the creation of the current context: all of the
// context's objects are lost, and what is read from them is undefined. Call it after reading back.
void check_context();

// Measures the GPU time of the commands between begin() and end().
class GlTimer {
 public:
  GlTimer();
  void begin();
  void end();
  // Waits for the GPU and returns the time of the last begin-end pair; 0 before the first pair.
  double elapsed_ms() const;

 private:
  // Timestamp queries, because GL_TIME_ELAPSED queries of several timers must not overlap.
  GlName<delete_query> begin_, end_;
  bool used_ = false;
};

// Depth is a 32-bit float and takes 4 bytes per pixel; with 8-bit stencil a pixel takes 8 bytes.
enum class DepthBuffer { none, depth, depth_and_stencil };

// A framebuffer with one colour attachment and the requested depth buffer. The constructor throws
// GlError if the framebuffer is incomplete.
class GlFramebuffer {
 public:
  GlFramebuffer(int width_px, int height_px, GLenum colour_format, DepthBuffer depth);
  void bind() const;  // also sets the viewport to the whole framebuffer
  GLuint get() const { return name_.get(); }
  const GlTexture& colour() const { return colour_; }

 private:
  GlTexture colour_;
  std::optional<GlTexture> depth_;
  GlName<delete_framebuffer> name_;
};

}  // namespace fivepipe::gl
