// Owners of OpenGL objects. All need a current context, for construction, use and destruction.
#pragma once
#include <epoxy/gl.h>

#include <Eigen/Core>
#include <optional>
#include <string>
#include <utility>

namespace fivepipe::gl {

// A GL object name with its deleter; moves, never copies.
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
void delete_texture(GLuint name);
void delete_buffer(GLuint name);
void delete_framebuffer(GLuint name);
void delete_vertex_array(GLuint name);
void delete_program(GLuint name);
void delete_query(GLuint name);

// Immutable storage, one level, nearest sampling, clamped to a border of zeros: outside the image
// nothing is set.
class GlTexture {
 public:
  GlTexture(int width_px, int height_px, GLenum internal_format);
  GLuint get() const { return name_.get(); }
  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }
  // Whole image, rows tightly packed, row 0 first.
  void upload(GLenum format, GLenum type, const void* pixels) const;
  // A rectangle of it.
  void upload(int x_px, int y_px, int width_px, int height_px, GLenum format, GLenum type,
              const void* pixels) const;
  void bind(int unit) const;

 private:
  GlName<delete_texture> name_;
  int width_px_, height_px_;
};

class GlBuffer {
 public:
  GlBuffer();
  GLuint get() const { return name_.get(); }
  void upload(const void* bytes, std::size_t size_bytes, GLenum usage);
  // Room for size_bytes, whatever was in it; kept from call to call where it is enough.
  void reserve(std::size_t size_bytes);
  // Reserves, then writes from the start.
  void write(const void* bytes, std::size_t size_bytes);
  void bind_storage(int binding) const;  // all of it, as a shader storage block
  void bind_uniform(int binding) const;  // as a uniform block

 private:
  GlName<delete_buffer> name_;
  std::size_t reserved_bytes_ = 0;
};

class GlVertexArray {
 public:
  GlVertexArray();
  GLuint get() const { return name_.get(); }
  void bind() const;
  // Attribute `location`: `components` floats at offset_bytes of each stride_bytes of buffer.
  void attribute(int location, const GlBuffer& buffer, int components, int stride_bytes,
                 int offset_bytes) const;

 private:
  GlName<delete_vertex_array> name_;
};

// Vertex and fragment shader, or one compute shader, linked. Throws GlError with the compiler's log
// and the program's name.
class GlProgram {
 public:
  GlProgram(const std::string& name, const std::string& vertex_source,
            const std::string& fragment_source);
  GlProgram(const std::string& name, const std::string& compute_source);
  GLuint get() const { return name_.get(); }
  void use() const;
  void set(const char* uniform, int value) const;
  void set(const char* uniform, float value) const;
  void set(const char* uniform, const Eigen::Vector2f& value) const;
  void set(const char* uniform, const Eigen::Vector3f& value) const;
  void set(const char* uniform, const Eigen::Vector4f& value) const;
  void set(const char* uniform, const Eigen::Matrix4f& value) const;
  void set(const char* uniform, const Eigen::Matrix<float, 3, 4>& value) const;  // a GLSL mat4x3

 private:
  GlName<delete_program> name_;
};

// How long the GPU took for the commands between begin and end.
class GlTimer {
 public:
  GlTimer();
  void begin();
  void end();
  double elapsed_ms() const;  // of the last pair; waits for the GPU; 0 before the first

 private:
  GlName<delete_query> begin_, end_;  // time stamps: other timers may run meanwhile
  bool used_ = false;
};

// Depth is a 32 bit float, stencil 8 bits: with both a pixel takes 8 bytes, with depth alone 4.
enum class DepthBuffer { none, depth, depth_and_stencil };

// One colour attachment, and the depth buffer that is asked for.
class GlFramebuffer {
 public:
  GlFramebuffer(int width_px, int height_px, GLenum colour_format, DepthBuffer depth);
  void bind() const;  // and sets the viewport to all of it
  GLuint get() const { return name_.get(); }
  const GlTexture& colour() const { return colour_; }

 private:
  GlTexture colour_;
  std::optional<GlTexture> depth_;
  GlName<delete_framebuffer> name_;
};

}  // namespace fivepipe::gl
