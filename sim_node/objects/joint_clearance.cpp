#include "sim_node/objects/joint_clearance.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/config/yaml/config_error.h"
#include "sim_node/objects/rigid_bodies.h"

namespace fivepipe::sim {

void check_joint_clearance(const config::Scene& scene) {
  const auto& objects = scene.objects;
  if (std::none_of(objects.begin(), objects.end(),
                   [](const config::SceneObject& object) { return object.joint.has_value(); }))
    return;
  const RigidBodies bodies(scene);
  std::vector<config::ConfigProblem> problems;
  for (std::size_t i = 0; i < objects.size(); ++i)
    for (std::size_t k = 0; k < objects.size() && objects[i].joint; ++k) {
      if (objects[k].motion != config::Motion::fixed) continue;
      const double overlap_m = bodies.overlap_m(i, k);
      if (!(overlap_m > kMinOverlap_m)) continue;
      const bool is_mesh = std::holds_alternative<config::MeshShape>(objects[i].shape);
      problems.push_back(
          {scene.file.string(), objects[i].location.line, objects[i].location.column,
           fmt::format("{}{} overlaps {} by {:.3g} m at the start and could not move: leave a "
                       "clearance between them",
                       is_mesh ? "the convex hull of " : "", objects[i].name, objects[k].name,
                       overlap_m)});
    }
  if (!problems.empty()) throw config::ConfigError(std::move(problems));
}

}  // namespace fivepipe::sim
