// A virtual X server and a keyboard for the tests of windows.
#pragma once
#include <dlfcn.h>
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <string>

extern char** environ;

namespace fivepipe::test {

// Runs a virtual X server during a test and sets DISPLAY to it. display() is empty if Xvfb is not
// installed. Only one runs at a time: a server that ends removes the socket of its display number,
// which another one may just have created.
class VirtualDisplay {
 public:
  VirtualDisplay() {
    lock_ = open(("/tmp/fivepipe_test_display." + std::to_string(getuid())).c_str(),
                 O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (lock_ >= 0) flock(lock_, LOCK_EX);
    int ends[2];
    if (pipe(ends) != 0) return;
    const std::string fd = std::to_string(ends[1]);
    const char* arguments[] = {"Xvfb", "-displayfd",  fd.c_str(),  "-noreset", "-screen",
                               "0",    "1024x768x24", "-nolisten", "tcp",      nullptr};
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addclose(&actions, ends[0]);
    posix_spawn_file_actions_addopen(&actions, 2, "/dev/null", 1, 0);
    if (posix_spawnp(&process_, "Xvfb", &actions, nullptr, const_cast<char**>(arguments),
                     environ) != 0)
      process_ = 0;
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    // Xvfb writes the newline separately; closing the pipe before it arrives would stop the server.
    std::string number;
    for (char c = 0; process_ && c != '\n' && read(ends[0], &c, 1) == 1;) number += c;
    close(ends[0]);
    if (!number.empty()) display_ = ":" + std::to_string(std::atoi(number.c_str()));
    setenv("DISPLAY", display_.c_str(), 1);
  }
  ~VirtualDisplay() {
    if (process_) {
      kill(process_, SIGTERM);
      waitpid(process_, nullptr, 0);
    }
    if (lock_ >= 0) close(lock_);
  }
  const std::string& display() const { return display_; }

 private:
  int lock_ = -1;
  pid_t process_ = 0;
  std::string display_;
};

// Sends key events to every window of the display, as a user would. Uses the X library that GLFW
// loads, without its headers.
class Keyboard {
 public:
  static constexpr int kPress = 2, kRelease = 3;

  static constexpr unsigned kShift = 1;

  void send(int event, unsigned long key_symbol, unsigned modifiers = 0) {
    const auto root = call<unsigned long>("XDefaultRootWindow", display_);
    unsigned long ignored = 0, *windows = nullptr;
    unsigned count = 0;
    call<int>("XQueryTree", display_, root, &ignored, &ignored, &windows, &count);
    for (unsigned i = 0; i < count; ++i) {
      KeyEvent key{};
      key.type = event;
      key.display = display_;
      key.window = windows[i];
      key.root = root;
      key.time = ++time_;
      key.state = modifiers;
      key.keycode = call<unsigned char>("XKeysymToKeycode", display_, key_symbol);
      long padded[24] = {};  // an XEvent
      static_assert(sizeof(KeyEvent) <= sizeof(padded));
      std::memcpy(padded, &key, sizeof(key));
      call<int>("XSendEvent", display_, windows[i], 0, 0L, padded);
    }
    call<int>("XFree", windows);
    call<int>("XSync", display_, 0);
  }
  Keyboard() { display_ = call<void*>("XOpenDisplay", static_cast<const char*>(nullptr)); }
  ~Keyboard() { call<int>("XCloseDisplay", display_); }

 private:
  struct KeyEvent {  // XKeyEvent
    int type;
    unsigned long serial;
    int send_event;
    void* display;
    unsigned long window, root, subwindow, time;
    int x, y, x_root, y_root;
    unsigned state, keycode;
    int same_screen;
  };
  template <class Result, class... Arguments>
  Result call(const char* function, Arguments... arguments) {
    return reinterpret_cast<Result (*)(Arguments...)>(dlsym(library_, function))(arguments...);
  }
  void* library_ = dlopen("libX11.so.6", RTLD_NOW);
  void* display_ = nullptr;
  unsigned long time_ = 0;
};

}  // namespace fivepipe::test
