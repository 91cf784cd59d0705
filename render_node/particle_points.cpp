#include "render_node/particle_points.h"

#include "common/gl/shader_source.h"
#include "render_node/shaders/shaders_embedded.h"

namespace fivepipe::render {

ParticlePoints::ParticlePoints(const std::string& features)
    : program_("particles", gl::with_defines(shaders::kParticleVert, features),
               gl::with_defines(shaders::kParticleFrag, features)) {
  vertex_array_.attribute(0, positions_, 3, 3 * sizeof(float), 0);
}

void ParticlePoints::draw(std::span<const float> p_world_m, double radius_m, double focal_px,
                          const Eigen::Vector3f& albedo) {
  positions_.upload(p_world_m.data(), p_world_m.size_bytes(), GL_STREAM_DRAW);
  program_.use();
  program_.set("radius_m", float(radius_m));
  program_.set("focal_px", float(focal_px));
  program_.set("albedo", albedo);
  vertex_array_.bind();
  glEnable(GL_PROGRAM_POINT_SIZE);
  glDrawArrays(GL_POINTS, 0, GLsizei(p_world_m.size() / 3));
  glDisable(GL_PROGRAM_POINT_SIZE);
}

}  // namespace fivepipe::render
