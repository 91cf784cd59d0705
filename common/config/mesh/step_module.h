// The module fivepipe_step.so: triangles of STEP files (ISO 10303-21), by Open CASCADE. Only the
// child process that imports a STEP file loads it.
#pragma once
#include <numbers>
#include <optional>
#include <string>

#include "common/base/process/optional_module.h"
#include "common/config/mesh/mesh_import.h"

namespace fivepipe::config {

inline constexpr base::OptionalModule kStepModule{"fivepipe_step.so", "Open CASCADE",
                                                  "libocct-data-exchange-dev"};

// Reads the file. The vertices are in metres, whatever the file's unit; vertices at the same
// position are one vertex, so that a closed shell gives a closed mesh. Triangles are
// counter-clockwise seen from outside a solid. unit_m: nullopt, or the unit that the file must
// have [m]. Sets mesh.reason if the file is unusable. Throws std::bad_alloc.
inline constexpr const char* kReadStep = "fivepipe_read_step";
using ReadStep = void(const std::string& file, std::optional<double> unit_m, ImportedMesh& mesh);

// Linear deflection: the largest distance between a surface and its triangles. Beyond 1 m it grows
// with the size of the shape, so that a wrong unit cannot make billions of triangles.
inline constexpr double kStepDeflection_m = 1e-4;
inline constexpr double kStepDeflectionOfDiagonal = 1e-4;
// Angular deflection: the largest angle between neighbouring edges along a curve. A small fillet or
// hole has at least 18 edges.
inline constexpr double kStepAngle_rad = 20 * std::numbers::pi / 180;

}  // namespace fivepipe::config
