// Draws particles as balls: each is a point whose pixels show the ball's surface.
#pragma once
#include <span>
#include <vector>

#include "common/config/objects/particle_source.h"
#include "common/gl/objects.h"

namespace fivepipe::render {

// The particles of one source of the scene.
struct ParticleCloud {
  std::size_t source = 0;        // position in the scene's particles
  std::vector<float> p_world_m;  // x y z per particle
};

// Needs a current GL context from construction to destruction.
class ParticlePoints {
 public:
  // features: the #define lines of its shader program.
  explicit ParticlePoints(const std::string& features);
  // The caller sets the view (shaders/particle.vert).
  const gl::GlProgram& program() const { return program_; }
  // Draws balls around these centers (x y z each) into the bound framebuffer. focal_px: of the
  // view. albedo: linear RGB.
  void draw(std::span<const float> p_world_m, double radius_m, double focal_px,
            const Eigen::Vector3f& albedo);

 private:
  gl::GlProgram program_;
  gl::GlBuffer positions_;
  gl::GlVertexArray vertex_array_;
};

}  // namespace fivepipe::render
