// The choice of an EGL display. A scripted EGL replaces the functions to which epoxy points.
#include "common/gl/context.h"

#include <epoxy/egl.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace fivepipe::gl {
namespace {

constexpr std::uintptr_t kSurfaceless = 200;

// EGL with the devices 1 to `devices`. Device d has the display 100 + d, which has the context
// 1100 + d. The surfaceless platform has the display 200 and the context 1200.
struct ScriptedEgl {
  const char* extensions =
      "EGL_EXT_device_enumeration EGL_EXT_platform_device EGL_MESA_platform_surfaceless";
  int devices = 0;
  bool lists_devices = true, binds_api = true;
  // Displays and contexts of which a call fails.
  std::vector<std::uintptr_t> software, without_display, uninitialised, without_context,
      without_reset_notification, not_current;
  std::vector<std::string> calls;
  EGLint error = EGL_SUCCESS;

  bool succeeds(const std::vector<std::uintptr_t>& failing, std::uintptr_t id, EGLint code) {
    const bool fails = std::find(failing.begin(), failing.end(), id) != failing.end();
    if (fails) error = code;
    return !fails;
  }
};
ScriptedEgl* egl = nullptr;

std::uintptr_t id_of(const void* handle) { return reinterpret_cast<std::uintptr_t>(handle); }
void* handle_of(std::uintptr_t id) { return reinterpret_cast<void*>(id); }
void note(const std::string& call, const void* handle) {
  egl->calls.push_back(call + ' ' + std::to_string(id_of(handle)));
}

class ScriptedContext : public testing::Test {
 protected:
  ScriptedContext() {
    egl = &egl_;
    replace(epoxy_eglQueryString, [](EGLDisplay display, EGLint name) -> const char* {
      return display == EGL_NO_DISPLAY && name == EGL_EXTENSIONS ? egl->extensions : nullptr;
    });
    replace(epoxy_eglQueryDevicesEXT,
            [](EGLint max, EGLDeviceEXT* devices, EGLint* count) -> EGLBoolean {
              *count = std::min(max, egl->devices);
              for (EGLint i = 0; i < *count; ++i) devices[i] = handle_of(std::uintptr_t(i) + 1);
              return egl->lists_devices;
            });
    replace(epoxy_eglQueryDeviceStringEXT, [](EGLDeviceEXT device, EGLint) -> const char* {
      return egl->succeeds(egl->software, id_of(device), EGL_SUCCESS)
                 ? "EGL_EXT_device_drm EGL_MESA_device_software_not"
                 : "EGL_EXT_device_query EGL_MESA_device_software";
    });
    replace(epoxy_eglGetPlatformDisplayEXT,
            [](EGLenum platform, void* device, const EGLint*) -> EGLDisplay {
              const std::uintptr_t id =
                  platform == EGL_PLATFORM_DEVICE_EXT ? 100 + id_of(device) : kSurfaceless;
              return egl->succeeds(egl->without_display, id, EGL_BAD_PARAMETER) ? handle_of(id)
                                                                                : EGL_NO_DISPLAY;
            });
    replace(epoxy_eglInitialize, [](EGLDisplay display, EGLint*, EGLint*) -> EGLBoolean {
      note("initialise", display);
      return egl->succeeds(egl->uninitialised, id_of(display), EGL_NOT_INITIALIZED);
    });
    replace(epoxy_eglBindAPI, [](EGLenum) -> EGLBoolean { return egl->binds_api; });
    replace(epoxy_eglCreateContext,
            [](EGLDisplay display, EGLConfig, EGLContext, const EGLint* attributes) -> EGLContext {
              bool notifies = false;
              for (; *attributes != EGL_NONE; attributes += 2)
                notifies |= attributes[0] == EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY &&
                            attributes[1] == EGL_LOSE_CONTEXT_ON_RESET;
              note(notifies ? "create" : "create without notification", display);
              return egl->succeeds(egl->without_context, id_of(display), EGL_BAD_MATCH) &&
                             (!notifies || egl->succeeds(egl->without_reset_notification,
                                                         id_of(display), EGL_BAD_ATTRIBUTE))
                         ? handle_of(1000 + id_of(display))
                         : EGL_NO_CONTEXT;
            });
    replace(epoxy_eglMakeCurrent,
            [](EGLDisplay, EGLSurface, EGLSurface, EGLContext context) -> EGLBoolean {
              note("make current", context);
              return egl->succeeds(egl->not_current, id_of(context), EGL_BAD_ACCESS);
            });
    replace(epoxy_eglDestroyContext, [](EGLDisplay, EGLContext context) -> EGLBoolean {
      note("destroy", context);
      return EGL_TRUE;
    });
    replace(epoxy_eglTerminate, [](EGLDisplay display) -> EGLBoolean {
      note("terminate", display);
      return EGL_TRUE;
    });
    replace(epoxy_eglGetError, []() -> EGLint { return std::exchange(egl->error, EGL_SUCCESS); });
  }
  ~ScriptedContext() override {
    for (const auto& restore : restore_) restore();
    egl = nullptr;
  }

