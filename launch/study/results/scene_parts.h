// The virtual parts of a scene, as the report shows them.
#pragma once
#include <vector>

#include "common/collision/spacing/movable_part.h"
#include "common/config/scene.h"
#include "common/study/report/study.h"

namespace fivepipe::study {

// Whether the object keeps its shape and stays where the scene or an experimenter has it.
inline bool is_rigid(const config::SceneObject& object) {
  return object.motion == config::Motion::fixed;
}

// All rigid objects of the scene. A part with a `spacing` has an axis.
std::vector<report::Part> report_parts(const config::Scene& scene);
bool are_equal(const std::vector<report::Part>& a, const std::vector<report::Part>& b);

// Pose of an object with a `spacing` at spacing 0.
Eigen::Isometry3d pose_at_zero(const config::SceneObject& object);
collision::MovablePart movable_part(const config::SceneObject& object);

}  // namespace fivepipe::study
