#include "common/config/mesh/step_faces.h"

#include <BRepBndLib.hxx>
#include <BRepMesh_IncrementalMesh.hxx>
#include <BRep_Tool.hxx>
#include <Bnd_Box.hxx>
#include <Poly_Triangulation.hxx>
#include <TopExp_Explorer.hxx>
#include <TopLoc_Location.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Face.hxx>
#include <algorithm>
#include <cmath>
#include <utility>

#include "common/config/mesh/step_module.h"

namespace fivepipe::config {
namespace {

using Vertex = decltype(ImportedMesh::vertices)::value_type;

ImportedMesh unusable(std::string reason) { return {{}, {}, std::move(reason)}; }

// A face's triangles are in its own frame and on the outside of its surface, which may be the
// inside of its solid. Open CASCADE's placements do not mirror.
void append(const TopoDS_Face& face, const TopLoc_Location& location,
            const Poly_Triangulation& triangulation, ImportedMesh& mesh) {
  const gp_Trsf& shape_from_face = location.Transformation();
  const bool is_reversed = face.Orientation() == TopAbs_REVERSED;
  const auto first = std::uint32_t(mesh.vertices.size());
  for (int i = 1; i <= triangulation.NbNodes(); ++i) {
    const gp_Pnt p = triangulation.Node(i).Transformed(shape_from_face);
    mesh.vertices.push_back(
        {float(kOcctUnit_m * p.X()), float(kOcctUnit_m * p.Y()), float(kOcctUnit_m * p.Z())});
  }
  for (int i = 1; i <= triangulation.NbTriangles(); ++i) {
    int a = 0, b = 0, c = 0;
    triangulation.Triangle(i).Get(a, b, c);
    if (is_reversed) std::swap(b, c);
    mesh.triangles.push_back(
        {first + std::uint32_t(a) - 1, first + std::uint32_t(b) - 1, first + std::uint32_t(c) - 1});
  }
}

// Neighbouring faces have the same points of their common edge, each its own ones. Makes one vertex
// of each position, and drops triangles that have no area because of that.
void merge_positions(ImportedMesh& mesh) {
  std::vector<Vertex> merged = mesh.vertices;
  std::sort(merged.begin(), merged.end());
  merged.erase(std::unique(merged.begin(), merged.end()), merged.end());
  const auto index_of = [&](std::uint32_t vertex) {
    return std::uint32_t(std::lower_bound(merged.begin(), merged.end(), mesh.vertices[vertex]) -
                         merged.begin());
  };
  for (auto& [a, b, c] : mesh.triangles) {
    a = index_of(a);
    b = index_of(b);
    c = index_of(c);
  }
  std::erase_if(mesh.triangles,
                [](const auto& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
  mesh.vertices = std::move(merged);
}

// Returns the faces and the size of the shape's box, or why it has none.
struct Extent {
  int faces = 0;
  double diagonal = 0;  // in units of Open CASCADE
  std::string reason;
};
Extent extent_of(const TopoDS_Shape& shape) {
  Extent extent;
  for (TopExp_Explorer each(shape, TopAbs_FACE); each.More(); each.Next()) ++extent.faces;
  if (extent.faces == 0) {
    extent.reason =
        "the file has no faces; only solids and surfaces can be read, not wireframes, points or "
        "triangles: export the part as a solid (AP203, AP214 or AP242)";
    return extent;
  }
  Bnd_Box box;
  BRepBndLib::Add(shape, box, false);
  if (!box.IsVoid() && !box.IsOpen()) extent.diagonal = std::sqrt(box.SquareExtent());
  if (box.IsVoid() || box.IsOpen() || !std::isfinite(extent.diagonal))
    extent.reason = "a face has no bounds: export the part as a solid";
  return extent;
}

void triangulate(const TopoDS_Shape& shape, double diagonal) {
  IMeshTools_Parameters parameters;
  parameters.Deflection =
      std::max(kStepDeflection_m / kOcctUnit_m, kStepDeflectionOfDiagonal * diagonal);
  parameters.Angle = kStepAngle_rad;
  const BRepMesh_IncrementalMesh triangulate_now(shape, parameters);
}

}  // namespace

ImportedMesh mesh_of_faces(const TopoDS_Shape& shape) {
  const Extent extent = extent_of(shape);
  if (!extent.reason.empty()) return unusable(extent.reason);
  triangulate(shape, extent.diagonal);
  ImportedMesh mesh;
  int failed = 0;
  for (TopExp_Explorer each(shape, TopAbs_FACE); each.More(); each.Next()) {
    const TopoDS_Face& face = TopoDS::Face(each.Current());
    TopLoc_Location location;
    const Handle(Poly_Triangulation) triangulation = BRep_Tool::Triangulation(face, location);
    if (triangulation.IsNull())
      ++failed;
    else
      append(face, location, *triangulation, mesh);
    if (std::max(mesh.vertices.size(), mesh.triangles.size()) > kMaxMeshElements)
      return unusable("the mesh has more than " + std::to_string(kMaxMeshElements) +
                      " vertices or triangles");
  }
  if (failed > 0)
    return unusable(std::to_string(failed) + " of " + std::to_string(extent.faces) +
                    " faces cannot be triangulated: repair the part in the CAD program and export "
                    "it again");
  for (const auto& [x, y, z] : mesh.vertices)
    if (!(std::isfinite(x) && std::isfinite(y) && std::isfinite(z)))
      return unusable("a vertex of the mesh is not finite");
  merge_positions(mesh);
  return mesh;
}

}  // namespace fivepipe::config
