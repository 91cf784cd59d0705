// Binary glTF 2.0 files (Khronos specification, section 4.4).
#pragma once
#include <string>

#include "common/surface/mesh_file.h"

namespace fivepipe::surface {

// Returns the bytes of the file: one node with one mesh, or none if the content has no vertex.
// Colours are linear there, so each is converted from sRGB.
std::string glb_of(const MeshFile& content);

}  // namespace fivepipe::surface
