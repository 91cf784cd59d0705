#include "sim_node/simulation/simulation.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace fivepipe::sim {
namespace {

const config::Scene& checked(const config::Scene& scene, const config::SimConfig& config) {
  if (!(config.step_s > 0 && std::isfinite(config.step_s)))
    throw std::invalid_argument("step_s is not positive and finite");
  if (!(config.threads >= 1)) throw std::invalid_argument("threads is less than 1");
  if (!(config.max_points >= 0)) throw std::invalid_argument("max_points is negative");
  if (!(config.eps_m >= collision::kMinEps_m && std::isfinite(config.eps_m)))
    throw std::invalid_argument("eps_m is less than 1 um or not finite");
  if (!(config.spacing_m > 0 && std::isfinite(config.spacing_m)))
    throw std::invalid_argument("spacing_m is not positive and finite");
  return scene;
}

bool is_cloth(const config::SceneObject& object) { return object.motion == config::Motion::cloth; }

// Whether a particle or a cloth may meet rigid objects.
bool needs_moving_objects(const config::Scene& scene) {
  return !scene.particles.empty() ||
         std::any_of(scene.objects.begin(), scene.objects.end(), [](const auto& object) {
           return is_cloth(object) && object.cloth->object_collision;
         });
}

// The box of the scene's start, kLost_m larger.
Eigen::AlignedBox3d scene_bounds_m(const config::Scene& scene, const ObjectModels& models) {
  Eigen::AlignedBox3d box_m = models.start_bounds_m;
  for (const config::ParticleSource& source : scene.particles) box_m.extend(source.from_world_m);
  return {box_m.min().array() - kLost_m, box_m.max().array() + kLost_m};
}

}  // namespace

Simulation::Simulation(const config::Scene& scene, const config::SimConfig& config,
                       const Eigen::AlignedBox3d& real_volume_world_m, std::function<bool()> stop)
    : scene_(checked(scene, config)),
      config_(config),
      models_(object_models(scene_)),
      bodies_(scene_),
      hull_(scene_, config_,
            !models_.reacting.empty() || !models_.touching.empty() || !scene_.particles.empty() ||
                warms_objects(scene_),
            real_volume_world_m),
      clock_(config.step_s),
      contact_(scene_, config_, models_, bodies_, hull_),
      proximity_(scene_, models_, bodies_, config.step_s),
      scene_bounds_m_(scene_bounds_m(scene_, models_)),
      stop_(std::move(stop)) {
  for (const config::SceneObject& object : scene_.objects)
    spacings_m_.push_back(object.spacing ? object.spacing->at_m : 0);
  if (needs_moving_objects(scene_)) moving_.emplace(scene_, models_, bodies_);
  if (std::any_of(scene_.objects.begin(), scene_.objects.end(), is_cloth))
    cloths_.emplace(scene_, moving_ ? &*moving_ : nullptr);
  if (!models_.touching.empty()) manifolds_.emplace(scene_, models_, bodies_, hull_);
  if (!scene_.particles.empty())
    particles_.emplace(scene_, models_, *moving_, cloths_ ? &*cloths_ : nullptr, scene_bounds_m_);
}

void Simulation::reset() {
  bodies_ = RigidBodies(scene_);
  for (std::size_t i = 0; i < scene_.objects.size(); ++i)
    if (scene_.objects[i].spacing) place(i);
  contact_.reset();
  if (manifolds_) manifolds_->reset();
  if (hull_.history()) hull_.history()->forget_poses();
  proximity_.reset_warmth();
  if (moving_) moving_->reset();
  if (cloths_) cloths_->reset();
  if (particles_) particles_->reset();
}

void Simulation::set_spacing(std::size_t object, double spacing_m) {
  if (object >= scene_.objects.size() || !scene_.objects[object].spacing)
    throw std::invalid_argument("the object has no spacing");
  if (!scene_.objects[object].spacing->permits(spacing_m))
    throw std::invalid_argument("the spacing is outside of the object's range_m");
  if (spacing_m == spacings_m_[object]) return;
  spacings_m_[object] = spacing_m;
  place(object);
}

// From the scene's pose, so that the pose does not depend on earlier spacings. moving_ is not told
// of a jump, so that the object pushes particles and cloths on its way.
void Simulation::place(std::size_t object) {
  bodies_.respawn(object);
  bodies_.translate(object, scene_.objects[object].spacing->move_world_m(spacings_m_[object]));
  if (hull_.history()) hull_.history()->forget_pose(object);
}

bool Simulation::advance_to(double time_s, std::span<const hull::Silhouette> silhouettes,
                            std::span<const hull::CoverageOutline> outlines) {
  if (!std::isfinite(time_s)) throw std::invalid_argument("simulation time is not finite");
  proximity_.clear();
  hull_.set(time_s, silhouettes, outlines);
  return advance(time_s, true);
}

bool Simulation::advance_to(double time_s) {
  if (!std::isfinite(time_s)) throw std::invalid_argument("simulation time is not finite");
  return advance(time_s, false);
}

