#include "benchmarks/render/errors/registration.h"

#include <fmt/format.h>

#include <stdexcept>

namespace fivepipe::render_bench {
namespace {

using Eigen::Vector3d;

void require_in_all_images(const ActorFrame& frame, const ShownShape& shape,
                           const geometry::Camera& eye,
                           std::span<const hull::Silhouette> silhouettes) {
  for (const OutlinePoint& point : shape.outline) {
    const geometry::Ray ray = geometry::ray_through(eye, point.at_px);
    const Vector3d p_m = ray.origin_world_m + point.depth_m * ray.direction_world;
    for (const hull::Silhouette& silhouette : silhouettes)
      if (!is_in_image(silhouette.camera, p_m))
        throw std::runtime_error(
            fmt::format("frame {}: a camera does not see the whole object, so the registration of "
                        "its hull is not defined",
                        frame.frame));
  }
}

void add(std::vector<double>& to, const std::vector<double>& values) {
  to.insert(to.end(), values.begin(), values.end());
}

// Adds a frame to a stage. `before`: what the stage before draws, or the true object.
void add_frame(RegistrationStage& stage, const ShownShape& drawn, const ShownShape& truth,
               const ShownShape& before, double focal_px) {
  add(stage.outline_mm, outline_distances_mm(drawn, truth, focal_px));
  add(stage.added_mm, outline_distances_mm(drawn, before, focal_px));
  stage.centroid_mm.push_back(centroid_distance_mm(drawn, truth, focal_px));
}

}  // namespace

std::vector<hull::Capsule> moved_in_view(std::vector<hull::Capsule> object,
                                         const Eigen::Isometry3d& eye_from_world, double by_m) {
  const Vector3d motion_m = by_m * eye_from_world.linear().row(0).transpose();
  for (hull::Capsule& capsule : object) {
    capsule.a_world_m += motion_m;
    capsule.b_world_m += motion_m;
  }
  return object;
}

std::vector<RegistrationStage> registration(Actor& actor, std::span<const ActorFrame> frames,
                                            double latency_s) {
  std::vector<RegistrationStage> stages = {
      {"renderer", "the true object's depth, drawn", {}, {}, {}},
      {"hull", "hull of exact silhouettes", {}, {}, {}},
      {"map", "hull of the segmented maps: registration at rest", {}, {}, {}},
      {"latency",
       fmt::format("at {} m/s with {:.1f} ms", kSpeed_m_s, 1e3 * latency_s),
       {},
       {},
       {}}};
  const config::Viewer& viewer = actor.deployment().viewer;
  const double focal_px = config::render_pinhole(viewer).fx_px;
  AvatarRenderer renderer(viewer);
  for (const ActorFrame& frame : frames) {
    const hull::View view = recon_view(viewer, frame);
    const geometry::Camera eye{config::render_pinhole(viewer), frame.eye_from_world};
    const ShownShape truth = true_shape(frame.object, eye);
    const CameraImages exact{actor.exact_silhouettes(frame.object), {}},
        captured{actor.captured(frame).silhouettes, {}};
    require_in_all_images(frame, truth, eye, exact.silhouettes);
    const auto drawn = [&](const render::HullFrame& hull) { return shape_of(renderer.draw(hull)); };
    const ShownShape object = drawn(true_surface(frame.object, view)),
                     hull = drawn(reconstructed(exact, view)),
                     map = drawn(reconstructed(captured, view));
    add_frame(stages[0], object, truth, truth, focal_px);
    add_frame(stages[1], hull, truth, object, focal_px);
    add_frame(stages[2], map, truth, hull, focal_px);
    const ShownShape later =
        true_shape(moved_in_view(frame.object, frame.eye_from_world, kSpeed_m_s * latency_s), eye);
    add(stages[3].outline_mm, outline_distances_mm(map, later, focal_px));
    add(stages[3].added_mm, outline_distances_mm(truth, later, focal_px));
    stages[3].centroid_mm.push_back(centroid_distance_mm(map, later, focal_px));
  }
  return stages;
}

}  // namespace fivepipe::render_bench
