#include "common/study/report/study.h"

#include <fmt/format.h>

#include <cmath>
#include <set>
#include <stdexcept>
#include <string_view>

#include "common/base/text_table.h"

namespace fivepipe::study::report {
namespace {

// A spacing's direction may differ from a unit vector by rounding.
constexpr double kUnitTolerance = 1e-6;
constexpr std::string_view kPngSignature = "\x89PNG\r\n\x1a\n";

class Problems {
 public:
  void require(bool holds, const std::string& place, const std::string& what) {
    if (!holds) found_.push_back(base::printable(place) + ": " + what);
  }
  void finite(double value, const std::string& place) {
    require(std::isfinite(value), place, fmt::format("{} is not a finite number", value));
  }
  // Finite and not negative.
  void amount(double value, const std::string& place) {
    require(std::isfinite(value) && value >= 0, place,
            fmt::format("{} is not a finite number >= 0", value));
  }
  // Both ends may be infinite.
  void bracket(const Bracket& bracket, const std::string& place) {
    require(bracket.min_m >= 0 && bracket.min_m <= bracket.max_m, place,
            fmt::format("no bracket of a length: {} to {} m", bracket.min_m, bracket.max_m));
  }
  void mesh(const geometry::Mesh& mesh, const std::string& place) {
    for (const Eigen::Vector3d& p_m : mesh.vertices_m)
      if (!p_m.allFinite()) {
        require(false, place, "a vertex of the mesh is not finite");
        break;
      }
    for (const auto& triangle : mesh.triangles)
      for (const std::uint32_t index : triangle)
        if (index >= mesh.vertices_m.size()) {
          require(false, place,
                  fmt::format("a triangle has vertex {} of {}", index, mesh.vertices_m.size()));
          return;
        }
  }
  void interval(const collision::SpacingInterval& interval, const std::string& place) {
    require(std::isfinite(interval.low_m) && std::isfinite(interval.high_m) &&
                interval.low_m <= interval.high_m,
            place, fmt::format("no interval: {} to {} m", interval.low_m, interval.high_m));
  }
  void end() const {
    if (!found_.empty())
      throw std::invalid_argument("cannot report the study: " + base::joined(found_, "; "));
  }

