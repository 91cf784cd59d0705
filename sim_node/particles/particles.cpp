#include "sim_node/particles/particles.h"

namespace fivepipe::sim {

Particles::Particles(const config::Scene& scene, const ObjectModels& models,
                     const MovingObjects& rigid, const ClothObjects* cloths,
                     const Eigen::AlignedBox3d& within_world_m)
    : gravity_m_s2_(scene.gravity_m_s2),
      within_world_m_(within_world_m),
      objects_(models, rigid, cloths) {
  for (std::size_t i = 0; i < scene.particles.size(); ++i)
    sources_.push_back({scene.particles[i], ParticleEmitter(scene.particles[i], i)});
}

void Particles::reset() {
  for (Source& of : sources_) {
    of.emitter.reset();
    of.particles = {};
  }
  objects_.reset();
  hull_contacts_ = 0;
}

std::size_t Particles::count() const {
  std::size_t count = 0;
  for (const Source& of : sources_) count += of.particles.size();
  return count;
}

void Particles::step(double step_s, std::uint64_t steps_left, const CurrentHull& hull,
                     double before_s) {
  objects_.begin();
  const std::uint64_t contacts_before = counters_.contacts;
  if (hull.query()) hull_.begin(hull, step_s, before_s);
  for (Source& of : sources_) {
    fly(of.particles, step_s, gravity_m_s2_, of.source.drag_1_s);
    of.emitter.step(step_s, of.particles);
    objects_.step(of.source, of.particles);
    if (hull.query()) {
      counters_.contacts += hull_.step(of.source, of.particles);
      if (steps_left == 1) counters_.stuck += hull_.leave(*hull.query(), of.particles);
    }
    remove_old(of);
  }
  hull_contacts_ = counters_.contacts - contacts_before;
}

void Particles::remove_old(Source& of) {
  for (std::size_t i = of.particles.size(); i-- > 0;) {  // remove() moves a later particle here
    const Eigen::Vector3d& p_m = of.particles.p_world_m[i];
    counters_.not_finite += !p_m.allFinite();
    if (!within_world_m_.contains(p_m) || of.particles.age_s[i] >= of.source.lifetime_s)
      of.particles.remove(i);
  }
}

}  // namespace fivepipe::sim
