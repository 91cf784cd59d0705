#include "sim_node/cloth/cloth_self_contact.h"

#include <algorithm>

#include "common/collision/proximity/moving_triangle.h"
#include "common/collision/proximity/nearest_point.h"
#include "common/collision/proximity/proximity_shapes.h"

namespace fivepipe::sim {
namespace {

using collision::Triangle;
using Eigen::Vector3d;

// Contacts with a smaller missing distance count as resolved. It is far below a pixel of a view.
constexpr double kResolved_m = 1e-6;

}  // namespace

ClothSelfContact::ClothSelfContact(const geometry::Mesh& mesh, std::vector<Vector3d> start_world_m,
                                   double thickness_m)
    : tree_(mesh),
      start_world_m_(std::move(start_world_m)),
      separated_world_m_(start_world_m_),
      thickness_m_(thickness_m) {}

std::uint64_t ClothSelfContact::separate(Cloth& cloth) {
  std::uint64_t found = 0;
  for (int i = 0; i < kMaxSelfSeparations; ++i) {
    const std::vector<ClothSelfTouch> touches = find(cloth);
    if (i == 0) found = touches.size();
    if (!(cloth.separate(touches) > kResolved_m)) break;
  }
  separated_world_m_ = cloth.vertices_world_m();
  return found;
}

std::vector<ClothSelfTouch> ClothSelfContact::find(const Cloth& cloth) {
  const std::vector<Vector3d>& now_m = cloth.vertices_world_m();
  tree_.refit(now_m);
  double moved_m = 0;
  for (std::size_t v = 0; v < now_m.size(); ++v)
    moved_m = std::max(moved_m, (now_m[v] - separated_world_m_[v]).norm());
  std::vector<ClothSelfTouch> touches;
  for (std::uint32_t v = 0; v < now_m.size(); ++v) find(v, cloth, moved_m, touches);
  return touches;
}

void ClothSelfContact::find(std::uint32_t vertex, const Cloth& cloth, double moved_m,
                            std::vector<ClothSelfTouch>& touches) const {
  const std::vector<Vector3d>& now_m = cloth.vertices_world_m();
  const Vector3d &before = separated_world_m_[vertex], &p_m = now_m[vertex];
  const double reach_m = moved_m + thickness_m_;
  const Eigen::AlignedBox3d box_m(before.cwiseMin(p_m).array() - reach_m,
                                  before.cwiseMax(p_m).array() + reach_m);
  const std::size_t first = touches.size();
  collision::each_triangle_near(tree_, box_m, [&](std::uint32_t t) {
    const std::array<std::uint32_t, 3>& triangle = tree_.mesh().triangles[t];
    if (std::find(triangle.begin(), triangle.end(), vertex) != triangle.end()) return;
    const Triangle now = collision::corners(triangle, now_m);
    if (const auto crossed = collision::crossing(
            {collision::corners(triangle, separated_world_m_), now}, before, p_m)) {
      touches.push_back({vertex, t, crossed->weights, crossed->side * collision::unit_normal(now),
                         kept_m(vertex, t)});
      return;
    }
    const Vector3d nearest_m = collision::TriangleShape(now).nearest_to(p_m);
    const double distance_m = (p_m - nearest_m).norm();
    // On the triangle the direction is undefined: no contact.
    if (!(distance_m > 0 && distance_m < thickness_m_)) return;
    if (const double kept = kept_m(vertex, t); distance_m < kept)
      touches.push_back({vertex, t, collision::barycentric_weights(now, nearest_m),
                         (p_m - nearest_m) / distance_m, kept});
  });
  // The tree calls in unspecified order.
  std::sort(
      touches.begin() + std::ptrdiff_t(first), touches.end(),
      [](const ClothSelfTouch& a, const ClothSelfTouch& b) { return a.triangle < b.triangle; });
}

double ClothSelfContact::kept_m(std::uint32_t vertex, std::uint32_t triangle) const {
  const Triangle start = collision::corners(tree_.mesh().triangles[triangle], start_world_m_);
  const Vector3d& p_m = start_world_m_[vertex];
  return std::min(thickness_m_, (collision::TriangleShape(start).nearest_to(p_m) - p_m).norm());
}

}  // namespace fivepipe::sim
