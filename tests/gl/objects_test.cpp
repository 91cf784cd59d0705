#include "common/gl/objects.h"

#include <epoxy/egl.h>
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <numeric>
#include <vector>

#include "tests/support/checked_gl_context.h"

namespace fivepipe::gl {
namespace {

using namespace std::chrono_literals;

class GlObjects : public testing::Test {
 protected:
  const test::CheckedGlContext context_;
};

GLint integer(GLenum name) {
  GLint value = -1;
  glGetIntegerv(name, &value);
  return value;
}

TEST_F(GlObjects, TheContextIsACoreProfileOfOpenGl45) {
  EXPECT_GE(10 * integer(GL_MAJOR_VERSION) + integer(GL_MINOR_VERSION), 45);
  EXPECT_EQ(integer(GL_CONTEXT_PROFILE_MASK), GLint(GL_CONTEXT_CORE_PROFILE_BIT));
  const std::string renderer = reinterpret_cast<const char*>(glGetString(GL_RENDERER)),
                    version = reinterpret_cast<const char*>(glGetString(GL_VERSION));
  EXPECT_EQ(context_.renderer(), renderer + ", OpenGL " + version);
  EXPECT_EQ(context_.is_software(), renderer.starts_with("llvmpipe"));
}

// The status that the driver reports; see below.
GLenum reported_status = GL_NO_ERROR;

TEST_F(GlObjects, ACheckOfTheContextReportsAResetOfTheGpu) {
  EXPECT_NO_THROW(check_context());
  EXPECT_EQ(integer(GL_RESET_NOTIFICATION_STRATEGY), GLint(GL_LOSE_CONTEXT_ON_RESET));
  // libepoxy calls each function of OpenGL by such a pointer.
  const auto before = epoxy_glGetGraphicsResetStatus;
  epoxy_glGetGraphicsResetStatus = [] { return reported_status; };
  for (const auto& [status, text] :
       {std::pair{GLenum(GL_GUILTY_CONTEXT_RESET), "because of this process"},
        {GLenum(GL_INNOCENT_CONTEXT_RESET), "because of another process"},
        {GLenum(GL_UNKNOWN_CONTEXT_RESET), "for an unknown reason"}}) {
    reported_status = status;
    try {
      check_context();
      ADD_FAILURE() << text;
    } catch (const GlError& error) {
      EXPECT_NE(std::string(error.what()).find(text), std::string::npos) << error.what();
    }
  }
  epoxy_glGetGraphicsResetStatus = before;
}

// While it exists, lists the contexts that EGL destroys. The handle of a destroyed context is no
// evidence: EGL may use it again.
class DestroyedContexts {
 public:
  DestroyedContexts() {
    { const GlContext first; }  // the first call of an EGL function sets epoxy's pointer to it
    contexts_.clear();
    destroy_ = epoxy_eglDestroyContext;
    epoxy_eglDestroyContext = [](EGLDisplay display, EGLContext context) -> EGLBoolean {
      const EGLBoolean is_destroyed = destroy_(display, context);
      if (is_destroyed) contexts_.push_back(context);
      return is_destroyed;
    };
  }
  ~DestroyedContexts() { epoxy_eglDestroyContext = destroy_; }
  DestroyedContexts(const DestroyedContexts&) = delete;
  DestroyedContexts& operator=(const DestroyedContexts&) = delete;
  const std::vector<EGLContext>& contexts() const { return contexts_; }

