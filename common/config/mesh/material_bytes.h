// The form in which the child process returns the materials of an imported mesh.
#pragma once
#include <optional>
#include <string>
#include <string_view>

#include "common/config/mesh/material.h"

namespace fivepipe::config {

std::string bytes_of(const MeshMaterials& materials);

// Returns nullopt if the bytes are not those of the materials of a mesh with this many triangles. A
// child that imports a damaged file may write any bytes.
std::optional<MeshMaterials> materials_from(std::string_view bytes, std::size_t triangles);

}  // namespace fivepipe::config
