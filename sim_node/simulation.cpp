#include "sim_node/simulation.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <tuple>

#include "sim_node/bounce.h"

namespace fivepipe::sim {
namespace {

// Stamps are whole nanoseconds: a step that ends this little after the stamp belongs to it.
constexpr double kStampResolution_s = 1e-9;
// Angle BAC for bouncing objects. With the paper's 10 degrees I and J lie 1 mm apart where a ball
// has entered by 5 mm, less than a pixel's footprint; with 60 degrees 6 mm.
constexpr double kBounceAngle_rad = 1.0471975512;
// Of an object's collision points, so many are looked at for the response.
constexpr std::size_t kPointsForResponse = 4096;
// An object at rest on the hull falls for one or two query periods at most before it is lifted
// again.
constexpr double kRestingPeriods = 2.0;

double radius_m(const geometry::Mesh& mesh) {
  const Eigen::Vector3d center_m = geometry::bounds_m(mesh).center();
  double radius_sq = 0;
  for (const Eigen::Vector3d& v : mesh.vertices_m)
    radius_sq = std::max(radius_sq, (v - center_m).squaredNorm());
  return std::sqrt(radius_sq);
}

// Of a ball: how far under its surface its triangles reach. Other meshes are their own surface.
double flatness_m(const config::SceneObject& object, const geometry::Mesh& mesh) {
  const auto* sphere = std::get_if<config::SphereShape>(&object.shape);
  if (!sphere) return 0;
  double nearest_m = sphere->radius_m;
  for (const auto& [a, b, c] : mesh.triangles)
    nearest_m = std::min(nearest_m,
                         (mesh.vertices_m[a] + mesh.vertices_m[b] + mesh.vertices_m[c]).norm() / 3);
  return sphere->radius_m - nearest_m;
}

// Copies at most max_points of the points, evenly spread over them. The detector keeps its buffer.
std::vector<collision::CollisionPoint> subsample(std::span<const collision::CollisionPoint> points,
                                                 std::size_t max_points) {
  const std::size_t count = points.size();
  if (count <= max_points) return {points.begin(), points.end()};
  std::vector<collision::CollisionPoint> kept;
  kept.reserve(max_points);
  for (std::size_t i = 0; i < max_points; ++i) kept.push_back(points[i * count / max_points]);
  return kept;
}

// Sets the report's result to `found` with at most max_points points; empties found's triangles.
void set_collision(CollisionReport& report, collision::ObjectCollision& found,
                   std::size_t max_points) {
  report.truncated = found.truncated || found.points.size() > max_points;
  report.collision = {.verdict = found.verdict,
                      .triangles = std::move(found.triangles),
                      .undecided = std::move(found.undecided),
                      .points = subsample(found.points, max_points),
                      .truncated = found.truncated,
                      .hull_in_box = found.hull_in_box};
}

// Contacts and responses are computed from every collision point.
bool needs_points(const config::CollisionRequests& requests) {
  return requests.contacts > 0 || requests.response;
}

std::unique_ptr<collision::CollisionDetector> detector_for(const config::SimConfig& config) {
  if (config.collision == config::CollisionBackend::paper)
    return collision::paper_detector(config.window_px, config.viewport_px);
  const collision::DetectionOptions options{
      .eps_m = config.eps_m, .spacing_m = config.spacing_m, .max_points = kPointsForResponse};
  return config.collision == config::CollisionBackend::gl ? collision::gl_detector(options)
                                                          : collision::cpu_detector(options);
}

const config::Scene& checked(const config::Scene& scene, const config::SimConfig& config) {
  if (!(config.step_s > 0 && std::isfinite(config.step_s)))
    throw std::invalid_argument("step_s is not positive and finite");
  if (!(config.threads >= 1)) throw std::invalid_argument("threads is less than one");
  if (!(config.max_points >= 0)) throw std::invalid_argument("max_points is negative");
  if (!(config.eps_m >= collision::kMinEps_m && std::isfinite(config.eps_m)))
    throw std::invalid_argument("eps_m is less than a micrometre, or not finite");
  if (!(config.spacing_m > 0 && std::isfinite(config.spacing_m)))
    throw std::invalid_argument("spacing_m is not positive and finite");
  return scene;
}

}  // namespace

Simulation::Simulation(const config::Scene& scene, const config::SimConfig& config,
                       const Eigen::AlignedBox3d& real_volume_world_m)
    : scene_(checked(scene, config)),
      config_(config),
      bodies_(scene),
      pool_(config.threads),
      detector_(detector_for(config)),
      steps_per_query_(
          std::uint64_t(std::max(1.0, std::round(kHullQueryPeriod_s / config.step_s)))) {
  for (std::size_t i = 0; i < scene_.objects.size(); ++i) {
    const config::SceneObject& object = scene_.objects[i];
    meshes_.emplace_back(config::mesh_of(object));
    const geometry::Mesh& mesh = meshes_.back().mesh();
    radii_m_.push_back(radius_m(mesh));
    flatness_m_.push_back(flatness_m(object, mesh));
    for (const Eigen::Vector3d& v : mesh.vertices_m)
      scene_bounds_m_.extend(object.world_from_object * v);
    if (object.reaction != config::Reaction::none) reacting_.push_back(i);
    if (bounces(i)) bouncing_.push_back(i);
    warmth_.push_back(object.warming ? std::optional<Warmth>(std::in_place, *object.warming,
                                                             mesh.vertices_m.size())
                                     : std::nullopt);
  }
  if (scene_.history) history_.emplace(*scene_.history, real_volume_world_m, pool_);
  scene_bounds_m_ = {scene_bounds_m_.min().array() - kLost_m,
                     scene_bounds_m_.max().array() + kLost_m};
  contacts_.resize(bouncing_.size());
  world_from_objects_before_.resize(scene_.objects.size());
}

bool Simulation::bounces(std::size_t object) const {
  return scene_.objects[object].reaction == config::Reaction::bounce &&
         scene_.objects[object].motion == config::Motion::dynamic;
}

void Simulation::reset() {
  bodies_ = RigidBodies(scene_);
  steps_since_query_ = 0;
  std::fill(world_from_objects_before_.begin(), world_from_objects_before_.end(), std::nullopt);
  for (auto& warmth : warmth_)
    if (warmth) warmth->reset();
}

void Simulation::anchor_at(double time_s) {
  anchor_s_ = time_s;
  steps_since_anchor_ = 0;
  started_ = true;
}

void Simulation::catch_up(double time_s) {
  if (!started_ || paused_) return anchor_at(time_s);
  if (time_s < this->time_s() - kStampResolution_s) {
    ++counters_.backward_stamps;
    if (time_s < this->time_s() - kMaxCatchUp_s) anchor_at(time_s);
    return;
  }
  if (const double gap_s = time_s - this->time_s(); gap_s > kMaxCatchUp_s + config_.step_s) {
    counters_.skipped_s += gap_s - kMaxCatchUp_s;
    anchor_at(time_s - kMaxCatchUp_s);
  }
  while (anchor_s_ + double(steps_since_anchor_ + 1) * config_.step_s <=
         time_s + kStampResolution_s)
    step();
}

void Simulation::set_hull(double time_s, std::span<const hull::Silhouette> silhouettes) {
  proximities_.clear();
  query_ = nullptr;
  own_query_.reset();
  if (history_) {
    history_->add(time_s, silhouettes);
    query_ = &history_->query();
  } else if (!reacting_.empty() || std::any_of(warmth_.begin(), warmth_.end(),
                                               [](const auto& w) { return w.has_value(); })) {
    hull_.assign(silhouettes);
    query_ = &own_query_.emplace(hull_);
  }
  if (query_) detector_->set_hull(*query_, silhouettes);
  is_new_hull_ = true;
}

void Simulation::advance_to(double time_s, std::span<const hull::Silhouette> silhouettes) {
  if (!std::isfinite(time_s)) throw std::invalid_argument("simulation time is not finite");
  set_hull(time_s, silhouettes);
  advance_to(time_s);
}

void Simulation::advance_to(double time_s) {
  if (!std::isfinite(time_s)) throw std::invalid_argument("simulation time is not finite");
  std::fill(contacts_.begin(), contacts_.end(), LastContact{});
  catch_up(time_s);
  report();
}

void Simulation::step() {
  bodies_.step(config_.step_s);
  ++steps_since_anchor_;
  ++counters_.steps;
  respawn_lost_objects();
  if (++steps_since_query_ < steps_per_query_) return;
  steps_since_query_ = 0;
  bounce_off_hull();
}

void Simulation::respawn_lost_objects() {
  for (std::size_t i = 0; i < scene_.objects.size(); ++i) {
    if (scene_.objects[i].motion != config::Motion::dynamic ||
        scene_bounds_m_.contains(bodies_.center_world_m(i)))
      continue;
    bodies_.respawn(i);
    world_from_objects_before_[i].reset();
    ++counters_.respawned;
  }
}

collision::DetectionObject Simulation::detection_object(std::size_t object) const {
  return {&meshes_[object], bodies_.world_from_object(object), bodies_.center_world_m(object)};
}

std::span<collision::ObjectCollision> Simulation::detected(std::span<const std::size_t> objects) {
  std::vector<collision::DetectionObject> asked;
  for (const std::size_t object : objects) asked.push_back(detection_object(object));
  const std::span<collision::ObjectCollision> collisions = detector_->detect(asked);
  counters_.detection = detector_->counts();
  return collisions;
}

void Simulation::bounce_off_hull() {
  if (bouncing_.empty() || !query_) return;
  const std::span<collision::ObjectCollision> collisions = detected(bouncing_);
  std::vector<std::size_t> colliding;
  for (std::size_t i = 0; i < bouncing_.size(); ++i) {
    if (!collisions[i].colliding()) continue;
    ++counters_.contacts;
    contacts_[i] = {{.object = bouncing_[i], .collision = std::move(collisions[i])},
                    detection_object(bouncing_[i])};
    colliding.push_back(i);
  }
  // recover() queries the same detector, which invalidates `collisions`.
  for (const std::size_t i : colliding)
    contacts_[i].report.response = recover(bouncing_[i], contacts_[i].report.collision);
}

collision::Requery Simulation::requery_of(const collision::DetectionObject& object) {
  return [this, object](const Eigen::Vector3d& move_world_m) {
    collision::DetectionObject moved = object;
    moved.world_from_object = Eigen::Translation3d(move_world_m) * moved.world_from_object;
    moved.rp_object_world_m += move_world_m;
    return std::move(detector_->detect({&moved, 1}).front());
  };
}

collision::Response Simulation::recover(std::size_t object, collision::ObjectCollision collision) {
  const double resting_speed_m_s =
      kRestingPeriods * scene_.gravity_m_s2 * std::max(kHullQueryPeriod_s, config_.step_s);
  const collision::ResponseConfig config{.height_m = radii_m_[object],
                                         .apex_angle_rad = kBounceAngle_rad,
                                         .window_px = config_.window_px};
  std::optional<collision::Response> first;
  collision::RecoveryStatus status = collision::RecoveryStatus::still_colliding;
  for (int i = 0; i < kMaxRecoveries && status == collision::RecoveryStatus::still_colliding; ++i) {
    // Over the whole contact: where a ball lies between two parts of the hull, the normal of one
    // camera's border would drive it to one side.
    const collision::ResponseRequest request{.rp_object_world_m = bodies_.center_world_m(object),
                                             .v_rec_world = std::nullopt,
                                             .normals = {.four_points = true, .closed_form = false},
                                             .equally_far_m = flatness_m_[object]};
    const collision::Response response = collision::respond(
        *query_, collision, request, requery_of(detection_object(object)), config);
    status = response.status;
    if (response.has_exit()) {
      const Bounce after =
          bounce(response, bodies_.velocity_m_s(object), scene_.objects[object].restitution,
                 scene_.gravity_m_s2, resting_speed_m_s);
      bodies_.translate(object, after.move_world_m);
      bodies_.set_velocity_m_s(object, after.velocity_world_m_s);
      collision.points = response.remaining_points;
    }
    if (!first) first = response;
  }
  counters_.still_colliding += status == collision::RecoveryStatus::still_colliding;
  counters_.unrecovered += status != collision::RecoveryStatus::still_colliding &&
                           status != collision::RecoveryStatus::recovered;
  return *first;
}

void Simulation::add_details(CollisionReport& report, const collision::ObjectCollision& collision,
                             const collision::DetectionObject& object) {
  add_response(report.details, *query_, collision, object.rp_object_world_m, requery_of(object),
               scene_.objects[report.object].requests);
}

collision::HullProximity& Simulation::proximity_to(double cap_m, double tolerance_m) {
  for (SharedProximity& shared : proximities_)
    if (shared.cap_m == cap_m && shared.tolerance_m == tolerance_m) return *shared.proximity;
  proximities_.push_back({cap_m, tolerance_m,
                          std::make_unique<collision::HullProximity>(
                              *query_, collision::ProximityOptions{cap_m, tolerance_m})});
  return *proximities_.back().proximity;
}

void Simulation::add_proximity() {
  for (CollisionReport& report : reports_)
    if (const auto& asked = scene_.objects[report.object].requests.proximity)
      report.details.proximity = proximity_of(proximity_to(asked->cap_m, asked->tolerance_m),
                                              meshes_[report.object].mesh(),
                                              bodies_.world_from_object(report.object), asked->of);
  const double elapsed_s = double(counters_.steps - steps_warmed_) * config_.step_s;
  steps_warmed_ = counters_.steps;
  for (std::size_t i = 0; i < warmth_.size() && elapsed_s > 0; ++i) {
    if (!warmth_[i]) continue;
    const config::Warming& warming = *scene_.objects[i].warming;
    warmth_[i]->follow(
        elapsed_s, proximity_of(proximity_to(warming.cap_m, warming.tolerance_m), meshes_[i].mesh(),
                                bodies_.world_from_object(i), config::ProximityOf::vertices));
  }
}

void Simulation::add_first_contacts() {
  if (!history_ || !is_new_hull_) return;
  for (CollisionReport& report : reports_) {
    const auto& before = world_from_objects_before_[report.object];
    if (!scene_.objects[report.object].requests.first_contact || !before) continue;
    const auto met = history_->first_contact(
        {&meshes_[report.object], *before, bodies_.world_from_object(report.object)});
    if (met) std::tie(report.details.first_contact, report.details.first_contact_component) = *met;
  }
  for (std::size_t i = 0; i < scene_.objects.size(); ++i)
    world_from_objects_before_[i] = bodies_.world_from_object(i);
}

void Simulation::report() {
  reports_.clear();
  if (!query_) return;
  const std::size_t max_points = std::size_t(config_.max_points);
  const std::span<collision::ObjectCollision> collisions = detected(reacting_);
  struct FullCollision {  // with every point, for add_details()
    std::size_t report;
    collision::ObjectCollision collision;
    collision::DetectionObject object;
  };
  std::vector<FullCollision> full;
  for (std::size_t i = 0; i < reacting_.size(); ++i) {
    const std::size_t object = reacting_[i];
    CollisionReport report{.object = object};
    const auto bouncing = std::find(bouncing_.begin(), bouncing_.end(), object);
    const auto contact = bouncing == bouncing_.end()
                             ? contacts_.end()
                             : contacts_.begin() + (bouncing - bouncing_.begin());
    const bool bounced = contact != contacts_.end() && contact->report.response;
    if (bounced) report = std::move(contact->report);
    report.name = scene_.objects[object].name;
    collision::ObjectCollision& collision = bounced ? report.collision : collisions[i];
    if (collision.colliding() && needs_points(scene_.objects[object].requests))
      full.push_back(
          {i, std::move(collision), bounced ? contact->object : detection_object(object)});
    else
      set_collision(report, collision, max_points);
    reports_.push_back(std::move(report));
  }
  // Requeries of add_details() use the same detector, which invalidates `collisions`.
  for (FullCollision& f : full) {
    add_details(reports_[f.report], f.collision, f.object);
    set_collision(reports_[f.report], f.collision, max_points);
  }
  add_proximity();
  add_first_contacts();
  is_new_hull_ = false;
}

std::vector<ObjectState> Simulation::states() const {
  std::vector<ObjectState> states;
  for (std::size_t i = 0; i < scene_.objects.size(); ++i)
    states.push_back({scene_.objects[i].name,
                      bodies_.world_from_object(i),
                      bodies_.velocity_m_s(i),
                      {},
                      warmth_[i] ? warmth_[i]->vertices() : std::vector<float>{}});
  return states;
}

}  // namespace fivepipe::sim
