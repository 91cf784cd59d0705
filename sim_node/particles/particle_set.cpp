#include "sim_node/particles/particle_set.h"

#include "common/base/math/splitmix64.h"

namespace fivepipe::sim {

using base::splitmix64;
using Eigen::Vector3d;

void ParticleSet::add(const Vector3d& p_m, const Vector3d& v_m_s, double age) {
  p_world_m.push_back(p_m);
  v_world_m_s.push_back(v_m_s);
  before_world_m.push_back(p_m);
  age_s.push_back(age);
}

void ParticleSet::remove(std::size_t i) {
  const auto take_last = [i](auto& of) {
    of[i] = of.back();
    of.pop_back();
  };
  take_last(p_world_m);
  take_last(v_world_m_s);
  take_last(before_world_m);
  take_last(age_s);
}

ParticleEmitter::ParticleEmitter(const config::ParticleSource& source, std::size_t position)
    : source_(source), seed_(splitmix64(position)) {}

void ParticleEmitter::reset() { steps_ = emitted_ = 0; }

double ParticleEmitter::random(std::uint64_t particle, std::uint64_t n) const {
  constexpr double kToUnit = 0x1p-52;  // of the upper 53 bits
  return double(splitmix64(splitmix64(seed_ + particle) + n) >> 11) * kToUnit - 1;
}

void ParticleEmitter::step(double step_s, ParticleSet& particles) {
  ++steps_;
  const double now_s = double(steps_) * step_s;
  for (; (double(emitted_) + 1) / source_.rate_hz <= now_s; ++emitted_) {
    const double age_s = now_s - (double(emitted_) + 1) / source_.rate_hz;
    std::uint64_t n = 0;
    Vector3d p_m;
    for (int axis = 0; axis < 3; ++axis)
      p_m[axis] = source_.from_world_m.center()[axis] +
                  0.5 * source_.from_world_m.sizes()[axis] * random(emitted_, n++);
    Vector3d in_ball = Vector3d::Zero();
    do {
      for (int axis = 0; axis < 3; ++axis) in_ball[axis] = random(emitted_, n++);
    } while (in_ball.squaredNorm() > 1);
    const Vector3d v_m_s = source_.velocity_world_m_s + source_.spread_m_s * in_ball;
    particles.add(p_m + age_s * v_m_s, v_m_s, age_s);
    particles.before_world_m.back() = p_m;
  }
}

void fly(ParticleSet& particles, double step_s, double gravity_m_s2, double drag_1_s) {
  particles.before_world_m = particles.p_world_m;
  for (double& age_s : particles.age_s) age_s += step_s;
  const Vector3d fall_m_s(0, 0, -gravity_m_s2 * step_s);
  // Implicit in the drag, so that any drag is stable.
  const double kept = 1 / (1 + drag_1_s * step_s);
  for (std::size_t i = 0; i < particles.size(); ++i) {
    particles.v_world_m_s[i] = kept * (particles.v_world_m_s[i] + fall_m_s);
    particles.p_world_m[i] += step_s * particles.v_world_m_s[i];
  }
}

}  // namespace fivepipe::sim
