// The triangles of the faces of a shape. Part of the module fivepipe_step.so.
#pragma once
#include <TopoDS_Shape.hxx>

#include "common/config/mesh/mesh_import.h"

namespace fivepipe::config {

// Open CASCADE computes in millimetres.
inline constexpr double kOcctUnit_m = 1e-3;

// Triangulates the faces of a shape (step_module.h: deflections). Vertices in metres. Sets the
// reason if there is no face, if one cannot be triangulated, or if there are too many triangles.
ImportedMesh mesh_of_faces(const TopoDS_Shape& shape);

}  // namespace fivepipe::config
