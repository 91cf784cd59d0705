// Local minimum translation: a translation out of the hull that is shorter than the move along
// V_rec, found by local descent. The paper has no counterpart.
//
// The translation along a direction is at least as long as the farthest first exit of a collision
// point along it. The search starts at V_rec and tries the normals of the hull's border at these
// exits, then a ring of directions around the best one with a decreasing angle (pattern search:
// Hooke and Jeeves, 1961). A translation counts only if the caller's requery confirms that the
// object is free after it. The result is not claimed to be the global minimum.
#pragma once
#include "common/collision/response/response.h"

namespace fivepipe::collision {

struct LocalMinimumTranslationConfig {
  int max_requeries = 32;    // > 0
  double min_gain_m = 1e-4;  // > 0: a smaller improvement is not worth a requery
};

enum class LocalMinimumTranslationStatus {
  shorter_found,       // shorter than the response's move, and verified to be free of collision
  none_shorter_found,  // the translation is the response's move, verified to be free
  none_verified        // neither the response's move plus residual nor a shorter one is free
};

struct LocalMinimumTranslation {
  LocalMinimumTranslationStatus status = LocalMinimumTranslationStatus::none_verified;
  // Valid unless none_verified: no collision point remains after this translation. At most as long
  // as clear_distance_m() + residual_m of the response, plus one pixel footprint if surface points
  // between the collision points are deeper.
  Eigen::Vector3d translation_world_m = Eigen::Vector3d::Zero();
  double length_m = 0;  // of the translation
  int requeries = 0;
};

// Throws std::invalid_argument if the response has no exit or the configuration is out of range.
LocalMinimumTranslation find_local_minimum_translation(
    const hull::HullQuery& query, const ObjectCollision& collision, const Response& response,
    const Requery& requery, const LocalMinimumTranslationConfig& config = {});

}  // namespace fivepipe::collision
