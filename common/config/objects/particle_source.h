// A source of particles in a scene: grains, drops or sparks that fall. The hull and the scene's
// objects stop them.
#pragma once
#include <Eigen/Geometry>
#include <array>
#include <string>

namespace fivepipe::config {

struct ParticleSource {
  std::string name;                  // unique among the scene's sources and objects
  Eigen::AlignedBox3d from_world_m;  // particles start in this box, uniformly distributed
  Eigen::Vector3d velocity_world_m_s = Eigen::Vector3d::Zero();  // at the start
  double spread_m_s = 0;     // radius of the ball of random velocities that is added
  double rate_hz = 0;        // of new particles
  double lifetime_s = 0;     // after which a particle vanishes
  double drag_1_s = 0.1;     // deceleration by air, divided by the velocity
  double radius_m = 0.003;   // a particle's center keeps this distance from surfaces
  double restitution = 0.3;  // ratio of the speeds after and before an impact
  double friction = 0.4;     // Coulomb coefficient
  std::array<double, 3> colour_rgb = {0.8, 0.8, 0.8};  // 0 to 1, sRGB
};

// Maximum number of particles of a source: rate times lifetime. Their message has 2.4 MB.
inline constexpr double kMaxParticles = 200'000;
// Maximum number in the message of a frame: by rounding, a particle may live a step longer.
inline constexpr double kMaxSentParticles = 1.1 * kMaxParticles;
// HullDistance finds the surface up to this distance (hull::kMaxOutside_px, at 2 mm per pixel).
inline constexpr double kMaxParticleRadius_m = 0.016;

}  // namespace fivepipe::config
