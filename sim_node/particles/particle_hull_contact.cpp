#include "sim_node/particles/particle_hull_contact.h"

#include "common/collision/response/recovery.h"
#include "sim_node/particles/particle_response.h"

namespace fivepipe::sim {
namespace {

using Eigen::Vector3d;

// Maximum number of moves out of the hull: a particle may leave a part into another one.
constexpr int kExits = 4;
// Beyond the exit, so that rounding does not bring the particle back.
constexpr double kBeyondExit_m = 1e-5;

// Returns the shorter way out of the hull: along the normal at p, if it is defined, or upwards.
// Returns nullopt if neither leaves the hull within kMaxParticleExit_m.
std::optional<Vector3d> way_out_m(const hull::HullQuery& query, const hull::HullDistance& distance,
                                  const Vector3d& p_world_m) {
  std::optional<Vector3d> shortest_m;
  const auto consider = [&](const Vector3d& direction) {
    const auto exit = collision::exit_outward(query, p_world_m, direction, kMaxParticleExit_m);
    if (!exit) return;
    const double way_m = exit->distance_m + exit->error_m + kBeyondExit_m;
    if (!shortest_m || way_m < shortest_m->norm()) shortest_m = way_m * direction;
  };
  if (const auto surface = distance.near(p_world_m, 0)) consider(surface->normal_world);
  consider(Vector3d::UnitZ());
  return shortest_m;
}

}  // namespace

void ParticleHullContact::begin(const CurrentHull& hull, double step_s, double before_s) {
  if (!distance_ || frame_ != hull.frames()) distance_.emplace(hull.silhouettes(), hull.rule());
  frame_ = hull.frames();
  parts_.clear();
  for (const HullPart& part : hull.parts())
    parts_.push_back({part.box_world_m, newest_from_before(part, before_s),
                      // The velocity within the step: at the newest frame the part stops.
                      velocity_before(part, before_s + 0.5 * step_s)});
}

std::uint64_t ParticleHullContact::step(const config::ParticleSource& source,
                                        ParticleSet& particles) const {
  std::uint64_t touches = 0;
  for (const PlacedPart& part : parts_) {
    const Eigen::AlignedBox3d box_m(part.box_world_m.min().array() - source.radius_m,
                                    part.box_world_m.max().array() + source.radius_m);
    const Eigen::Matrix3d end_from_newest = part.newest_from_end.linear().transpose();
    std::vector<Vector3d> p_newest_m(particles.size());
    for (std::size_t i = 0; i < particles.size(); ++i)
      p_newest_m[i] = part.newest_from_end * particles.p_world_m[i];
    std::vector<std::optional<hull::SurfaceNearby>> surfaces(particles.size());
    distance_->near(p_newest_m, source.radius_m, surfaces);
    for (std::size_t i = 0; i < particles.size(); ++i) {
      const auto& surface = surfaces[i];
      if (!surface || !box_m.contains(p_newest_m[i])) continue;
      touches += respond(source,
                         {end_from_newest * surface->normal_world, surface->distance_m,
                          part.velocity.at(particles.p_world_m[i])},
                         particles.p_world_m[i], particles.v_world_m_s[i]);
    }
  }
  return touches;
}

std::uint64_t ParticleHullContact::leave(const hull::HullQuery& query,
                                         ParticleSet& particles) const {
  std::vector<std::uint8_t> inside(particles.size());
  query.contains(particles.p_world_m, inside);
  std::uint64_t removed = 0;
  for (std::size_t i = particles.size(); i-- > 0;) {  // remove() moves a later particle here
    if (!inside[i]) continue;
    Vector3d& p_m = particles.p_world_m[i];
    bool is_inside = true;
    for (int exits = 0; exits < kExits && is_inside; ++exits) {
      const auto way_m = way_out_m(query, *distance_, p_m);
      if (!way_m) break;
      p_m += *way_m;
      is_inside = query.contains(p_m);
    }
    if (!is_inside) continue;
    particles.remove(i);
    ++removed;
  }
  return removed;
}

}  // namespace fivepipe::sim
