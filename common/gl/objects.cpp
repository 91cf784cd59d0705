#include "common/gl/objects.h"

#include <vector>

#include "common/gl/gl_error.h"

namespace fivepipe::gl {

void delete_texture(GLuint name) { glDeleteTextures(1, &name); }
void delete_buffer(GLuint name) { glDeleteBuffers(1, &name); }
void delete_framebuffer(GLuint name) { glDeleteFramebuffers(1, &name); }
void delete_vertex_array(GLuint name) { glDeleteVertexArrays(1, &name); }
void delete_program(GLuint name) { glDeleteProgram(name); }
void delete_query(GLuint name) { glDeleteQueries(1, &name); }

namespace {

void delete_shader(GLuint name) { glDeleteShader(name); }

template <typename Create>
GLuint created(Create create) {
  GLuint name = 0;
  create(&name);
  if (!name) throw GlError("OpenGL created no object; is a context current?");
  return name;
}

GLuint compiled(const std::string& program, GLenum stage, const std::string& source) {
  const GLuint shader = glCreateShader(stage);
  const char* text = source.c_str();
  glShaderSource(shader, 1, &text, nullptr);
  glCompileShader(shader);
  GLint ok = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
  if (!ok) {
    std::vector<char> log(4096);
    glGetShaderInfoLog(shader, GLsizei(log.size()), nullptr, log.data());
    glDeleteShader(shader);
    throw GlError("shader of " + program + " does not compile: " + log.data());
  }
  return shader;
}

struct Stage {
  GLenum kind;
  const std::string& source;
};

GLuint linked(const std::string& name, std::initializer_list<Stage> stages) {
  std::vector<GlName<delete_shader>> shaders;
  for (const Stage& stage : stages) shaders.emplace_back(compiled(name, stage.kind, stage.source));
  const GLuint program = glCreateProgram();
  for (const auto& shader : shaders) glAttachShader(program, shader.get());
  glLinkProgram(program);
  for (const auto& shader : shaders) glDetachShader(program, shader.get());
  GLint ok = 0;
  glGetProgramiv(program, GL_LINK_STATUS, &ok);
  if (!ok) {
    std::vector<char> log(4096);
    glGetProgramInfoLog(program, GLsizei(log.size()), nullptr, log.data());
    glDeleteProgram(program);
    throw GlError("program " + name + " does not link: " + log.data());
  }
  return program;
}

}  // namespace

GlTexture::GlTexture(int width_px, int height_px, GLenum internal_format)
    : name_(created([](GLuint* n) { glCreateTextures(GL_TEXTURE_2D, 1, n); })),
      width_px_(width_px),
      height_px_(height_px) {
  glTextureStorage2D(get(), 1, internal_format, width_px, height_px);
  glTextureParameteri(get(), GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTextureParameteri(get(), GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  glTextureParameteri(get(), GL_TEXTURE_WRAP_S, GL_CLAMP_TO_BORDER);
  glTextureParameteri(get(), GL_TEXTURE_WRAP_T, GL_CLAMP_TO_BORDER);
}

void GlTexture::upload(GLenum format, GLenum type, const void* pixels) const {
  upload(0, 0, width_px_, height_px_, format, type, pixels);
}

void GlTexture::upload(int x_px, int y_px, int width_px, int height_px, GLenum format, GLenum type,
                       const void* pixels) const {
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTextureSubImage2D(get(), 0, x_px, y_px, width_px, height_px, format, type, pixels);
}

void GlTexture::bind(int unit) const { glBindTextureUnit(GLuint(unit), get()); }

GlBuffer::GlBuffer() : name_(created([](GLuint* n) { glCreateBuffers(1, n); })) {}

void GlBuffer::upload(const void* bytes, std::size_t size_bytes, GLenum usage) {
  glNamedBufferData(get(), GLsizeiptr(size_bytes), bytes, usage);
  reserved_bytes_ = size_bytes;
}

void GlBuffer::reserve(std::size_t size_bytes) {
  if (size_bytes <= reserved_bytes_) return;
  glNamedBufferData(get(), GLsizeiptr(size_bytes), nullptr, GL_DYNAMIC_DRAW);
  reserved_bytes_ = size_bytes;
}

void GlBuffer::write(const void* bytes, std::size_t size_bytes) {
  reserve(size_bytes);
  glNamedBufferSubData(get(), 0, GLsizeiptr(size_bytes), bytes);
}

void GlBuffer::bind_storage(int binding) const {
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, GLuint(binding), get());
}
void GlBuffer::bind_uniform(int binding) const {
  glBindBufferBase(GL_UNIFORM_BUFFER, GLuint(binding), get());
}

GlVertexArray::GlVertexArray() : name_(created([](GLuint* n) { glCreateVertexArrays(1, n); })) {}

void GlVertexArray::bind() const { glBindVertexArray(get()); }

void GlVertexArray::attribute(int location, const GlBuffer& buffer, int components,
                              int stride_bytes, int offset_bytes) const {
  const GLuint index = GLuint(location);
  glVertexArrayVertexBuffer(get(), index, buffer.get(), offset_bytes, stride_bytes);
  glVertexArrayAttribFormat(get(), index, components, GL_FLOAT, GL_FALSE, 0);
  glVertexArrayAttribBinding(get(), index, index);
  glEnableVertexArrayAttrib(get(), index);
}

GlProgram::GlProgram(const std::string& name, const std::string& vertex_source,
                     const std::string& fragment_source)
    : name_(linked(name,
                   {{GL_VERTEX_SHADER, vertex_source}, {GL_FRAGMENT_SHADER, fragment_source}})) {}

GlProgram::GlProgram(const std::string& name, const std::string& compute_source)
    : name_(linked(name, {{GL_COMPUTE_SHADER, compute_source}})) {}

void GlProgram::use() const { glUseProgram(get()); }
void GlProgram::set(const char* uniform, int value) const {
  glProgramUniform1i(get(), glGetUniformLocation(get(), uniform), value);
}
void GlProgram::set(const char* uniform, float value) const {
  glProgramUniform1f(get(), glGetUniformLocation(get(), uniform), value);
}
void GlProgram::set(const char* uniform, const Eigen::Vector2f& value) const {
  glProgramUniform2fv(get(), glGetUniformLocation(get(), uniform), 1, value.data());
}
void GlProgram::set(const char* uniform, const Eigen::Vector3f& value) const {
  glProgramUniform3fv(get(), glGetUniformLocation(get(), uniform), 1, value.data());
}
void GlProgram::set(const char* uniform, const Eigen::Vector4f& value) const {
  glProgramUniform4fv(get(), glGetUniformLocation(get(), uniform), 1, value.data());
}
void GlProgram::set(const char* uniform, const Eigen::Matrix4f& value) const {
  glProgramUniformMatrix4fv(get(), glGetUniformLocation(get(), uniform), 1, GL_FALSE, value.data());
}

GlTimer::GlTimer()
    : begin_(created([](GLuint* n) { glCreateQueries(GL_TIMESTAMP, 1, n); })),
      end_(created([](GLuint* n) { glCreateQueries(GL_TIMESTAMP, 1, n); })) {}

void GlTimer::begin() { glQueryCounter(begin_.get(), GL_TIMESTAMP); }

void GlTimer::end() {
  glQueryCounter(end_.get(), GL_TIMESTAMP);
  used_ = true;
}

double GlTimer::elapsed_ms() const {
  if (!used_) return 0;
  GLuint64 begin_ns = 0, end_ns = 0;
  glGetQueryObjectui64v(begin_.get(), GL_QUERY_RESULT, &begin_ns);
  glGetQueryObjectui64v(end_.get(), GL_QUERY_RESULT, &end_ns);
  return double(end_ns - begin_ns) * 1e-6;
}

GlFramebuffer::GlFramebuffer(int width_px, int height_px, GLenum colour_format, DepthBuffer depth)
    : colour_(width_px, height_px, colour_format),
      name_(created([](GLuint* n) { glCreateFramebuffers(1, n); })) {
  glNamedFramebufferTexture(get(), GL_COLOR_ATTACHMENT0, colour_.get(), 0);
  if (depth != DepthBuffer::none) {
    const bool stencil = depth == DepthBuffer::depth_and_stencil;
    depth_.emplace(width_px, height_px, stencil ? GL_DEPTH32F_STENCIL8 : GL_DEPTH_COMPONENT32F);
    glNamedFramebufferTexture(get(), stencil ? GL_DEPTH_STENCIL_ATTACHMENT : GL_DEPTH_ATTACHMENT,
                              depth_->get(), 0);
  }
  if (glCheckNamedFramebufferStatus(get(), GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    throw GlError("framebuffer of " + std::to_string(width_px) + "x" + std::to_string(height_px) +
                  " is incomplete");
}

void GlFramebuffer::bind() const {
  glBindFramebuffer(GL_FRAMEBUFFER, get());
  glViewport(0, 0, colour_.width_px(), colour_.height_px());
}

void check_context() {
  switch (glGetGraphicsResetStatus()) {
    case GL_NO_ERROR: return;
    case GL_GUILTY_CONTEXT_RESET:
      throw GlError(
          "the GPU was reset because of this process; its OpenGL context is lost, and the node has "
          "to start again");
    case GL_INNOCENT_CONTEXT_RESET:
      throw GlError(
          "the GPU was reset because of another process; the OpenGL context is lost, and the node "
          "has to start again");
    default:
      throw GlError(
          "the GPU was reset for an unknown reason; the OpenGL context is lost, and the node has "
          "to start again");
  }
}

}  // namespace fivepipe::gl
