// A plain scene, and the same scene with one feature more, as files of a deployment.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace fivepipe::feature_bench {

struct Feature {
  std::string name;
  // Lines at the end of the scene file, whose last entry is the list `objects`: further objects, or
  // further keys.
  std::string scene_lines;
};

// The plain scene has a name, a table and a block that turns red where the real hand touches it.
inline const Feature kBase{"base", ""};

// cloth, bodies, joints, particles, shadows, lit, history.
const std::vector<Feature>& features();

// live: small images, so that the nodes start within seconds.
enum class ImageSize { paper, live };

// Writes deployment.yaml, rig.yaml and scene.yaml into `folder`, which is created. Three cameras
// see a hand with a pipe; one node of each kind. Returns the path of the deployment file.
std::filesystem::path write_deployment(const std::filesystem::path& folder, const Feature& feature,
                                       ImageSize size);

}  // namespace fivepipe::feature_bench
