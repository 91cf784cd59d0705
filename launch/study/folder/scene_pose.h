// Writes the pose of an object to a scene file and keeps the rest of the file, with its comments.
#pragma once
#include <Eigen/Geometry>
#include <filesystem>
#include <string>

#include "launch/study/folder/study_folder.h"

namespace fivepipe::study {

// As the keys of a scene file: the rotation is about the world's x, then y, then z axis.
struct ScenePose {
  Eigen::Vector3d position_m, rotation_deg;
};
ScenePose scene_pose(const Eigen::Isometry3d& world_from_object);
// "[0.1, 0, -0.25]", rounded to a thousandth of a millimetre or degree.
std::string yaml_of(const Eigen::Vector3d& vector);

// Returns the file. Throws base::UsageError if the object's entry is not written with one key per
// line; the file is then as before.
std::filesystem::path write_pose(const StudyFolder& study, const std::string& object,
                                 const Eigen::Isometry3d& world_from_object);

}  // namespace fivepipe::study
