#include "sim_node/messages.h"

namespace fivepipe::sim {

const fivepipe_v1_VirtualState& OutgoingState::message() {
  for (std::size_t i = 0; i < objects.size(); ++i) {
    messages::borrow(objects[i].vertices_m, vertices_m[i]);
    messages::borrow(objects[i].warmth, warmth[i]);
  }
  messages::borrow(header.objects, objects);
  return header;
}

OutgoingState state_message(const std::string& simulation, std::uint64_t frame,
                            std::int64_t capture_stamp_ns, double simulation_time_s,
                            const config::Scene& scene, const std::vector<ObjectState>& states) {
  OutgoingState out;
  messages::set_text(out.header.simulation, simulation);
  out.header.frame = frame;
  out.header.capture_stamp_ns = capture_stamp_ns;
  out.header.simulation_time_s = simulation_time_s;
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (scene.objects[i].motion == config::Motion::fixed && !scene.objects[i].spacing &&
        states[i].vertices_m.empty() && states[i].warmth.empty())
      continue;
    fivepipe_v1_ObjectState& object = out.objects.emplace_back();
    messages::set_text(object.object, states[i].name);
    object.world_from_object = messages::to_wire(states[i].world_from_object);
    out.warmth.push_back(states[i].warmth);
    std::vector<float>& vertices = out.vertices_m.emplace_back();
    for (const Eigen::Vector3d& v : states[i].vertices_m)
      vertices.insert(vertices.end(), {float(v.x()), float(v.y()), float(v.z())});
  }
  return out;
}

const fivepipe_v1_Particles& OutgoingParticles::message() {
  messages::borrow(header.p_m, p_m);
  return header;
}

OutgoingParticles particles_message(const std::string& source, std::uint64_t frame,
                                    std::int64_t capture_stamp_ns, const ParticleSet& particles) {
  OutgoingParticles out;
  messages::set_text(out.header.source, source);
  out.header.frame = frame;
  out.header.capture_stamp_ns = capture_stamp_ns;
  out.p_m.reserve(3 * particles.size());
  for (const Eigen::Vector3d& p : particles.p_world_m)
    out.p_m.insert(out.p_m.end(), {float(p.x()), float(p.y()), float(p.z())});
  return out;
}

const fivepipe_v1_SimulationMetrics& OutgoingMetrics::message() {
  messages::borrow(header.bodies, bodies);
  messages::borrow(header.cloths, cloths);
  messages::borrow(header.particles, particles);
  return header;
}

OutgoingMetrics metrics_message(const std::string& simulation, std::uint64_t frame,
                                std::int64_t capture_stamp_ns, double simulation_time_s,
                                const SimulationMetrics& metrics) {
  OutgoingMetrics out;
  messages::set_text(out.header.simulation, simulation);
  out.header.frame = frame;
  out.header.capture_stamp_ns = capture_stamp_ns;
  out.header.simulation_time_s = simulation_time_s;
  if (const auto& of = metrics.bodies)
    out.bodies.push_back({.bodies = std::uint32_t(of->bodies),
                          .kinetic_j = of->energy.kinetic_j,
                          .potential_j = of->energy.potential_j,
                          .hull_contacts = std::uint32_t(of->hull.count),
                          .body_contacts = std::uint32_t(of->each_other.pairs),
                          .deepest_in_hull_m = of->hull.deepest_m,
                          .deepest_in_body_m = of->each_other.deepest_m});
  if (const auto& of = metrics.cloths)
    out.cloths.push_back({.cloths = std::uint32_t(of->cloths),
                          .kinetic_j = of->energy.kinetic_j,
                          .potential_j = of->energy.potential_j,
                          .hull_contacts = std::uint32_t(of->hull.count),
                          .deepest_in_hull_m = of->hull.deepest_m});
  if (const auto& of = metrics.particles)
    out.particles.push_back({.particles = std::uint32_t(of->particles),
                             .hull_contacts = std::uint32_t(of->hull_contacts)});
  return out;
}

void apply(const fivepipe_v1_Command& command, const std::string& node, Simulation& simulation) {
  if (command.target[0] != '\0' && node != command.target) return;
  switch (command.kind) {
    case fivepipe_v1_reset_simulation: return simulation.reset();
    case fivepipe_v1_pause_simulation: return simulation.pause();
    case fivepipe_v1_resume_simulation: return simulation.resume();
  }
}

}  // namespace fivepipe::sim
