#include "common/collision/response/local_minimum_translation.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "common/collision/response/farthest_point_sample.h"
#include "common/collision/response/recovery.h"

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;

// Collision points whose exits are computed per direction. They propose a translation; the requery
// verifies it.
constexpr std::size_t kMaxPoints = 48;
// Angles between the ring of directions and the best one: halved from the first to the last. Below
// the last, lengths differ by 1 - cos(angle), less than a thousandth.
constexpr double kFirstTilt_rad = 0.7, kLastTilt_rad = 0.03;
constexpr int kRing = 8;
// If points still collide after a translation, it is extended by their residual, at most this
// often. Each extension adds a slack, because surface points between the collision points are a
// little deeper.
constexpr int kMaxExtensions = 2, kMaxExtensionsOfResponse = 4;
// Slack of an extension, by index: at most 0.5 mm, less than a pixel footprint.
double slack_m(int extension) { return kMaxRounding_m * std::pow(8.0, extension); }

class Descent {
 public:
  Descent(const hull::HullQuery& query, std::vector<Vector3d> points_m, const Requery& requery,
          const LocalMinimumTranslationConfig& config)
      : query_(query), points_m_(std::move(points_m)), requery_(requery), config_(config) {}

  // Starts from the response's move, the upper bound of all others. Verifies it, and extends it by
  // at most max_more_m if it is not free.
  void start(const Vector3d& direction, double length_m, bool is_free, double max_more_m) {
    best_ = {direction, length_m};
    free = is_free;
    for (int i = 0; i <= kMaxExtensionsOfResponse && !free && may_requery() &&
                    length_m <= best_.length_m + max_more_m;
         ++i) {
      ++requeries;
      const auto remaining = requery_(length_m * direction).points;
      free = remaining.empty();
      if (!free) length_m += residual_m(query_, remaining, direction, length_m) + slack_m(i);
    }
    if (free) best_.length_m = length_m;
  }
  bool try_translation(const Vector3d& direction, double length_m) {
    for (int i = 0; i <= kMaxExtensions && may_requery(); ++i) {
      ++requeries;
      const auto remaining = requery_(length_m * direction).points;
      if (remaining.empty()) {
        best_ = {direction, length_m};
        return free = true;
      }
      length_m += residual_m(query_, remaining, direction, best_.length_m) + slack_m(i);
      if (!shorter(length_m)) return false;
    }
    return false;
  }

  // Tries the directions that may be shorter by ascending length, until one frees the object.
  bool try_directions(const std::vector<Vector3d>& directions) {
    std::vector<Candidate> candidates;
    for (const Vector3d& direction : directions)
      if (const double length_m = min_length_m(direction); shorter(length_m))
        candidates.push_back({direction, length_m});
    std::stable_sort(
        candidates.begin(), candidates.end(),
        [](const Candidate& a, const Candidate& b) { return a.length_m < b.length_m; });
    for (const Candidate& candidate : candidates)
      if (may_requery() && try_translation(candidate.direction, candidate.length_m)) return true;
    return false;
  }

  // Returns the normals of the hull's border where the points leave it along the best direction.
  std::vector<Vector3d> normals() const {
    std::vector<Vector3d> found;
    for (const Vector3d& p_world_m : points_m_) {
      const auto exit = exit_outward(query_, p_world_m, best_.direction, 2 * best_.length_m);
      if (!exit) continue;
      const double outside_m = exit->distance_m + exit->error_m;
      const auto limiting = hull::limiting_cameras(
          query_, {p_world_m + outside_m * best_.direction, -best_.direction}, 0, outside_m);
      if (limiting) found.push_back(limiting->cameras.front().normal_world);
    }
    return found;
  }
  std::vector<Vector3d> ring(double tilt_rad) const {
    const Vector3d across = best_.direction.unitOrthogonal(),
                   across_too = best_.direction.cross(across);
    std::vector<Vector3d> directions;
    for (int i = 0; i < kRing; ++i) {
      const double a = 2 * std::numbers::pi * i / kRing;
      directions.push_back((std::cos(tilt_rad) * best_.direction +
                            std::sin(tilt_rad) * (std::cos(a) * across + std::sin(a) * across_too))
                               .normalized());
    }
    return directions;
  }
  bool may_requery() const { return requeries < config_.max_requeries; }

  struct Candidate {
    Vector3d direction;
    double length_m;
  };
  const Candidate& best() const { return best_; }
  int requeries = 0;
  bool free = false;  // the best translation has been verified

 private:
  bool shorter(double length_m) const { return length_m <= best_.length_m - config_.min_gain_m; }
  // Returns a lower bound of the translation along a direction: the farthest first exit of the
  // points plus rounding. Returns the best length if a point has no exit before it.
  double min_length_m(const Vector3d& direction) const {
    double length_m = 0;
    for (const Vector3d& p_world_m : points_m_) {
      const auto exit = exit_outward(query_, p_world_m, direction, best_.length_m);
      if (!exit) return best_.length_m;
      length_m = std::max(length_m, exit->distance_m);
    }
    return length_m + kMaxRounding_m;
  }

  const hull::HullQuery& query_;
  std::vector<Vector3d> points_m_;
  const Requery& requery_;
  LocalMinimumTranslationConfig config_;
  Candidate best_;
};

std::vector<Vector3d> points_to_move(const ObjectCollision& collision, const Response& response) {
  std::vector<Vector3d> points_m{response.cp_object_world_m};
  for (const CollisionPoint& point : collision.points) points_m.push_back(point.p_world_m);
  std::vector<Vector3d> spread;
  for (const std::size_t i : farthest_point_sample(points_m, {0}, kMaxPoints, 0))
    spread.push_back(points_m[i]);
  return spread;
}

}  // namespace

LocalMinimumTranslation find_local_minimum_translation(
    const hull::HullQuery& query, const ObjectCollision& collision, const Response& response,
    const Requery& requery, const LocalMinimumTranslationConfig& config) {
  if (!response.has_exit())
    throw std::invalid_argument("local minimum translation: the response has no exit");
  if (!(config.max_requeries > 0 && config.min_gain_m > 0) || !requery)
    throw std::invalid_argument(
        "local minimum translation: max_requeries, min_gain_m or requery is invalid");
  LocalMinimumTranslation result;
  Descent descent(query, points_to_move(collision, response), requery, config);
  const bool is_free = response.remaining_points.empty();
  descent.start(response.v_rec_world,
                response.clear_distance_m() + (is_free ? 0 : response.residual_m + kMaxRounding_m),
                is_free, response.pixel_footprint_m);
  bool shortened = false;
  while (descent.may_requery() && descent.try_directions(descent.normals())) shortened = true;
  for (double tilt_rad = kFirstTilt_rad; tilt_rad >= kLastTilt_rad && descent.may_requery();)
    if (descent.try_directions(descent.ring(tilt_rad)))
      shortened = true;
    else
      tilt_rad *= 0.5;
  result.requeries = descent.requeries;
  if (!descent.free) return result;
  result.status = shortened ? LocalMinimumTranslationStatus::shorter_found
                            : LocalMinimumTranslationStatus::none_shorter_found;
  result.length_m = descent.best().length_m;
  result.translation_world_m = result.length_m * descent.best().direction;
  return result;
}

}  // namespace fivepipe::collision
