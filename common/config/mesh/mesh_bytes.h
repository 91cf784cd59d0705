// The form in which the child process returns an imported mesh.
#pragma once
#include <optional>
#include <string>

#include "common/config/mesh/mesh_import.h"

namespace fivepipe::config {

std::string bytes_of(const ImportedMesh& mesh);

// Returns nullopt if the bytes are not those of a mesh whose triangles refer to its vertices: a
// damaged child may write anything.
std::optional<ImportedMesh> mesh_from(const std::string& bytes);

}  // namespace fivepipe::config
