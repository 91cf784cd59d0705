// Beyond the paper: V_rec leads out of the hull, but seldom by the shortest way. A shorter
// translation, found by local descent.
//
// A direction's way is at least as long as the farthest first exit of the collision points along
// it. Directions are tried from V_rec on: the normals of the hull's border where ways end, then a
// ring of directions around the best, which narrows (pattern search; Hooke and Jeeves, 1961). A way
// counts only once the caller's requery finds nothing left in collision after it. No claim that
// there is no shorter one.
#pragma once
#include "common/collision/response/response.h"

namespace fivepipe::collision {

struct LocalMinimumTranslationConfig {
  int max_requeries = 32;    // > 0
  double min_gain_m = 1e-4;  // > 0: what is shorter by less is not worth a requery
};

enum class LocalMinimumTranslationStatus {
  found,       // shorter than the response's way, and verified free
  none_found,  // the response's way stands; it is verified free
  not_free  // neither the response's way with its residual nor a shorter one was found to free the
            // object
};

struct LocalMinimumTranslation {
  LocalMinimumTranslationStatus status = LocalMinimumTranslationStatus::not_free;
  Eigen::Vector3d move_world_m =
      Eigen::Vector3d::Zero();   // found, none_found: after it no collision point is left
  double length_m = 0;           // of it
  double response_length_m = 0;  // clear_distance_m() + residual_m, and, where points between those
                                 // asked for reach farther, up to a pixel's footprint
  int requeries = 0;
};

// The response has a way out. Throws std::invalid_argument where it has not, or the configuration
// is out of range.
LocalMinimumTranslation find_local_minimum_translation(
    const hull::HullQuery& query, const ObjectCollision& collision, const Response& response,
    const Requery& requery, const LocalMinimumTranslationConfig& config = {});

}  // namespace fivepipe::collision