 private:
  static inline std::vector<EGLContext> contexts_;
  static inline PFNEGLDESTROYCONTEXTPROC destroy_ = nullptr;
};

TEST(GlContext, IsNotCurrentAndDoesNotExistAfterItsEnd) {
  const DestroyedContexts destroyed;
  std::vector<EGLContext> created;
  for (int i = 0; i < 2; ++i) {
    const GlContext context;
    created.push_back(eglGetCurrentContext());
    EXPECT_NE(created.back(), EGL_NO_CONTEXT);
    EXPECT_EQ(destroyed.contexts().size(), std::size_t(i)) << "exists until the end of its scope";
  }
  EXPECT_EQ(eglGetCurrentContext(), EGL_NO_CONTEXT);
  EXPECT_EQ(destroyed.contexts(), created);
}

TEST_F(GlObjects, ANameIsDeletedOnceByItsLastOwner) {
  GLuint first = 0, second = 0;
  {
    GlTexture texture(1, 1, GL_R8);
    first = texture.get();
    GlTexture other(1, 1, GL_R8);
    second = other.get();
    GlTexture moved = std::move(texture);
    EXPECT_EQ(texture.get(), 0u);  // NOLINT: the state after the move
    EXPECT_EQ(moved.get(), first);
    moved = std::move(other);
    EXPECT_EQ(moved.get(), second);
    EXPECT_TRUE(glIsTexture(first) && glIsTexture(second));
  }
  EXPECT_FALSE(glIsTexture(first) || glIsTexture(second));
  GLuint buffer, vertices, framebuffer, program;
  {
    const GlBuffer a;
    const GlVertexArray b;
    const GlFramebuffer c(1, 1, GL_RGBA8, DepthBuffer::none);
    const GlProgram d("d", "#version 450\nlayout(local_size_x = 1) in;\nvoid main() {}\n");
    buffer = a.get(), vertices = b.get(), framebuffer = c.get(), program = d.get();
    EXPECT_TRUE(glIsBuffer(buffer) && glIsVertexArray(vertices) && glIsFramebuffer(framebuffer) &&
                glIsProgram(program));
  }
  EXPECT_FALSE(glIsBuffer(buffer) || glIsVertexArray(vertices) || glIsFramebuffer(framebuffer) ||
               glIsProgram(program));
}

GLint parameter(const GlTexture& texture, GLenum name) {
  GLint value = -1;
  glGetTextureParameteriv(texture.get(), name, &value);
  return value;
}

TEST_F(GlObjects, ATextureHasOneLevelAndNearestSamplingInABorder) {
  const GlTexture texture(3, 2, GL_R8);
  EXPECT_EQ(texture.width_px(), 3);
  EXPECT_EQ(texture.height_px(), 2);
  EXPECT_EQ(parameter(texture, GL_TEXTURE_IMMUTABLE_LEVELS), 1);
  EXPECT_EQ(parameter(texture, GL_TEXTURE_MIN_FILTER), GL_NEAREST);
  EXPECT_EQ(parameter(texture, GL_TEXTURE_MAG_FILTER), GL_NEAREST);
  EXPECT_EQ(parameter(texture, GL_TEXTURE_WRAP_S), GL_CLAMP_TO_BORDER);
  EXPECT_EQ(parameter(texture, GL_TEXTURE_WRAP_T), GL_CLAMP_TO_BORDER);
  texture.bind(5);
  glActiveTexture(GL_TEXTURE5);
  EXPECT_EQ(integer(GL_TEXTURE_BINDING_2D), GLint(texture.get()));
}

TEST_F(GlObjects, UploadsPackedRowsOfTheImageAndOfARectangle) {
  const GlTexture texture(3, 2, GL_R8);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  const std::array<std::uint8_t, 6> image{1, 2, 3, 4, 5, 6};
  texture.upload(GL_RED, GL_UNSIGNED_BYTE, image.data());
  const std::array<std::uint8_t, 2> part{8, 9};
  texture.upload(1, 1, 2, 1, GL_RED, GL_UNSIGNED_BYTE, part.data());
  std::array<std::uint8_t, 6> got{};
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glGetTextureImage(texture.get(), 0, GL_RED, GL_UNSIGNED_BYTE, got.size(), got.data());
  EXPECT_EQ(got, (std::array<std::uint8_t, 6>{1, 2, 3, 4, 8, 9}));
}

GLint size_of(const GlBuffer& buffer) {
  GLint size = -1;
  glGetNamedBufferParameteriv(buffer.get(), GL_BUFFER_SIZE, &size);
  return size;
}

std::vector<std::uint8_t> content_of(const GlBuffer& buffer, std::size_t size) {
  std::vector<std::uint8_t> content(size);
  glGetNamedBufferSubData(buffer.get(), 0, GLsizeiptr(size), content.data());
  return content;
}

TEST_F(GlObjects, ABufferGrowsAndKeepsALargerAllocation) {
  std::vector<std::uint8_t> bytes(40);
  std::iota(bytes.begin(), bytes.end(), std::uint8_t(1));
  GlBuffer buffer;
  buffer.reserve(1);
  EXPECT_EQ(size_of(buffer), 1);
  buffer.write(bytes.data(), 40);
  EXPECT_EQ(size_of(buffer), 40);
  EXPECT_EQ(content_of(buffer, 40), bytes);
  for (const std::size_t smaller : {40, 39, 1}) {
    buffer.reserve(smaller);
    EXPECT_EQ(size_of(buffer), 40);
    EXPECT_EQ(content_of(buffer, 40), bytes) << smaller;
  }
  buffer.reserve(41);
  EXPECT_EQ(size_of(buffer), 41);
  buffer.upload(bytes.data(), 10, GL_STATIC_DRAW);
  EXPECT_EQ(size_of(buffer), 10);
  EXPECT_EQ(content_of(buffer, 10), std::vector<std::uint8_t>(bytes.begin(), bytes.begin() + 10));
  buffer.write(bytes.data() + 7, 3);
  EXPECT_EQ(content_of(buffer, 4), (std::vector<std::uint8_t>{8, 9, 10, 4}));
  buffer.reserve(20);
  EXPECT_EQ(size_of(buffer), 20);
}

TEST_F(GlObjects, BuffersAreBoundAsAWhole) {
  GlBuffer buffer;
  buffer.reserve(16);
  buffer.bind_storage(3);
  buffer.bind_uniform(4);
  GLint storage = -1, uniform = -1;
  glGetIntegeri_v(GL_SHADER_STORAGE_BUFFER_BINDING, 3, &storage);
  glGetIntegeri_v(GL_UNIFORM_BUFFER_BINDING, 4, &uniform);
  EXPECT_EQ(storage, GLint(buffer.get()));
  EXPECT_EQ(uniform, GLint(buffer.get()));
}

TEST_F(GlObjects, AnAttributeReadsFloatsAtItsOffsetOfEachElement) {
  GlBuffer buffer;
  buffer.reserve(100);
  const GlVertexArray vertices;
  vertices.attribute(2, buffer, 3, 20, 8);
  const auto attribute = [&](GLenum name) {
    GLint value = -1;
    glGetVertexArrayIndexediv(vertices.get(), 2, name, &value);
    return value;
  };
  EXPECT_EQ(attribute(GL_VERTEX_ATTRIB_ARRAY_ENABLED), GL_TRUE);
  EXPECT_EQ(attribute(GL_VERTEX_ATTRIB_ARRAY_SIZE), 3);
  EXPECT_EQ(attribute(GL_VERTEX_ATTRIB_ARRAY_TYPE), GL_FLOAT);
  EXPECT_EQ(attribute(GL_VERTEX_ATTRIB_RELATIVE_OFFSET), 0);
  vertices.bind();
  EXPECT_EQ(integer(GL_VERTEX_ARRAY_BINDING), GLint(vertices.get()));
  GLint binding = -1, stride = -1, bound = -1;
  GLint64 offset = -1;
  glGetVertexAttribiv(2, GL_VERTEX_ATTRIB_BINDING, &binding);
  glGetIntegeri_v(GL_VERTEX_BINDING_STRIDE, 2, &stride);
  glGetIntegeri_v(GL_VERTEX_BINDING_BUFFER, 2, &bound);
  glGetInteger64i_v(GL_VERTEX_BINDING_OFFSET, 2, &offset);
  EXPECT_EQ(binding, 2);
  EXPECT_EQ(stride, 20);
  EXPECT_EQ(offset, 8);
  EXPECT_EQ(bound, GLint(buffer.get()));
}

constexpr const char* kVertex =
    "#version 450\nuniform mat4 m;\nuniform vec4 v4;\nuniform vec3 v3;\nuniform vec2 v2;\nuniform "
    "float f;\nuniform int i;\nvoid main() { gl_Position = m * v4 + vec4(v3, f) + vec4(v2, i, i); "
    "}\n";
constexpr const char* kFragment = "#version 450\nout vec4 c;\nvoid main() { c = vec4(1); }\n";

template <class Value>
Value uniform(const GlProgram& program, const char* name) {
  Value value = Value::Zero();
  glGetUniformfv(program.get(), glGetUniformLocation(program.get(), name), value.data());
  return value;
}

TEST_F(GlObjects, SetsEachKindOfUniform) {
  const GlProgram program("test", kVertex, kFragment);
  EXPECT_EQ(glIsProgram(program.get()), GL_TRUE);
  GLint shaders = -1;
  glGetProgramiv(program.get(), GL_ATTACHED_SHADERS, &shaders);
  EXPECT_EQ(shaders, 0);
  const Eigen::Matrix4f m = Eigen::Matrix4f::Random();
  program.set("m", m);
  program.set("v4", Eigen::Vector4f(1, 2, 3, 4));
  program.set("v3", Eigen::Vector3f(5, 6, 7));
  program.set("v2", Eigen::Vector2f(8, 9));
  program.set("f", 0.5f);
  program.set("i", -7);
  program.set("unknown", 1);
  EXPECT_EQ(uniform<Eigen::Matrix4f>(program, "m"), m);
  EXPECT_EQ(uniform<Eigen::Vector4f>(program, "v4"), Eigen::Vector4f(1, 2, 3, 4));
  EXPECT_EQ(uniform<Eigen::Vector3f>(program, "v3"), Eigen::Vector3f(5, 6, 7));
  EXPECT_EQ(uniform<Eigen::Vector2f>(program, "v2"), Eigen::Vector2f(8, 9));
  EXPECT_EQ((uniform<Eigen::Matrix<float, 1, 1>>(program, "f")(0)), 0.5f);
  GLint i = 0;
  glGetUniformiv(program.get(), glGetUniformLocation(program.get(), "i"), &i);
  EXPECT_EQ(i, -7);
  program.use();
  EXPECT_EQ(integer(GL_CURRENT_PROGRAM), GLint(program.get()));
}

template <class Call>
std::string error_of(Call call) {
  try {
    call();
  } catch (const GlError& error) {
    return error.what();
  }
  return "";
}

TEST_F(GlObjects, ShaderErrorsNameTheProgramAndTheReason) {
  const std::string no_compile =
      error_of([] { GlProgram("broken", "#version 450\nvoid main() { nonsense; }\n"); });
  EXPECT_TRUE(no_compile.starts_with("shader of broken does not compile: ")) << no_compile;
  EXPECT_NE(no_compile.find("nonsense"), std::string::npos) << no_compile;
  const std::string no_link = error_of([] {
    GlProgram("apart",
              "#version 450\nout vec2 shared_value;\nvoid main() { shared_value = vec2(1); "
              "gl_Position = vec4(1); }\n",
              "#version 450\nin vec3 shared_value;\nout vec4 c;\nvoid main() { c = "
              "vec4(shared_value, 1); }\n");
  });
  EXPECT_TRUE(no_link.starts_with("program apart does not link: ")) << no_link;
  EXPECT_NE(no_link.find("shared_value"), std::string::npos) << no_link;
}

// The context is new, so its objects have small names.
TEST_F(GlObjects, NoObjectOutlivesItsOwner) {
  constexpr GLuint kNames = 200;
  {
    const GlTexture texture(2, 2, GL_R8);
    const GlBuffer buffer;
    const GlVertexArray vertices;
    const GlProgram drawing("drawing", kVertex, kFragment);
    const GlFramebuffer plain(1, 1, GL_RGBA8, DepthBuffer::none),
        full(1, 1, GL_RGBA8, DepthBuffer::depth_and_stencil);
    GlTimer timer;
    timer.begin();
    timer.end();
    EXPECT_NE(error_of([] { GlProgram("no_compile", "#version 450\nvoid main() { x; }\n"); }), "");
    EXPECT_NE(error_of([] {
                GlProgram("no_link", kVertex,
                          "#version 450\nvoid f();\nvoid main() "
                          "{ f(); }\n");
              }),
              "");
    EXPECT_NE(error_of([] { GlFramebuffer(7, 5, GL_DEPTH_COMPONENT24, DepthBuffer::none); }), "");
    EXPECT_TRUE(glIsTexture(texture.get()) && glIsBuffer(buffer.get()));
    for (const GLuint name :
         {texture.get(), buffer.get(), vertices.get(), drawing.get(), plain.get(), full.get()})
      ASSERT_LT(name, kNames) << "the names below do not include it";
  }
  for (GLuint name = 1; name < kNames; ++name) {
    EXPECT_FALSE(glIsTexture(name)) << name;
    EXPECT_FALSE(glIsBuffer(name)) << name;
    EXPECT_FALSE(glIsVertexArray(name)) << name;
    EXPECT_FALSE(glIsFramebuffer(name)) << name;
    EXPECT_FALSE(glIsShader(name)) << name;
    EXPECT_FALSE(glIsProgram(name)) << name;
    EXPECT_FALSE(glIsQuery(name)) << name;
  }
}

TEST_F(GlObjects, ATimerMeasuresTheTimeBetweenItsEnds) {
  GlTimer timer;
  EXPECT_EQ(timer.elapsed_ms(), 0);
  const auto now = [] { return std::chrono::steady_clock::now(); };
  const auto outer_start = now();
  timer.begin();
  glFinish();
  const auto start = now();
  while (now() - start < 5ms) {
  }
  const std::chrono::duration<double, std::milli> inner = now() - start;
  timer.end();
  glFinish();
  const std::chrono::duration<double, std::milli> outer = now() - outer_start;
  EXPECT_GE(timer.elapsed_ms(), 0.999 * inner.count());
  EXPECT_LE(timer.elapsed_ms(), 1.001 * outer.count());
}

// Returns the object type or the size of an attachment, or 0 if there is none.
GLint attached(const GlFramebuffer& framebuffer, GLenum attachment, GLenum name) {
  GLint type = GL_NONE, value = 0;
  glGetNamedFramebufferAttachmentParameteriv(framebuffer.get(), attachment,
                                             GL_FRAMEBUFFER_ATTACHMENT_OBJECT_TYPE, &type);
  if (type != GL_NONE)
    glGetNamedFramebufferAttachmentParameteriv(framebuffer.get(), attachment, name, &value);
  return value;
}

TEST_F(GlObjects, AFramebufferHasTheRequestedDepth) {
  struct {
    DepthBuffer depth;
    int depth_bits, stencil_bits;
  } const cases[] = {{DepthBuffer::none, 0, 0},
                     {DepthBuffer::depth, 32, 0},
                     {DepthBuffer::depth_and_stencil, 32, 8}};
  for (const auto& [depth, depth_bits, stencil_bits] : cases) {
    const GlFramebuffer framebuffer(7, 5, GL_RGBA8, depth);
    EXPECT_EQ(attached(framebuffer, GL_DEPTH_ATTACHMENT, GL_FRAMEBUFFER_ATTACHMENT_DEPTH_SIZE),
              depth_bits);
    EXPECT_EQ(attached(framebuffer, GL_STENCIL_ATTACHMENT, GL_FRAMEBUFFER_ATTACHMENT_STENCIL_SIZE),
              stencil_bits);
    EXPECT_EQ(attached(framebuffer, GL_COLOR_ATTACHMENT0, GL_FRAMEBUFFER_ATTACHMENT_OBJECT_NAME),
              GLint(framebuffer.colour().get()));
    framebuffer.bind();
    EXPECT_EQ(integer(GL_DRAW_FRAMEBUFFER_BINDING), GLint(framebuffer.get()));
    std::array<GLint, 4> viewport{};
    glGetIntegerv(GL_VIEWPORT, viewport.data());
    EXPECT_EQ(viewport, (std::array<GLint, 4>{0, 0, 7, 5}));
  }
}

// A depth format is no colour format in any driver (OpenGL 4.5, section 9.4).
TEST_F(GlObjects, AnIncompleteFramebufferIsAnError) {
  EXPECT_EQ(error_of([] { GlFramebuffer(7, 5, GL_DEPTH_COMPONENT24, DepthBuffer::none); }),
            "framebuffer of 7x5 is incomplete");
}

}  // namespace
}  // namespace fivepipe::gl
