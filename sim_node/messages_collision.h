// Conversion to the messages CollisionResult and HullComponents.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "common/pipeline/messages/wire_conversions.h"
#include "sim_node/simulation/simulation.h"

namespace fivepipe::sim {

// Header data that all results of a frame share.
struct ResultFrame {
  std::uint64_t frame;
  std::int64_t capture_stamp_ns;
  double time_s;                            // simulation time at the stamp
  const std::vector<std::string>& cameras;  // names, by silhouette index
};

// A CollisionResult and the storage that it borrows. message() is valid until this object is
// changed or destroyed.
struct OutgoingCollision {
  fivepipe_v1_CollisionResult header{};
  std::vector<fivepipe_v1_Vec3> points_m;
  std::vector<std::uint32_t> triangles, triangles_undecided;
  std::vector<fivepipe_v1_HullNormal> normals;
  std::vector<std::vector<fivepipe_v1_LimitingNormal>> cameras;  // one per normal
  std::vector<fivepipe_v1_LocalMinimumTranslation> local_minimum_translation;
  std::vector<fivepipe_v1_Contact> contacts;
  std::vector<fivepipe_v1_ProximityField> proximity;
  std::vector<float> min_m, max_m;
  std::vector<fivepipe_v1_FirstContact> first_contact;
  const fivepipe_v1_CollisionResult& message();
};
// Fills only the requested fields.
OutgoingCollision collision_message(const ResultFrame& frame, const CollisionReport& report,
                                    const config::CollisionRequests& requests);

// HullComponents and the storage that they borrow, as above.
struct OutgoingComponents {
  fivepipe_v1_HullComponents header{};
  std::vector<fivepipe_v1_HullComponent> components;
  std::vector<std::vector<std::uint64_t>> from;  // one per component
  const fivepipe_v1_HullComponents& message();
};
OutgoingComponents components_message(const std::string& simulation, const ResultFrame& frame,
                                      const std::vector<collision::TrackedComponent>& components);

}  // namespace fivepipe::sim
