#include "render_node/overlays/arrow_strokes.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace fivepipe::render {
namespace {

// Shorter arrows have no direction in the image.
constexpr double kMinLength_px = 1;

struct ImagePoint {
  Eigen::Vector2d p_px;  // x right, y up
  double depth;          // NDC
};

ImagePoint image_of(const Eigen::Vector3d& p_eye_m, const StrokeView& view) {
  const Eigen::Vector2d ndc =
      Eigen::Vector4d(view.clip_from_eye * p_eye_m.homogeneous()).hnormalized().head<2>();
  Eigen::Vector3d lifted_m = p_eye_m;
  lifted_m.z() = std::max(p_eye_m.z() - view.lift_m, view.near_m);
  const double depth =
      Eigen::Vector4d(view.clip_from_eye * lifted_m.homogeneous()).hnormalized().z();
  return {{0.5 * (ndc.x() + 1) * view.width_px, 0.5 * (ndc.y() + 1) * view.height_px},
          std::max(depth, -1.0)};
}

// The part of an arrow that is visible beyond the near plane.
struct VisibleArrow {
  ImagePoint from, to;
  bool has_head;
};

std::optional<VisibleArrow> visible_part(const Arrow& arrow, const StrokeView& view) {
  Eigen::Vector3d from_m = view.eye_from_world * arrow.from_world_m,
                  to_m = view.eye_from_world * arrow.to_world_m;
  const bool has_head = to_m.z() >= view.near_m;
  if (!has_head && !(from_m.z() >= view.near_m)) return std::nullopt;
  const auto cut = [&](Eigen::Vector3d& outside_m, const Eigen::Vector3d& inside_m) {
    if (outside_m.z() >= view.near_m) return;
    const double t = (view.near_m - outside_m.z()) / (inside_m.z() - outside_m.z());
    outside_m += t * (inside_m - outside_m);
    outside_m.z() = view.near_m;
  };
  cut(from_m, to_m);
  cut(to_m, from_m);
  return VisibleArrow{image_of(from_m, view), image_of(to_m, view), has_head};
}

// Places on and beside an arrow in the image.
class Outline {
 public:
  Outline(const VisibleArrow& arrow, const StrokeView& view)
      : arrow_(arrow), view_(view), length_px_((arrow.to.p_px - arrow.from.p_px).norm()) {
    along_ = (arrow.to.p_px - arrow.from.p_px) / length_px_;
  }
  double length_px() const { return length_px_; }
  // The point along_px after the start of the arrow, and left_px to its left. Its depth is that of
  // the nearest point of the arrow's axis: NDC depth is linear in the image.
  Eigen::Vector3f at(double along_px, double left_px) const {
    const Eigen::Vector2d p_px =
        arrow_.from.p_px + along_px * along_ + left_px * Eigen::Vector2d(-along_.y(), along_.x());
    const double t = std::clamp(along_px / length_px_, 0.0, 1.0);
    return Eigen::Vector3d(2 * p_px.x() / view_.width_px - 1, 2 * p_px.y() / view_.height_px - 1,
                           arrow_.from.depth + t * (arrow_.to.depth - arrow_.from.depth))
        .cast<float>();
  }

 private:
  const VisibleArrow& arrow_;
  const StrokeView& view_;
  double length_px_;
  Eigen::Vector2d along_;
};

}  // namespace

std::vector<StrokeCorner> strokes(std::span<const Arrow> arrows, const StrokeView& view,
                                  double shaft_px, double margin_px) {
  // An outline margin_px outside the head has its tip kTip * margin_px beyond the head's tip, and a
  // base that is kBase * margin_px wider on each side.
  static const double kTip = std::hypot(kHeadLength, kHeadHalfWidth) / kHeadHalfWidth,
                      kBase = (1 + kTip) * kHeadHalfWidth / kHeadLength;
  std::vector<StrokeCorner> corners;
  for (const Arrow& arrow : arrows) {
    const auto visible = visible_part(arrow, view);
    if (!visible) continue;
    const Outline outline(*visible, view);
    const double length_px = outline.length_px();
    if (!(length_px >= kMinLength_px && std::isfinite(length_px))) continue;
    const auto add = [&](std::initializer_list<std::pair<double, double>> triangle_px) {
      for (const auto& [along_px, left_px] : triangle_px)
        corners.push_back({outline.at(along_px, left_px), arrow.rgb});
    };
    // A short arrow has a smaller head.
    const double head_px = visible->has_head ? std::min(kHeadLength * shaft_px, length_px) : 0,
                 head_half_px = head_px * kHeadHalfWidth / kHeadLength,
                 base_px = length_px - head_px, half_px = 0.5 * shaft_px + margin_px;
    const double start_px = -margin_px, end_px = base_px + (visible->has_head ? 0 : margin_px);
    add({{start_px, -half_px}, {end_px, -half_px}, {end_px, half_px}});
    add({{start_px, -half_px}, {end_px, half_px}, {start_px, half_px}});
    if (!visible->has_head) continue;
    const double half_base_px = head_half_px + kBase * margin_px;
    add({{base_px - margin_px, -half_base_px},
         {length_px + kTip * margin_px, 0},
         {base_px - margin_px, half_base_px}});
  }
  return corners;
}

}  // namespace fivepipe::render
