// The errors of what the suite draws, beside its times.
#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "benchmarks/render/drawing_times.h"
#include "benchmarks/render/errors/reference_composite.h"
#include "benchmarks/render/errors/registration.h"

namespace fivepipe::render_bench {

struct DrawingErrors {
  nlohmann::ordered_json error = nlohmann::ordered_json::object();  // named numbers
  std::string text;                                                 // of the table
  struct Registration {
    std::string deployment;
    int cameras;  // that give shape
    std::vector<RegistrationStage> stages;
  };
  std::vector<Registration> registrations;  // of variant coloured
};

// Needs a current GL context from construction to destruction.
class SuiteErrors {
 public:
  // deployment: without variants. more_cameras: registration is also that of its rig and actor.
  // quick: of a few frames.
  SuiteErrors(const config::Deployment& deployment, const config::Deployment& more_cameras,
              double latency_ms, bool quick);

  // Returns the wrong pixels of every variant, the edges of shadows if it has any, and of variant
  // `coloured` the avatar's colour and its registration. frames: those that the variant draws.
  DrawingErrors of(const Variant& variant, const std::vector<Frame>& frames);

 private:
  WrongPixels wrong_pixels_of(const Variant& variant, const std::vector<Frame>& frames);
  void add_avatar(DrawingErrors& errors);
  void add_registration(const config::Deployment& deployment, Actor& actor,
                        const std::vector<ActorFrame>& frames, DrawingErrors& errors) const;
  void add_shadows(DrawingErrors& errors);

  config::Deployment deployment_, more_cameras_;
  SurfaceNumbers numbers_;
  double latency_ms_;
  int frame_step_, actor_frames_;
  // By frame; of the first variant, because all variants draw the same objects and hulls.
  std::vector<FrameReference> references_;
};

// The table of registration.
std::string registration_text(const DrawingErrors::Registration& registration);

}  // namespace fivepipe::render_bench
