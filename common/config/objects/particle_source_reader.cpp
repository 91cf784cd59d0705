#include "common/config/objects/particle_source_reader.h"

#include <fmt/format.h>

namespace fivepipe::config {
namespace {

constexpr Range kRate_hz{0, 1e6, true};
constexpr Range kLifetime_s{0, 3600, true};
constexpr Range kVelocity_m_s{-100, 100};
constexpr Range kSpread_m_s{0, 100};
constexpr Range kDrag_1_s{0, 1000};
constexpr Range kParticleFriction{0, 10};
constexpr std::size_t kMaxSourceNameLength = 64;  // bound of the name in messages

}  // namespace

ParticleSource read_particle_source(YamlMap map) {
  const std::size_t problems_before = map.problem_count();
  ParticleSource source;
  source.name = map.name("name", {}, kMaxSourceNameLength);
  const Eigen::Vector3d from_m = map.vector3("from_m", kAny), to_m = map.vector3("to_m", kAny);
  source.from_world_m = {from_m.cwiseMin(to_m), from_m.cwiseMax(to_m)};
  source.velocity_world_m_s = map.vector3("velocity_m_s", kVelocity_m_s, source.velocity_world_m_s);
  source.spread_m_s = map.number("spread_m_s", kSpread_m_s, source.spread_m_s);
  source.rate_hz = map.number("rate_hz", kRate_hz);
  source.lifetime_s = map.number("lifetime_s", kLifetime_s);
  source.drag_1_s = map.number("drag_1_s", kDrag_1_s, source.drag_1_s);
  source.radius_m = map.number("radius_m", {0, kMaxParticleRadius_m, true}, source.radius_m);
  source.restitution = map.number("restitution", kUnitRange, source.restitution);
  source.friction = map.number("friction", kParticleFriction, source.friction);
  source.colour_rgb = map.rgb("colour_rgb", source.colour_rgb);
  map.finish();
  const double particles = source.rate_hz * source.lifetime_s;
  if (map.problem_count() == problems_before && !(particles <= kMaxParticles))
    map.problem_at("rate_hz",
                   fmt::format("rate_hz x lifetime_s is {:.6g} particles, at most {:.6g} "
                               "are possible: decrease one of them",
                               particles, kMaxParticles));
  return source;
}

}  // namespace fivepipe::config