  // Returns what the constructor's error says between its first and its last words.
  static std::string error() {
    try {
      const GlContext context;
    } catch (const GlError& failed) {
      const std::string text = failed.what(), begin = "no OpenGL context; ",
                        end = ". Install Mesa (libegl1 libgl1-mesa-dri) or the GPU's driver.";
      EXPECT_TRUE(text.starts_with(begin) && text.ends_with(end)) << text;
      if (text.size() < begin.size() + end.size()) return text;
      return text.substr(begin.size(), text.size() - begin.size() - end.size());
    }
    return "no error";
  }

  ScriptedEgl egl_;

 private:
  template <class Function>
  void replace(Function& function, std::type_identity_t<Function> by) {
    restore_.push_back([&function, before = function] { function = before; });
    function = by;
  }
  std::vector<std::function<void()>> restore_;
};

TEST_F(ScriptedContext, TriesHardwareDevicesThenSurfacelessAndNamesEachFailure) {
  egl_.devices = 5;
  egl_.uninitialised = {101, 103};
  egl_.software = {2};
  egl_.without_context = {104, kSurfaceless};
  egl_.not_current = {1105};
  EXPECT_EQ(error(),
            "EGL device 0: no display (0x3001); EGL device 2: no display (0x3001); "
            "EGL device 3: no OpenGL 4.5 core context (0x3009); "
            "EGL device 4: no OpenGL 4.5 core context (0x3002); "
            "Mesa surfaceless: no OpenGL 4.5 core context (0x3009)");
  EXPECT_EQ(egl_.calls,
            (std::vector<std::string>{
                "initialise 101", "initialise 103", "initialise 104", "create 104",
                "create without notification 104", "terminate 104", "initialise 105", "create 105",
                "make current 1105", "destroy 1105", "terminate 105", "initialise 200",
                "create 200", "create without notification 200", "terminate 200"}));
}

// Not every driver reports a reset of the GPU.
TEST_F(ScriptedContext, NeedsNoNotificationOfResets) {
  egl_.devices = 1;
  egl_.without_reset_notification = {101};
  egl_.not_current = {1101};
  egl_.uninitialised = {kSurfaceless};
  error();
  EXPECT_EQ(egl_.calls,
            (std::vector<std::string>{"initialise 101", "create 101",
                                      "create without notification 101", "make current 1101",
                                      "destroy 1101", "terminate 101", "initialise 200"}));
}

TEST_F(ScriptedContext, NeedsBothExtensionsOfDevicesAsWholeWords) {
  egl_.devices = 1;
  egl_.uninitialised = {101, kSurfaceless};
  const std::string nothing = "EGL offers neither a device nor Mesa's surfaceless platform";
  for (const char* extensions :
       {"EGL_EXT_device_enumeration", "EGL_EXT_platform_device",
        "EGL_EXT_device_enumeration EGL_EXT_platform_device_x",
        "xEGL_EXT_device_enumeration EGL_EXT_platform_device", "EGL_MESA_platform_surfaceless2", "",
        static_cast<const char*>(nullptr)}) {
    egl_.extensions = extensions;
    EXPECT_EQ(error(), nothing) << (extensions ? extensions : "no text");
  }
  egl_.extensions = "EGL_EXT_platform_device EGL_KHR_x EGL_EXT_device_enumeration";
  EXPECT_EQ(error(), "EGL device 0: no display (0x3001)");
}

TEST_F(ScriptedContext, SkipsADeviceWithoutADisplay) {
  egl_.devices = 1;
  egl_.without_display = {101};
  egl_.uninitialised = {kSurfaceless};
  const std::string text = error();
  EXPECT_TRUE(text.starts_with("EGL device 0: no display (0x")) << text;
  EXPECT_EQ(egl_.calls, std::vector<std::string>{"initialise 200"});
}

TEST_F(ScriptedContext, UsesNoDeviceIfTheirListFails) {
  egl_.devices = 3;
  egl_.lists_devices = false;
  egl_.uninitialised = {101, 102, 103, kSurfaceless};
  EXPECT_EQ(error(), "Mesa surfaceless: no display (0x3001)");
}

TEST_F(ScriptedContext, CreatesNoContextWithoutTheOpenGlApi) {
  egl_.binds_api = false;
  EXPECT_EQ(error(), "Mesa surfaceless: no OpenGL 4.5 core context (0x3000)");
  EXPECT_EQ(egl_.calls, (std::vector<std::string>{"initialise 200", "terminate 200"}));
}

}  // namespace
}  // namespace fivepipe::gl
