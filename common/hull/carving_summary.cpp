// summary() of a VolumeDiagnosis.
#include <algorithm>
#include <cstdio>
#include <numeric>

#include "common/hull/carving_diagnosis.h"

namespace fivepipe::hull {
namespace {

// The summary omits cameras that alone remove less than this fraction of what the others keep.
constexpr double kReportThreshold = 0.01;

std::string litres(double volume_m3) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g litres", 1e3 * volume_m3);
  return text;
}
std::string litres(const SampledVolume& v) {
  char text[64];
  std::snprintf(text, sizeof text, "%.3g +- %.1g litres", 1e3 * v.volume_m3, 1e3 * v.error_m3);
  return text;
}
std::string percent(double part, double whole) {
  char text[32];
  std::snprintf(text, sizeof text, "%.0f %%", whole > 0 ? 100 * part / whole : 0.0);
  return text;
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i)
    text += (i == 0 ? "" : i + 1 == words.size() ? " and " : ", ") + words[i];
  return text;
}

// Cameras that make the hull empty regardless of the others.
std::string describe_unusable_cameras(const VolumeDiagnosis& diagnosis,
                                      const std::vector<std::string>& names) {
  std::vector<std::string> blind, unusable;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (diagnosis.cameras[i].unusable)
      unusable.push_back(names[i]);
    else if (diagnosis.cameras[i].no_object_pixel)
      blind.push_back(names[i]);
  }
  std::string text;
  if (!unusable.empty())
    text += " The calibration of " + joined(unusable) + " is not finite, so there is no hull.";
  if (!blind.empty())
    text += " No object pixel in " + joined(blind) + ": " +
            (blind.size() > 1 ? "they remove everything in their views."
                              : "it removes everything in its view.");
  return text;
}

std::string describe_contribution(const CameraContribution& contribution, const std::string& name) {
  std::string text =
      " " + name + " alone removes " +
      percent(contribution.removed_alone.volume_m3, contribution.kept_by_others.volume_m3) +
      " of what the others keep: " + litres(contribution.removed_alone) + " of " +
      litres(contribution.kept_by_others);
  if (contribution.removed_alone_unseen.volume_m3 > 0.5 * contribution.removed_alone.volume_m3)
    text += "; most of that is outside its image or behind it";
  return text + ".";
}

}  // namespace

std::string summary(const VolumeDiagnosis& diagnosis, std::span<const std::string> given_names) {
  if (diagnosis.cameras.empty()) return "There is no camera, so there is no hull.";
  if (!(diagnosis.box_world_m.sizes().minCoeff() > 0))
    return "The box is empty, so it has no volume to measure.";
  std::vector<std::string> names;
  for (std::size_t i = 0; i < diagnosis.cameras.size(); ++i)
    names.push_back(i < given_names.size() && !given_names[i].empty()
                        ? given_names[i]
                        : "camera " + std::to_string(i));
  const double box_m3 = diagnosis.box_world_m.sizes().prod();
  std::string text =
      diagnosis.hull.volume_m3 > 0
          ? "The hull fills " + litres(diagnosis.hull) + ", " +
                percent(diagnosis.hull.volume_m3, box_m3) + " of the box."
          : "The hull is empty in this box (less than " + litres(diagnosis.hull.error_m3) + ").";
  text += describe_unusable_cameras(diagnosis, names);
  std::vector<std::size_t> order(names.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return diagnosis.cameras[a].removed_alone.volume_m3 >
           diagnosis.cameras[b].removed_alone.volume_m3;
  });
  bool found = false;
  for (const std::size_t i : order) {
    const CameraContribution& contribution = diagnosis.cameras[i];
    if (contribution.removed_alone.volume_m3 <=
        kReportThreshold * contribution.kept_by_others.volume_m3)
      continue;
    text += describe_contribution(contribution, names[i]);
    found = true;
  }
  if (!found && diagnosis.cameras.size() > 1)
    text += diagnosis.hull.volume_m3 > 0
                ? " No single camera removes more than 1 % of what the others keep."
                : " No single camera empties it: other cameras remove the same points.";
  if (diagnosis.too_few.volume_m3 > 0)
    text +=
        " " + litres(diagnosis.too_few) + " are removed by no camera but seen by too few cameras.";
  return text;
}

}  // namespace fivepipe::hull
