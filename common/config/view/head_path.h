// The path of a head: its file, and its faults.
#pragma once
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "common/config/view/viewer.h"
#include "common/config/yaml/problems.h"

namespace fivepipe::config {

// Reads a CSV file of eye poses: the header
// t_s,eye_x_m,eye_y_m,eye_z_m,target_x_m,target_y_m,target_z_m, then one key per line.
std::vector<HeadKey> read_head_path(const std::filesystem::path& file, Problems& problems);

// Returns true if an eye that looks at the target has a defined up direction in its image: the
// target is neither at the eye nor straight above or below it. `up` is a unit vector.
bool has_up_direction(const Eigen::Vector3d& eye_m, const Eigen::Vector3d& target_m,
                      const Eigen::Vector3d& up);

// Returns the faults of a path of eye poses, by key: times must start at 0 and increase; at and
// between the keys, the eye must not look straight up or down, nor have its target at its own
// position.
struct HeadPathFault {
  std::size_t key;
  std::string what;
};
std::vector<HeadPathFault> head_path_faults(const std::vector<HeadKey>& path);

}  // namespace fivepipe::config
