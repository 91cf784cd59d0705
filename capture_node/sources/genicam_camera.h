// Finds GenICam cameras by Aravis. Part of the module fivepipe_genicam.so.
#pragma once
#include <arv.h>

#include <memory>
#include <string>
#include <vector>

#include "capture_node/sources/stream_modules.h"

namespace fivepipe::capture {

struct UnrefObject {
  void operator()(void* object) const { g_object_unref(object); }
};
template <class T>
using OwnedObject = std::unique_ptr<T, UnrefObject>;

// An error of Aravis. Passed as its last argument, by out().
class AravisError {
 public:
  AravisError() = default;
  ~AravisError() { g_clear_error(&error_); }
  AravisError(const AravisError&) = delete;
  AravisError& operator=(const AravisError&) = delete;
  // Forgets an earlier error.
  GError** out() {
    g_clear_error(&error_);
    return &error_;
  }
  bool is_set() const { return error_ != nullptr; }
  std::string text() const { return error_ ? error_->message : "unknown reason"; }

 private:
  GError* error_ = nullptr;
};

// Returns the cameras that answer within 1 s, by name, without opening them: their sizes, rates and
// formats are unknown.
std::vector<GenicamCamera> discovered_cameras();

// Opens a camera by its IP address, or by a name, serial number or address that discovery finds.
// Returns null and a reason if there is none, or if the camera does not answer. May take 3 s.
OwnedObject<ArvCamera> opened_camera(const std::string& camera, std::string& why);
// Opens a discovered camera.
OwnedObject<ArvCamera> opened_camera(const GenicamCamera& camera, std::string& why);

}  // namespace fivepipe::capture
