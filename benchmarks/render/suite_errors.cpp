#include "benchmarks/render/suite_errors.h"

#include <fmt/format.h>

#include <algorithm>
#include <iostream>

#include "benchmarks/render/errors/colour_error.h"
#include "benchmarks/render/errors/shadow_error.h"
#include "common/base/text_table.h"
#include "common/base/timing.h"

namespace fivepipe::render_bench {
namespace {

// Frames of the actor's period, by which its motion passes each side of its path.
constexpr int kActorFrames = 12, kQuickActorFrames = 1;

// All variants have a source of particles, so that they share the numbers of surfaces.
config::Deployment with_a_source(config::Deployment deployment) {
  deployment.scene.particles.resize(std::max<std::size_t>(1, deployment.scene.particles.size()));
  return deployment;
}

double median(const std::vector<double>& values) { return base::percentile(values, 0.5); }
double p95(const std::vector<double>& values) { return base::percentile(values, 0.95); }
double largest(const std::vector<double>& values) { return *std::ranges::max_element(values); }

}  // namespace

SuiteErrors::SuiteErrors(const config::Deployment& deployment,
                         const config::Deployment& more_cameras, double latency_ms, bool quick)
    : deployment_(with_a_source(deployment)),
      more_cameras_(more_cameras),
      numbers_(deployment_.scene),
      latency_ms_(latency_ms),
      frame_step_(quick ? kFrames / 2 : 1),
      actor_frames_(quick ? kQuickActorFrames : kActorFrames) {}

WrongPixels SuiteErrors::wrong_pixels_of(const Variant& variant, const std::vector<Frame>& frames) {
  const config::Scene scene = with_a_source(with(deployment_, variant)).scene;
  ShownSurfaces shown(scene, deployment_.viewer);
  WrongPixels sum;
  for (int f = 0; f < kFrames; f += frame_step_) {
    const Frame& frame = frames[std::size_t(f)];
    const std::size_t index = std::size_t(f / frame_step_);
    if (references_.size() <= index)
      references_.emplace_back(scene, deployment_.viewer, numbers_, frame.hull,
                               silhouettes_of(deployment_, f));
    const auto particles =
        variant.particles ? particles_of(scene, f) : std::vector<render::ParticleCloud>();
    sum += wrong_pixels(
        scene, references_[index], particles,
        shown.of(frame.hull, particles, frame.light_hull ? &*frame.light_hull : nullptr));
  }
  return sum;
}

void SuiteErrors::add_shadows(DrawingErrors& errors) {
  const ShadowErrors shadows = shadow_errors(deployment_.viewer);
  errors.error["shadow_edge_mean_px"] = shadows.of_object.mean_px;
  errors.error["shadow_edge_worst_px"] = shadows.of_object.worst_px;
  errors.error["hull_shadow_edge_mean_px"] = shadows.of_hull.mean_px;
  errors.error["hull_shadow_edge_worst_px"] = shadows.of_hull.worst_px;
  errors.text += fmt::format(
      "; shadow edges {:.2f} px off (worst {:.1f}), the hull's {:.2f} px (worst {:.1f})",
      shadows.of_object.mean_px, shadows.of_object.worst_px, shadows.of_hull.mean_px,
      shadows.of_hull.worst_px);
}

void SuiteErrors::add_avatar(DrawingErrors& errors) {
  Actor actor(deployment_);
  const std::vector<ActorFrame> frames = actor.frames(actor_frames_);
  const std::vector<double> levels = avatar_colour_differences(actor, frames);
  errors.error["colour_median_levels"] = median(levels);
  errors.error["colour_p95_levels"] = p95(levels);
  errors.text +=
      fmt::format("; colour {:.0f} levels off (p95 {:.0f})", median(levels), p95(levels));
  add_registration(deployment_, actor, frames, errors);
  Actor other(more_cameras_);
  add_registration(more_cameras_, other, other.frames(actor_frames_), errors);
}

void SuiteErrors::add_registration(const config::Deployment& deployment, Actor& actor,
                                   const std::vector<ActorFrame>& frames,
                                   DrawingErrors& errors) const {
  errors.registrations.push_back({deployment.name,
                                  int(config::shape_cameras(deployment.rig).size()),
                                  registration(actor, frames, 1e-3 * latency_ms_)});
  for (const RegistrationStage& stage : errors.registrations.back().stages)
    for (const auto& [kind, values_mm] : {std::pair{"outline", &stage.outline_mm},
                                          {"centroid", &stage.centroid_mm},
                                          {"added", &stage.added_mm}}) {
      const std::string name =
          fmt::format("registration_{}_{}_{}", deployment.name, stage.name, kind);
      errors.error[name + "_median_mm"] = median(*values_mm);
      // An outline has many points, but a frame has one centroid.
      const bool is_by_frame = values_mm == &stage.centroid_mm;
      errors.error[name + (is_by_frame ? "_largest_mm" : "_p95_mm")] =
          is_by_frame ? largest(*values_mm) : p95(*values_mm);
    }
}

DrawingErrors SuiteErrors::of(const Variant& variant, const std::vector<Frame>& frames) {
  std::cerr << "bench render: errors of " << variant.name << std::endl;
  DrawingErrors errors;
  const WrongPixels wrong = wrong_pixels_of(variant, frames);
  errors.error["wrong_surface_percent"] = wrong.percent();
  errors.error["wrong_surface_drawing_percent"] = wrong.drawing_percent();
  errors.text = fmt::format("{:.3f} % of pixels show a wrong surface ({:.3f} % by drawing)",
                            wrong.percent(), wrong.drawing_percent());
  if (variant.shadows) add_shadows(errors);
  if (variant.name == "coloured") add_avatar(errors);
  return errors;
}

std::string registration_text(const DrawingErrors::Registration& registration) {
  base::TextTable table({{fmt::format("registration of {}, {} cameras, mm", registration.deployment,
                                      registration.cameras)},
                         {"outline", true},
                         {"p95", true},
                         {"centroid", true},
                         {"largest", true},
                         {"adds", true},
                         {"p95", true},
                         {"drawn"}});
  const auto mm = [](double value) { return base::with_decimals(value, 1); };
  for (const RegistrationStage& stage : registration.stages)
    table.add({stage.name, mm(median(stage.outline_mm)), mm(p95(stage.outline_mm)),
               mm(median(stage.centroid_mm)), mm(largest(stage.centroid_mm)),
               mm(median(stage.added_mm)), mm(p95(stage.added_mm)), stage.text});
  return table.text();
}

}  // namespace fivepipe::render_bench
