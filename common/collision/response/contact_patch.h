// Patches of contact between a virtual object and the hull, each with the hull's mean normal. The
// paper has no counterpart.
//
//        object           The object's surface in the hull and the hull's surface in the object
//      \         /        enclose a volume. By the divergence theorem, their area vectors cancel.
//      So
//    ---\-------/---      the sum over the object's surface, which is known, gives that over the
//        \_____/  hull    hull's surface, which consists of pixel edges: its mean normal.
//
// This normal is also the direction in which a translation of the object reduces the volume most
// (Wang, Faure and Pai, "Adaptive Image-based Intersection Volume", 2012).
#pragma once
#include <span>
#include <vector>

#include "common/geometry/mesh.h"
#include "common/hull/query/hull_query.h"

namespace fivepipe::collision {

struct ContactPatch {
  Eigen::Vector3d normal_world;  // unit, out of the hull
  double area_m2 = 0;            // of the object's surface in the hull
  // Centres of the cells of the object's surface that are in the hull.
  std::vector<Eigen::Vector3d> points_world_m;
};

struct PatchOptions {
  double cell_m = 0.002;  // > 0: maximum edge of the cells into which triangles are divided
  // Parts of the surface that are farther apart are patches of their own; > 0.
  double gap_m = 0.006;
};

// Returns the patches of these triangles, by descending area. The mesh is closed, and its triangles
// are oriented outward. A surface that passes through the hull on both sides, such as a thin
// plate's, has no normal: its patch is omitted. Cells are larger than cell_m if there would be more
// than about kMaxPatchCells; each triangle has at least one. Throws std::invalid_argument if an
// option or the pose is out of range.
std::vector<ContactPatch> contact_patches(const hull::HullQuery& query, const geometry::Mesh& mesh,
                                          const Eigen::Isometry3d& world_from_object,
                                          std::span<const std::uint32_t> triangles,
                                          const PatchOptions& options = {});

// Returns the centres of the cells into which contact_patches() divides the mesh's triangles, in
// the mesh's frame.
std::vector<Eigen::Vector3d> surface_points_m(const geometry::Mesh& mesh, double cell_m);

inline constexpr std::size_t kMaxPatchCells = 16384;
// The area vectors of a patch with a normal do not cancel to less than this fraction of its area.
inline constexpr double kMinPatchDirection = 0.1;

}  // namespace fivepipe::collision
