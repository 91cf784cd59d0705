#include <fmt/format.h>

#include "common/base/text_table.h"
#include "launch/export/session_export.h"

namespace fivepipe::exports {
namespace {

constexpr double kLitres_m3 = 1e3;

std::string swept_text(const SweptResult& swept) {
  const double excess_m3 = swept.volume_m3 - swept.hull_volume_m3;
  std::string text =
      fmt::format("Swept volume: {:.3f} l, closed, {}. It contains every point of each hull.\n",
                  kLitres_m3 * swept.volume_m3, base::counted(swept.triangles, "triangle"));
  if (swept.hull_volume_m3 > 0)
    text += fmt::format(
        "The hulls themselves sweep {:.3f} l (standard error at most {:.3f} l): its excess is "
        "{:.3f} l,\n{:.1f} %, because it consists of whole cells.\n",
        kLitres_m3 * swept.hull_volume_m3, kLitres_m3 * swept.hull_volume_error_m3,
        kLitres_m3 * excess_m3, 100 * excess_m3 / swept.hull_volume_m3);
  return text;
}

}  // namespace

std::string text_of(const ExportRequest& request, const ExportSummary& summary) {
  std::string text = fmt::format("{}: {} in {}\n", request.recording.string(),
                                 base::counted(summary.files, "file"), request.folder.string());
  if (summary.frames > 0)
    text += fmt::format("{} of {} exported.\n", summary.frames,
                        base::counted(summary.frames_in_recording, "complete frame"));
  if (request.composites)
    text += base::counted(summary.composited, "composited frame") + " in composite.mp4.\n";
  if (summary.swept) text += swept_text(*summary.swept);
  if ((request.meshes || request.points || request.volumes) && summary.without_mesh > 0)
    text += fmt::format(
        "Frames without a surface, because there is no hull or it is thinner than a cell: {}.\n",
        summary.without_mesh);
  if ((request.meshes || request.points) && request.colour && summary.without_colour > 0)
    text += fmt::format("Frames without recorded colour: {}.\n", summary.without_colour);
  if (summary.without_pose > 0)
    text += fmt::format("Frames without depth, because no head pose was recorded: {}.\n",
                        summary.without_pose);
  for (const auto& [reason, count] : summary.drops)
    text += fmt::format("Dropped of the recording: {} ({}).\n", reason, count);
  if (!summary.first_fault.empty())
    text += "The first fault: " + base::printable(summary.first_fault) + '\n';
  if (!summary.damage.empty())
    text += base::printable(summary.damage) + ": only what could be read was exported.\n";
  return text;
}

}  // namespace fivepipe::exports
