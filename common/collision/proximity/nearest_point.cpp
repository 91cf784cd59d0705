#include "common/collision/proximity/nearest_point.h"

#include <cmath>
#include <limits>

#include "common/collision/proximity/proximity_shapes.h"

namespace fivepipe::collision {
namespace {

// Bound of the rounding errors in float, relative to the coordinates: half an epsilon for each
// coordinate, and less than three for the distance.
constexpr float kRounding = 8 * std::numeric_limits<float>::epsilon();

// Branch-and-bound search: skips a box that is farther away than the nearest point so far.
class Search {
 public:
  Search(const Bvh& tree, const Eigen::Vector3d& p_m, double reach_m)
      : tree_(tree),
        p_m_(p_m),
        from_origin_m_((p_m - tree.origin_m()).cast<float>()),
        nearest_m_(reach_m) {}

  std::optional<NearestPoint> run() {
    if (!tree_.empty()) visit(tree_.levels() - 1, 0);
    return found_;
  }

 private:
  void visit(int level, int i) {
    const Bvh::Boxes& boxes = tree_.boxes(level, i);
    for (int child = 0; child < Bvh::kArity; ++child) {
      if (!(distance_m(boxes, std::size_t(child)) <= nearest_m_)) continue;
      const int below = Bvh::kArity * i + child;
      if (level > 0)
        visit(level - 1, below);
      else
        visit_leaf(below);
    }
  }

  // Returns a lower bound of the distance to a box; infinity if the box is absent.
  double distance_m(const Bvh::Boxes& boxes, std::size_t child) const {
    float sum = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float half_m = boxes.half_m[axis][child];
      if (half_m < 0) return std::numeric_limits<double>::infinity();
      const float beyond_m =
          std::abs(from_origin_m_[Eigen::Index(axis)] - boxes.center_m[axis][child]) - half_m;
      if (beyond_m > 0) sum += beyond_m * beyond_m;
    }
    return double(std::sqrt(sum) -
                  kRounding * (from_origin_m_.cwiseAbs().sum() + float(tree_.radius_m())));
  }

  void visit_leaf(int leaf) {
    const geometry::Mesh& mesh = tree_.mesh();
    for (const std::uint32_t triangle : tree_.triangles_of(leaf)) {
      const auto& [a, b, c] = mesh.triangles[triangle];
      const Eigen::Vector3d p_m =
          TriangleShape({mesh.vertices_m[a], mesh.vertices_m[b], mesh.vertices_m[c]})
              .nearest_to(p_m_);
      const double distance_m = (p_m - p_m_).norm();
      if (!(distance_m <= nearest_m_)) continue;
      nearest_m_ = distance_m;
      found_ = {triangle, p_m, distance_m};
    }
  }

  const Bvh& tree_;
  const Eigen::Vector3d p_m_;
  const Eigen::Vector3f from_origin_m_;
  double nearest_m_;
  std::optional<NearestPoint> found_;
};

// Visits the boxes of the tree that may meet a box.
class Overlap {
 public:
  Overlap(const Bvh& tree, const Eigen::AlignedBox3d& box_m,
          const std::function<void(std::uint32_t)>& take)
      : tree_(tree),
        take_(take),
        center_m_((box_m.center() - tree.origin_m()).cast<float>()),
        half_m_((0.5 * box_m.sizes()).cast<float>()),
        rounding_m_(kRounding *
                    (center_m_.cwiseAbs().sum() + half_m_.sum() + float(tree.radius_m()))) {}

  void visit(int level, int i) const {
    const Bvh::Boxes& boxes = tree_.boxes(level, i);
    for (int child = 0; child < Bvh::kArity; ++child) {
      if (!meets(boxes, std::size_t(child))) continue;
      const int below = Bvh::kArity * i + child;
      if (level > 0)
        visit(level - 1, below);
      else
        for (const std::uint32_t triangle : tree_.triangles_of(below)) take_(triangle);
    }
  }

 private:
  bool meets(const Bvh::Boxes& boxes, std::size_t child) const {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float half_m = boxes.half_m[axis][child];
      if (!(half_m >= 0 && std::abs(center_m_[Eigen::Index(axis)] - boxes.center_m[axis][child]) <=
                               half_m + half_m_[Eigen::Index(axis)] + rounding_m_))
        return false;
    }
    return true;
  }

  const Bvh& tree_;
  const std::function<void(std::uint32_t)>& take_;
  const Eigen::Vector3f center_m_, half_m_;
  const float rounding_m_;
};

}  // namespace

void each_triangle_near(const Bvh& tree, const Eigen::AlignedBox3d& box_m,
                        const std::function<void(std::uint32_t)>& take) {
  if (!tree.empty()) Overlap(tree, box_m, take).visit(tree.levels() - 1, 0);
}

std::optional<NearestPoint> nearest_point(const Bvh& tree, const Eigen::Vector3d& p_m,
                                          double reach_m) {
  return Search(tree, p_m, reach_m).run();
}

}  // namespace fivepipe::collision
