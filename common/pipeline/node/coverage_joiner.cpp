#include "common/pipeline/node/coverage_joiner.h"

#include <algorithm>
#include <utility>

namespace fivepipe::node {

void CoverageJoiner::add(std::uint64_t writer, messages::CameraCoverage coverage) {
  std::vector<Sent>& sent = frames_.get_or_add(coverage.frame).value[coverage.camera];
  std::erase_if(sent, [&](const Sent& one) { return one.writer == writer; });
  if (sent.size() == kMaxWriters) sent.erase(sent.begin());
  sent.push_back({writer, std::move(coverage)});
}

std::vector<std::string> CoverageJoiner::join(frames::FrameSet& set,
                                              const IsSameProcess& is_same_process) {
  OfFrame of_frame = frames_.take(set.frame).value_or(OfFrame());
  frames_.erase_up_to(set.frame);
  std::vector<std::string> missing;
  for (std::size_t i = 0; i < set.silhouettes.size(); ++i) {
    const frames::SilhouetteSource& source = set.sources[i];
    const hull::ObjectPixels& pixels = set.silhouettes[i].pixels;
    hull::CoverageOutline& outline = set.outlines.emplace_back(
        hull::CoverageOutline{hull::ObjectPixels(pixels.width_px(), pixels.height_px()), {}});
    std::vector<Sent>& sent = of_frame[*messages::camera_index(rig_, set.cameras[i].c_str())];
    const auto found = std::find_if(sent.begin(), sent.end(), [&](const Sent& one) {
      return one.coverage.capture_stamp_ns == source.capture_stamp_ns &&
             is_same_process(one.writer, source.writer);
    });
    if (found == sent.end())
      missing.push_back(set.cameras[i]);
    else
      outline = std::move(found->coverage.outline);
  }
  if (missing.size() == set.silhouettes.size()) set.outlines.clear();
  return missing;
}

}  // namespace fivepipe::node