bool Simulation::advance(double time_s, bool is_new_hull) {
  for (std::uint64_t steps = clock_.advance_to(time_s); steps > 0; --steps) {
    if (stop_()) return false;
    step(steps);
  }
  refit_cloths();
  report(is_new_hull);
  return true;
}

void Simulation::step(std::uint64_t steps_left) {
  step_bodies(steps_left);
  ++steps_;
  respawn_lost_objects();
  contact_.after_step();
  if (moving_) moving_->begin_step();
  const double end_before_hull_s = before_hull_s(steps_left) - config_.step_s;
  if (cloths_) step_cloths(steps_left, end_before_hull_s);
  if (particles_) particles_->step(config_.step_s, steps_left, hull_, end_before_hull_s);
}

void Simulation::step_bodies(std::uint64_t steps_left) {
  if (!manifolds_) return bodies_.step(config_.step_s);
  bodies_.step(config_.step_s, manifolds_->before_step(config_.step_s, before_hull_s(steps_left)));
  manifolds_->after_step();
}

void Simulation::step_cloths(std::uint64_t steps_left, double end_before_hull_s) {
  const std::uint64_t reset = cloths_->counters().reset;
  cloths_->step(config_.step_s, steps_left, hull_, end_before_hull_s);
  if (!particles_ || cloths_->counters().reset == reset) return;
  for (const std::size_t object : cloths_->objects()) particles_->forget(object);
}

double Simulation::before_hull_s(std::uint64_t steps_left) const {
  return hull_.time_s() - (clock_.time_s() - double(steps_left) * config_.step_s);
}

// Reports and proximity read the cloths' shapes from their trees.
void Simulation::refit_cloths() {
  if (!cloths_) return;
  for (std::size_t i = 0; i < cloths_->objects().size(); ++i)
    models_.objects[cloths_->objects()[i]].bvh.refit(cloths_->vertices_object_m(i));
}

void Simulation::respawn_lost_objects() {
  for (std::size_t i = 0; i < scene_.objects.size(); ++i) {
    if (scene_.objects[i].motion != config::Motion::dynamic ||
        scene_bounds_m_.contains(bodies_.center_world_m(i)))
      continue;
    bodies_.respawn(i);
    if (manifolds_) manifolds_->forget(i);
    if (moving_) moving_->forget(i);
    if (hull_.history()) hull_.history()->forget_pose(i);
    ++respawned_;
  }
}

void Simulation::report(bool is_new_hull) {
  reports_ = collision_reports({scene_, models_, bodies_, hull_, contact_, proximity_},
                               std::size_t(config_.max_points), is_new_hull);
  if (!hull_.query()) return;
  proximity_.warm(*hull_.query(), steps_);
  if (HullHistory* history = hull_.history(); history && is_new_hull)
    for (std::size_t i = 0; i < scene_.objects.size(); ++i)
      history->keep_pose(i, bodies_.world_from_object(i));
}

std::vector<ObjectState> Simulation::states() const {
  std::vector<ObjectState> states;
  for (std::size_t i = 0; i < scene_.objects.size(); ++i)
    states.push_back({scene_.objects[i].name,
                      bodies_.world_from_object(i),
                      bodies_.velocity_m_s(i),
                      {},
                      proximity_.warmth(i)});
  if (cloths_)
    for (std::size_t i = 0; i < cloths_->objects().size(); ++i)
      states[cloths_->objects()[i]].vertices_m = cloths_->vertices_object_m(i);
  return states;
}

const std::vector<collision::TrackedComponent>* Simulation::hull_components() const {
  return hull_.history() ? &hull_.history()->components() : nullptr;
}

SimulationCounters Simulation::counters() const {
  const HullManifolds::Counters manifolds =
      manifolds_ ? manifolds_->counters() : HullManifolds::Counters{};
  return {.steps = steps_,
          .contacts = contact_.counters().contacts + manifolds.contacts,
          .unrecovered = contact_.counters().unrecovered + manifolds.unrecovered,
          .still_colliding = contact_.counters().still_colliding,
          .impacts = manifolds.impacts,
          .respawned = respawned_,
          .cloth = cloths_ ? cloths_->counters() : ClothCounters{},
          .particles = particles_ ? particles_->counters() : ParticleCounters{},
          .backward_stamps = clock_.counters().backward_stamps,
          .skipped_s = clock_.counters().skipped_s,
          .detection = hull_.counts()};
}

SimulationMetrics Simulation::metrics() const {
  SimulationMetrics metrics;
  metrics.bodies =
      body_metrics(scene_, bodies_, contact_.last_query(),
                   manifolds_ ? manifolds_->contacts(before_hull_s(0)) : HullContacts{});
  if (cloths_) metrics.cloths = cloth_metrics(*cloths_, scene_.gravity_m_s2);
  if (particles_)
    metrics.particles = ParticleMetrics{particles_->count(), particles_->hull_contacts()};
  return metrics;
}

}  // namespace fivepipe::sim
