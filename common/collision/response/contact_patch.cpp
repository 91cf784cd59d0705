#include "common/collision/response/contact_patch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <stdexcept>

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;

struct Cells {
  std::vector<Vector3d> centers_world_m, areas_world_m2;  // area vectors, outward
};

using Corners = std::array<Vector3d, 3>;

// Number of cells along each edge.
double divisions(const Corners& corners, double cell_m) {
  const double longest_m =
      std::max({(corners[1] - corners[0]).norm(), (corners[2] - corners[1]).norm(),
                (corners[0] - corners[2]).norm()});
  return std::max(1.0, std::ceil(longest_m / cell_m));
}

// Divides the triangle into n * n congruent cells.
void add_cells(const Corners& corners, int n, Cells& cells) {
  const Vector3d along_b = (corners[1] - corners[0]) / n, along_c = (corners[2] - corners[0]) / n,
                 area = 0.5 * along_b.cross(along_c);
  for (int b = 0; b < n; ++b)
    for (int c = 0; b + c < n; ++c)
      for (const double third : {1.0, 2.0}) {  // an upright cell, and an inverted one beside it
        if (third == 2.0 && b + c == n - 1) continue;
        cells.centers_world_m.push_back(corners[0] + (b + third / 3) * along_b +
                                        (c + third / 3) * along_c);
        cells.areas_world_m2.push_back(area);
      }
}

Cells cells_of(const geometry::Mesh& mesh, const Eigen::Isometry3d& world_from_object,
               std::span<const std::uint32_t> triangles, double cell_m) {
  std::vector<Corners> corners;
  for (const std::uint32_t t : triangles) {
    const auto& [a, b, c] = mesh.triangles[t];
    corners.push_back({world_from_object * mesh.vertices_m[a],
                       world_from_object * mesh.vertices_m[b],
                       world_from_object * mesh.vertices_m[c]});
  }
  double count = 0;
  for (const Corners& one : corners) count += std::pow(divisions(one, cell_m), 2);
  const double larger = std::sqrt(std::max(1.0, count / double(kMaxPatchCells)));
  Cells cells;
  for (const Corners& one : corners) add_cells(one, int(divisions(one, larger * cell_m)), cells);
  return cells;
}

// Assigns the points to clusters: voxels of edge gap_m that touch belong together. Returns the
// points' clusters, numbered by their first point.
std::vector<std::size_t> clusters_of(const std::vector<Vector3d>& points_m, double gap_m) {
  using Voxel = std::array<std::int64_t, 3>;
  const auto voxel_of = [&](const Vector3d& p) {
    return Voxel{std::int64_t(std::floor(p.x() / gap_m)), std::int64_t(std::floor(p.y() / gap_m)),
                 std::int64_t(std::floor(p.z() / gap_m))};
  };
  constexpr std::size_t kUnset = std::size_t(-1);
  std::map<Voxel, std::size_t> cluster_of_voxel;
  for (const Vector3d& p : points_m) cluster_of_voxel[voxel_of(p)] = kUnset;
  std::size_t clusters = 0;
  for (const Vector3d& p : points_m) {
    if (cluster_of_voxel[voxel_of(p)] != kUnset) continue;
    std::vector<Voxel> open = {voxel_of(p)};
    cluster_of_voxel[open.front()] = clusters;
    while (!open.empty()) {
      const Voxel voxel = open.back();
      open.pop_back();
      for (int neighbor = 0; neighbor < 27; ++neighbor) {
        const auto found =
            cluster_of_voxel.find({voxel[0] + neighbor % 3 - 1, voxel[1] + neighbor / 3 % 3 - 1,
                                   voxel[2] + neighbor / 9 - 1});
        if (found == cluster_of_voxel.end() || found->second != kUnset) continue;
        found->second = clusters;
        open.push_back(found->first);
      }
    }
    ++clusters;
  }
  std::vector<std::size_t> result;
  for (const Vector3d& p : points_m) result.push_back(cluster_of_voxel[voxel_of(p)]);
  return result;
}

}  // namespace

std::vector<ContactPatch> contact_patches(const hull::HullQuery& query, const geometry::Mesh& mesh,
                                          const Eigen::Isometry3d& world_from_object,
                                          std::span<const std::uint32_t> triangles,
                                          const PatchOptions& options) {
  if (!(options.cell_m > 0 && options.gap_m > 0 && std::isfinite(options.cell_m) &&
        std::isfinite(options.gap_m)))
    throw std::invalid_argument("contact patches: cell_m or gap_m is not positive and finite");
  if (!world_from_object.matrix().allFinite())
    throw std::invalid_argument("contact patches: the pose is not finite");
  const Cells cells = cells_of(mesh, world_from_object, triangles, options.cell_m);
  std::vector<std::uint8_t> inside(cells.centers_world_m.size());
  query.contains(cells.centers_world_m, inside);
  Cells in_hull;
  for (std::size_t i = 0; i < inside.size(); ++i)
    if (inside[i]) {
      in_hull.centers_world_m.push_back(cells.centers_world_m[i]);
      in_hull.areas_world_m2.push_back(cells.areas_world_m2[i]);
    }
  const std::vector<std::size_t> clusters = clusters_of(in_hull.centers_world_m, options.gap_m);
  std::vector<ContactPatch> patches;
  std::vector<Vector3d> area_vectors;
  for (std::size_t i = 0; i < clusters.size(); ++i) {
    if (clusters[i] >= patches.size()) {
      patches.resize(clusters[i] + 1);
      area_vectors.resize(clusters[i] + 1, Vector3d::Zero());
    }
    ContactPatch& patch = patches[clusters[i]];
    patch.points_world_m.push_back(in_hull.centers_world_m[i]);
    patch.area_m2 += in_hull.areas_world_m2[i].norm();
    area_vectors[clusters[i]] -= in_hull.areas_world_m2[i];
  }
  std::vector<ContactPatch> with_normal;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    if (!(area_vectors[i].norm() > kMinPatchDirection * patches[i].area_m2)) continue;
    patches[i].normal_world = area_vectors[i].normalized();
    with_normal.push_back(std::move(patches[i]));
  }
  std::stable_sort(
      with_normal.begin(), with_normal.end(),
      [](const ContactPatch& a, const ContactPatch& b) { return a.area_m2 > b.area_m2; });
  return with_normal;
}

std::vector<Vector3d> surface_points_m(const geometry::Mesh& mesh, double cell_m) {
  if (!(cell_m > 0 && std::isfinite(cell_m)))
    throw std::invalid_argument("surface points: cell_m is not positive and finite");
  std::vector<std::uint32_t> all(mesh.triangles.size());
  std::iota(all.begin(), all.end(), 0u);
  return cells_of(mesh, Eigen::Isometry3d::Identity(), all, cell_m).centers_world_m;
}

}  // namespace fivepipe::collision