 private:
  std::vector<std::string> found_;
};

void check_answers(const Answers& answers, const std::string& place, Problems& problems) {
  for (const auto* answer : {&answers.necessary_before, &answers.allocated_before, &answers.found,
                             &answers.allocated_after}) {
    if (!*answer) continue;
    problems.amount((*answer)->low_m, place + ", an answer");
    if ((*answer)->high_m)
      problems.require(std::isfinite(*(*answer)->high_m) && *(*answer)->high_m >= (*answer)->low_m,
                       place, "an answer's range does not ascend");
  }
}

void check_clearance(const Clearance& clearance, const std::string& place, Problems& problems) {
  problems.amount(clearance.cap_m, place + ", cap");
  problems.require(clearance.times_s.size() == clearance.distances.size(), place,
                   fmt::format("{} times and {} distances", clearance.times_s.size(),
                               clearance.distances.size()));
  for (std::size_t i = 0; i < clearance.times_s.size(); ++i) {
    problems.amount(clearance.times_s[i], place + ", time");
    if (i > 0)
      problems.require(clearance.times_s[i] > clearance.times_s[i - 1], place,
                       "times do not ascend");
  }
  for (const Bracket& distance : clearance.distances) {
    problems.bracket(distance, place);
    problems.require(std::isfinite(distance.min_m), place, "a minimum is infinite");
  }
  for (const ErrorSource& error : clearance.errors)
    if (error.bound_mm) problems.amount(*error.bound_mm, place + ", error bound of " + error.name);
}

void check_part_result(const PartResult& result, const std::string& place, Problems& problems) {
  problems.amount(result.collision_s, place + ", collision_s");
  double last_s = 0;
  for (const Event& event : result.events) {
    problems.amount(event.start_s, place + ", start of an event");
    problems.require(std::isfinite(event.end_s) && event.end_s >= event.start_s, place,
                     "an event ends before it starts");
    problems.require(event.start_s >= last_s, place, "the events do not ascend");
    last_s = event.start_s;
    if (event.penetration) problems.bracket(*event.penetration, place + ", penetration");
    problems.require(event.picture_png.empty() || event.picture_png.starts_with(kPngSignature),
                     place, "a picture is no PNG file");
  }
  if (result.clearance) check_clearance(*result.clearance, place + ", clearance", problems);
}

void check_curve(const WhatIfCurve& curve, const std::string& place, Problems& problems) {
  problems.interval(curve.range, place);
  for (const collision::SpacingInterval& free : curve.result.free) problems.interval(free, place);
  for (std::size_t i = 0; i < curve.result.layouts.size(); ++i) {
    const LayoutResult& layout = curve.result.layouts[i];
    problems.finite(layout.spacing_m, place + ", spacing");
    if (i > 0)
      problems.require(layout.spacing_m > curve.result.layouts[i - 1].spacing_m, place,
                       "spacings do not ascend");
    problems.amount(layout.collision_s, place + ", collision_s");
    if (!curve.with_distances) continue;
    problems.bracket(layout.clearance, place + ", clearance");
    problems.bracket(layout.penetration, place + ", penetration");
  }
}

void check_trial(const Trial& trial, const std::string& place, Problems& problems) {
  problems.amount(trial.duration_s, place + ", duration");
  check_answers(trial.answers, place, problems);
  for (const Note& note : trial.notes) problems.amount(note.time_s, place + ", time of a note");
  double last_s = 0;
  for (const LayoutChange& change : trial.layout_changes) {
    problems.amount(change.time_s, place + ", time of a layout change");
    problems.require(change.time_s >= last_s, place, "the layout changes do not ascend");
    last_s = change.time_s;
    problems.finite(change.spacing_m, place + ", spacing of " + change.part);
  }
  for (const PartResult& result : trial.parts)
    check_part_result(result, place + ", part " + result.part, problems);
  for (const WhatIfCurve& curve : trial.what_if)
    check_curve(curve, place + ", what-if of " + curve.part, problems);
  for (const SweptVolume& swept : trial.swept)
    problems.mesh(swept.mesh, place + ", swept volume of " + swept.of);
}

void check_parts(const std::vector<Part>& scene, Problems& problems) {
  std::set<std::string> names;
  for (const Part& part : scene) {
    const std::string place = "part " + part.name;
    problems.require(names.insert(part.name).second, place, "two parts have this name");
    problems.mesh(part.mesh, place);
    if (!part.axis) continue;
    problems.require(std::abs(part.axis->direction.norm() - 1) < kUnitTolerance, place,
                     "the direction of its axis is no unit vector");
    problems.finite(part.axis->mesh_spacing_m, place + ", spacing of the mesh");
    problems.interval(part.axis->range, place + ", range");
  }
}

}  // namespace

double Clearance::error_m() const {
  double sum_mm = 0;
  for (const ErrorSource& error : errors) sum_mm += error.bound_mm.value_or(0);
  return 1e-3 * sum_mm;
}

std::optional<double> WhatIfCurve::min_free_m() const {
  const double spacing_m = min_free_spacing_m(result, range);
  return std::isfinite(spacing_m) ? std::optional(spacing_m) : std::nullopt;
}

void check(const Study& study) {
  Problems problems;
  std::set<std::string> pseudonyms;
  for (const std::vector<Part>& scene : study.scenes) check_parts(scene, problems);
  for (const Participant& participant : study.participants) {
    problems.require(pseudonyms.insert(participant.pseudonym).second,
                     "participant " + participant.pseudonym, "two participants have this name");
    int last = std::numeric_limits<int>::min();
    for (const Trial& trial : participant.trials) {
      const std::string place =
          fmt::format("participant {}, trial {}", participant.pseudonym, trial.number);
      problems.require(trial.number > last, place, "the numbers of the trials do not ascend");
      last = trial.number;
      check_trial(trial, place, problems);
      problems.require(!trial.scene || *trial.scene < study.scenes.size(), place,
                       "the study does not have its scene");
    }
  }
  problems.end();
}

}  // namespace fivepipe::study::report
