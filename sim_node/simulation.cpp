#include "sim_node/simulation.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "sim_node/bounce.h"

namespace fivepipe {
namespace {

// Stamps are whole nanoseconds: a step that ends this little after the stamp belongs to it.
constexpr double kStampResolutionS = 1e-9;
// Angle BAC for bouncing objects. With the paper's 10 degrees I and J lie 1 mm apart where a ball has entered by 5 mm, less
// than a pixel's footprint; with 60 degrees 6 mm.
constexpr double kBounceAngleRad = 1.0471975512;
// Of an object's collision points, so many are looked at for the response.
constexpr std::size_t kPointsForResponse = 4096;
// An object at rest on the hull falls for one or two query periods at most before it is lifted again.
constexpr double kRestingPeriods = 2.0;

double radius_m(const Mesh& mesh) {
  const Eigen::Vector3d center_m = bounds_m(mesh).center();
  double radius_sq = 0;
  for (const Eigen::Vector3d& v : mesh.vertices_m) radius_sq = std::max(radius_sq, (v - center_m).squaredNorm());
  return std::sqrt(radius_sq);
}

// Of a ball: how far under its surface its triangles reach. Other meshes are their own surface.
double flatness_m(const SceneObject& object, const Mesh& mesh) {
  const auto* sphere = std::get_if<SphereShape>(&object.shape);
  if (!sphere) return 0;
  double nearest_m = sphere->radius_m;
  for (const auto& [a, b, c] : mesh.triangles) nearest_m = std::min(nearest_m, (mesh.vertices_m[a] + mesh.vertices_m[b] + mesh.vertices_m[c]).norm() / 3);
  return sphere->radius_m - nearest_m;
}

// Evenly, where there are more than `most`.
void thin(std::vector<CollisionPoint>& points, std::size_t most) {
  const std::size_t count = points.size();
  if (count <= most) return;
  for (std::size_t i = 0; i < most; ++i) points[i] = points[i * count / most];
  points.resize(most);
}

const Scene& checked(const Scene& scene, const SimConfig& config) {
  if (!(config.step_s > 0 && std::isfinite(config.step_s))) throw std::invalid_argument("step_s is not positive and finite");
  if (!(config.max_points >= 0)) throw std::invalid_argument("max_points is negative");
  if (!(config.eps_m >= kLeastEps_m && std::isfinite(config.eps_m))) throw std::invalid_argument("eps_m is less than a micrometre, or not finite");
  if (!(config.spacing_m > 0 && std::isfinite(config.spacing_m))) throw std::invalid_argument("spacing_m is not positive and finite");
  return scene;
}

}  // namespace

Simulation::Simulation(const Scene& scene, const SimConfig& config)
    : scene_(checked(scene, config)),
      config_(config),
      bodies_(scene),
      detector_(config.collision == CollisionBackend::cpu
                    ? cpu_detector({.eps_m = config.eps_m, .spacing_m = config.spacing_m, .max_points = kPointsForResponse})
                    : paper_detector(config.window_px, config.viewport_px)),
      steps_per_query_(std::uint64_t(std::max(1.0, std::round(kHullQueryPeriodS / config.step_s)))) {
  for (std::size_t i = 0; i < scene_.objects.size(); ++i) {
    const SceneObject& object = scene_.objects[i];
    meshes_.emplace_back(mesh_of(object));
    const Mesh& mesh = meshes_.back().mesh();
    radii_m_.push_back(radius_m(mesh));
    flatness_m_.push_back(flatness_m(object, mesh));
    for (const Eigen::Vector3d& v : mesh.vertices_m) playground_m_.extend(object.world_from_object * v);
    if (object.reaction != Reaction::none) reacting_.push_back(i);
    if (bounces(i)) bouncing_.push_back(i);
  }
  playground_m_ = {playground_m_.min().array() - kLostM, playground_m_.max().array() + kLostM};
  contacts_.resize(bouncing_.size());
}

bool Simulation::bounces(std::size_t object) const {
  return scene_.objects[object].reaction == Reaction::bounce && scene_.objects[object].motion == Motion::dynamic;
}

void Simulation::reset() {
  bodies_ = RigidBodies(scene_);
  steps_since_query_ = 0;
}

void Simulation::anchor_at(double time_s) {
  anchor_s_ = time_s;
  steps_since_anchor_ = 0;
  started_ = true;
}

void Simulation::catch_up(double time_s) {
  if (!started_ || paused_) return anchor_at(time_s);
  if (time_s < this->time_s() - kStampResolutionS) {
    ++counters_.stamps_went_back;
    if (time_s < this->time_s() - kMaxCatchUpS) anchor_at(time_s);
    return;
  }
  if (const double gap_s = time_s - this->time_s(); gap_s > kMaxCatchUpS + config_.step_s) {
    counters_.skipped_s += gap_s - kMaxCatchUpS;
    anchor_at(time_s - kMaxCatchUpS);
  }
  while (anchor_s_ + double(steps_since_anchor_ + 1) * config_.step_s <= time_s + kStampResolutionS) step();
}

void Simulation::advance_to(double time_s, std::span<const Silhouette> silhouettes) {
  if (!std::isfinite(time_s)) throw std::invalid_argument("simulation time is not finite");
  query_.reset();
  if (!reacting_.empty()) {
    hull_.assign(silhouettes);
    query_.emplace(hull_);
    detector_->set_hull(*query_, silhouettes);
  }
  std::fill(contacts_.begin(), contacts_.end(), CollisionReport{});
  catch_up(time_s);
  report();
}

void Simulation::step() {
  bodies_.step(config_.step_s);
  ++steps_since_anchor_;
  ++counters_.steps;
  put_back_the_lost();
  if (++steps_since_query_ < steps_per_query_) return;
  steps_since_query_ = 0;
  bounce_off_hull();
}

void Simulation::put_back_the_lost() {
  for (std::size_t i = 0; i < scene_.objects.size(); ++i) {
    if (scene_.objects[i].motion != Motion::dynamic || playground_m_.contains(bodies_.center_world_m(i))) continue;
    bodies_.put_back(i);
    ++counters_.put_back;
  }
}

DetectionObject Simulation::detection_object(std::size_t object) const { return {&meshes_[object], bodies_.world_from_object(object), bodies_.center_world_m(object)}; }

std::vector<ObjectCollision> Simulation::detected(std::span<const std::size_t> objects) {
  std::vector<DetectionObject> asked;
  for (const std::size_t object : objects) asked.push_back(detection_object(object));
  std::vector<ObjectCollision> collisions = detector_->detect(asked);
  counters_.detection = detector_->counts();
  return collisions;
}

void Simulation::bounce_off_hull() {
  if (bouncing_.empty()) return;
  std::vector<ObjectCollision> collisions = detected(bouncing_);
  for (std::size_t i = 0; i < bouncing_.size(); ++i) {
    if (!collisions[i].colliding()) continue;
    ++counters_.contacts;
    contacts_[i] = {.object = bouncing_[i], .collision = std::move(collisions[i])};
    contacts_[i].response = recover(bouncing_[i], contacts_[i].collision);
  }
}

Response Simulation::recover(std::size_t object, ObjectCollision collision) {
  const double resting_speed_m_s = kRestingPeriods * scene_.gravity_m_s2 * std::max(kHullQueryPeriodS, config_.step_s);
  const ResponseConfig config{.height_m = radii_m_[object], .apex_angle_rad = kBounceAngleRad, .window_px = config_.window_px};
  std::optional<Response> first;
  RecoveryStatus status = RecoveryStatus::still_colliding;
  for (int i = 0; i < kMaxRecoveries && status == RecoveryStatus::still_colliding; ++i) {
    // Over the whole contact: where a ball lies between two parts of the hull, the normal of one camera's border would drive it to one side.
    const ResponseRequest request{.rp_object_world_m = bodies_.center_world_m(object),
                                  .v_rec_world = std::nullopt,
                                  .normals = {.four_points = true, .closed_form = false},
                                  .equally_far_m = flatness_m_[object]};
    const Requery requery = [&](const Eigen::Vector3d& move_world_m) {
      DetectionObject moved = detection_object(object);
      moved.world_from_object = Eigen::Translation3d(move_world_m) * moved.world_from_object;
      moved.rp_object_world_m += move_world_m;
      return std::move(detector_->detect({&moved, 1}).front());
    };
    const Response response = respond(*query_, collision, request, requery, config);
    status = response.status;
    if (response.has_way_out()) {
      const Bounce after = bounce(response, bodies_.velocity_m_s(object), scene_.objects[object].restitution, scene_.gravity_m_s2, resting_speed_m_s);
      bodies_.translate(object, after.move_world_m);
      bodies_.set_velocity_m_s(object, after.velocity_world_m_s);
      collision.points = response.points_left;
    }
    if (!first) first = response;
  }
  counters_.still_colliding += status == RecoveryStatus::still_colliding;
  counters_.unrecovered += status != RecoveryStatus::still_colliding && status != RecoveryStatus::recovered;
  return *first;
}

void Simulation::report() {
  reports_.clear();
  if (reacting_.empty()) return;
  std::vector<ObjectCollision> collisions = detected(reacting_);
  for (std::size_t i = 0; i < reacting_.size(); ++i) {
    const std::size_t object = reacting_[i];
    CollisionReport report{.object = object, .collision = std::move(collisions[i])};
    const auto bouncing = std::find(bouncing_.begin(), bouncing_.end(), object);
    if (bouncing != bouncing_.end())
      if (CollisionReport& contact = contacts_[std::size_t(bouncing - bouncing_.begin())]; contact.response) report = std::move(contact);
    report.name = scene_.objects[object].name;
    report.truncated = report.collision.truncated || report.collision.points.size() > std::size_t(config_.max_points);
    thin(report.collision.points, std::size_t(config_.max_points));
    reports_.push_back(std::move(report));
  }
}

std::vector<ObjectState> Simulation::states() const {
  std::vector<ObjectState> states;
  for (std::size_t i = 0; i < scene_.objects.size(); ++i)
    states.push_back({scene_.objects[i].name, bodies_.world_from_object(i), bodies_.velocity_m_s(i), {}});
  return states;
}

}  // namespace fivepipe
