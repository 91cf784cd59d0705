#include "benchmarks/render/errors/shadow_error.h"

#include "render_node/renderer.h"

namespace fivepipe::render_bench {

namespace plate = render::plate_shadow;

ShadowErrors shadow_errors(const config::Viewer& viewer, const Eigen::Vector3d& moved_m) {
  render::HullFrame no_hull;
  no_hull.eye_from_world = plate::eye_from_world();
  no_hull.recon = config::recon_pinhole(viewer);
  const render::HullFrame in_light = plate::occluder_in_light(moved_m);
  const auto drawn = [&](bool with_shadows, bool with_occluder, const render::HullFrame* hull) {
    render::Renderer renderer(plate::scene(with_shadows, with_occluder), viewer);
    renderer.draw(no_hull, {}, {}, {}, hull);
    return renderer.image_bgr();
  };
  const geometry::Pinhole image = config::render_pinhole(viewer);
  return {
      plate::edge_error(drawn(false, true, nullptr), drawn(true, true, nullptr), image, true),
      plate::edge_error(drawn(false, false, nullptr), drawn(true, false, &in_light), image, false)};
}

}  // namespace fivepipe::render_bench
