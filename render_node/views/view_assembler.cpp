#include "render_node/views/view_assembler.h"

#include <algorithm>
#include <utility>

namespace fivepipe::render {
namespace {

// Accepted relative difference of two poses of a light or of the head. A message holds a rotation
// as a quaternion, which rounds it.
constexpr double kSamePose = 1e-9;

bool is_same_frame(const HullFrame* a, const HullFrame& b) {
  return a && a->frame == b.frame && a->capture_stamp_ns == b.capture_stamp_ns;
}

// Returns the pose of the head, one of whose eyes has this pose.
Eigen::Isometry3d head_from_world(const config::HullView& view,
                                  const Eigen::Isometry3d& eye_from_world) {
  return config::eye_at(-view.eye_x_m, eye_from_world);
}

}  // namespace

ViewAssembler::ViewAssembler(const std::vector<config::HullView>& views) {
  for (const config::HullView& view : views)
    views_.push_back({view, TileAssembler(view.recon, view.near_m, view.far_m)});
}

std::optional<std::size_t> ViewAssembler::find(const std::string& name) const {
  const auto found = std::find_if(views_.begin(), views_.end(),
                                  [&](const View& view) { return view.of.name == name; });
  if (found == views_.end()) return std::nullopt;
  return std::size_t(found - views_.begin());
}

AddedToView ViewAssembler::add(std::size_t number, const ReceivedTile& tile, FrameOrder order) {
  View& view = views_[number];
  if (view.of.fixed && !tile.eye_from_world.isApprox(*view.of.fixed, kSamePose))
    return RefusedTile{"pose of another light"};
  AddedTile added = view.tiles.add(tile, order);
  if (RefusedTile* const refused = std::get_if<RefusedTile>(&added)) return std::move(*refused);
  HullFrame* const hull = std::get_if<HullFrame>(&added);
  if (!hull) return {};
  auto [kept, displaced] = view.complete.get_or_add(hull->frame);
  kept = std::move(*hull);
  if (view.of.fixed) return {};
  missing_eye_ += displaced.has_value();
  return joined(kept, order);
}

// Returns the frame in all eyes if it is complete in each of them.
AddedToView ViewAssembler::joined(const HullFrame& last, FrameOrder order) {
  const std::uint64_t frame = last.frame;
  for (const View& view : views_)
    if (!view.of.fixed && !is_same_frame(view.complete.find(frame), last)) return {};
  EyeFrames eyes;
  Eigen::Isometry3d head = Eigen::Isometry3d::Identity();
  bool is_one_head = true;
  for (View& view : views_) {
    if (view.of.fixed) continue;
    eyes.push_back(*view.complete.take(frame));
    if (order == FrameOrder::completion) missing_eye_ += view.complete.erase_up_to(frame);
    const Eigen::Isometry3d of_eye = head_from_world(view.of, eyes.back().eye_from_world);
    if (eyes.size() == 1) head = of_eye;
    is_one_head &= of_eye.isApprox(head, kSamePose);
  }
  if (!is_one_head) return RefusedTile{"eyes of another distance"};
  return eyes;
}

const HullFrame* ViewAssembler::light_of(const HullFrame& eye) const {
  for (const View& view : views_)
    if (const HullFrame* const found = view.complete.find(eye.frame);
        view.of.fixed && is_same_frame(found, eye))
      return found;
  return nullptr;
}

bool ViewAssembler::lacks_light_of(const HullFrame& eye) const {
  return std::any_of(views_.begin(), views_.end(),
                     [](const View& view) { return view.of.fixed.has_value(); }) &&
         !light_of(eye);
}

void ViewAssembler::reset() {
  for (View& view : views_) {
    view.tiles.reset();
    if (!view.of.fixed) missing_eye_ += view.complete.size();
    view.complete.clear();
  }
}

ViewCounts ViewAssembler::counts() const {
  ViewCounts counts;
  for (const View& view : views_) counts += view.tiles.counts();
  counts.missing_eye = missing_eye_;
  return counts;
}

}  // namespace fivepipe::render
