#include "common/gl/context.h"

#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <array>
#include <cstring>
#include <vector>

namespace fivepipe::gl {
namespace {

std::string egl_error() {
  std::array<char, 16> text;
  std::snprintf(text.data(), text.size(), "0x%04x", unsigned(eglGetError()));
  return text.data();
}

bool has_extension(const char* words, const char* word) {
  return words &&
         (" " + std::string(words) + " ").find(" " + std::string(word) + " ") != std::string::npos;
}

// Returns the displays to try, hardware devices first, each with a name for error messages.
std::vector<std::pair<EGLDisplay, std::string>> candidate_displays() {
  std::vector<std::pair<EGLDisplay, std::string>> displays;
  const char* client = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  if (has_extension(client, "EGL_EXT_device_enumeration") &&
      has_extension(client, "EGL_EXT_platform_device")) {
    std::array<EGLDeviceEXT, 16> devices;
    EGLint count = 0;
    if (eglQueryDevicesEXT(EGLint(devices.size()), devices.data(), &count))
      for (EGLint i = 0; i < count; ++i)
        if (!has_extension(eglQueryDeviceStringEXT(devices[i], EGL_EXTENSIONS),
                           "EGL_MESA_device_software"))
          displays.emplace_back(
              eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, devices[i], nullptr),
              "EGL device " + std::to_string(i));
  }
  if (has_extension(client, "EGL_MESA_platform_surfaceless"))
    displays.emplace_back(
        eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr),
        "Mesa surfaceless");
  return displays;
}

// Returns EGL_NO_CONTEXT if the display offers no OpenGL 4.5. A context that reports a reset of the
// GPU (gl::check_context()) is preferred; not every driver has one.
EGLContext created_context(EGLDisplay display) {
  if (!eglBindAPI(EGL_OPENGL_API)) return EGL_NO_CONTEXT;
  for (const EGLint strategy : {EGL_LOSE_CONTEXT_ON_RESET, EGL_NO_RESET_NOTIFICATION}) {
    const EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION,
                                 4,
                                 EGL_CONTEXT_MINOR_VERSION,
                                 5,
                                 EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                 EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                 EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY,
                                 strategy,
                                 EGL_NONE};
    const EGLContext context =
        eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
    if (context != EGL_NO_CONTEXT) return context;
  }
  return EGL_NO_CONTEXT;
}

}  // namespace

GlContext::GlContext() {
  std::string tried;
  for (const auto& [display, name] : candidate_displays()) {
    EGLint major = 0, minor = 0;
    if (display == EGL_NO_DISPLAY || !eglInitialize(display, &major, &minor)) {
      tried += "; " + name + ": no display (" + egl_error() + ")";
      continue;
    }
    const EGLContext context = created_context(display);
    if (context != EGL_NO_CONTEXT &&
        eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) {
      display_ = display;
      context_ = context;
      renderer_ = std::string(reinterpret_cast<const char*>(glGetString(GL_RENDERER))) +
                  ", OpenGL " + reinterpret_cast<const char*>(glGetString(GL_VERSION));
      return;
    }
    tried += "; " + name + ": no OpenGL 4.5 core context (" + egl_error() + ")";
    if (context != EGL_NO_CONTEXT) eglDestroyContext(display, context);
    eglTerminate(display);
  }
  throw GlError("no OpenGL context" +
                (tried.empty()
                     ? std::string("; EGL offers neither a device nor Mesa's surfaceless platform")
                     : tried) +
                ". Install Mesa (libegl1 libgl1-mesa-dri) or the GPU's driver.");
}

GlContext::~GlContext() {
  eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroyContext(display_, context_);
}

bool GlContext::is_software() const {
  return renderer_.find("llvmpipe") != std::string::npos ||
         renderer_.find("softpipe") != std::string::npos;
}

}  // namespace fivepipe::gl
