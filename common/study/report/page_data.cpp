#include "common/study/report/page_data.h"

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "common/study/report/answers_table.h"
#include "common/study/report/escape.h"

namespace fivepipe::study::report {
namespace {

using nlohmann::ordered_json;

constexpr double kSteps = 65535;  // of a coordinate in 16 bits

ordered_json rounded(double value) {
  return std::isfinite(value) ? ordered_json(std::round(1e3 * value) / 1e3) : nullptr;
}
ordered_json vector_json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

void append_little_endian(std::uint32_t value, int bytes, std::string& text) {
  for (int i = 0; i < bytes; ++i) text += char(std::uint8_t(value >> (8 * i)));
}

std::string compressed(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string packed(size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(packed.data()), &size,
                reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(), 9) != Z_OK)
    throw std::runtime_error("zlib cannot compress a mesh");
  packed.resize(size);
  return packed;
}

ordered_json clearance_json(const Clearance& clearance) {
  ordered_json json{{"time_s", ordered_json::array()},
                    {"min_cm", ordered_json::array()},
                    {"max_cm", ordered_json::array()},
                    {"cap_cm", json_cm(clearance.cap_m)},
                    {"error_cm", json_cm(clearance.error_m())}};
  for (std::size_t i = 0; i < clearance.times_s.size(); ++i) {
    json["time_s"].push_back(rounded(clearance.times_s[i]));
    json["min_cm"].push_back(json_cm(clearance.distances[i].min_m));
    json["max_cm"].push_back(json_cm(clearance.distances[i].max_m));
  }
  return json;
}

ordered_json part_result_json(const PartResult& result) {
  ordered_json json{{"part", result.part}, {"events_s", ordered_json::array()}};
  for (const Event& event : result.events)
    json["events_s"].push_back({rounded(event.start_s), rounded(event.end_s)});
  json["clearance"] = result.clearance ? clearance_json(*result.clearance) : ordered_json();
  return json;
}

ordered_json trial_json(const Participant& participant, const Trial& trial) {
  ordered_json json{{"participant", participant.pseudonym},
                    {"number", trial.number},
                    {"duration_s", rounded(trial.duration_s)},
                    {"parts", ordered_json::array()},
                    {"what_if", ordered_json::array()},
                    {"swept", ordered_json::array()},
                    {"changes", ordered_json::array()},
                    {"scene", trial.scene ? ordered_json(*trial.scene) : ordered_json()}};
  for (const PartResult& result : trial.parts) json["parts"].push_back(part_result_json(result));
  for (const WhatIfCurve& curve : trial.what_if) json["what_if"].push_back(curve_json(curve));
  for (const SweptVolume& swept : trial.swept)
    json["swept"].push_back({{"of", swept.of}, {"mesh", packed_mesh(swept.mesh)}});
  for (const LayoutChange& change : trial.layout_changes)
    json["changes"].push_back({{"time_s", rounded(change.time_s)},
                               {"part", change.part},
                               {"spacing_cm", json_cm(change.spacing_m)}});
  return json;
}

ordered_json part_json(const Part& part) {
  ordered_json json{{"name", part.name},
                    {"colour_rgb", part.colour_rgb},
                    {"was_in_recording", part.was_in_recording},
                    {"mesh", packed_mesh(part.mesh)},
                    {"axis", nullptr}};
  if (part.axis)
    json["axis"] = {{"direction", vector_json(part.axis->direction)},
                    {"mesh_spacing_cm", json_cm(part.axis->mesh_spacing_m)},
                    {"low_cm", json_cm(part.axis->range.low_m)},
                    {"high_cm", json_cm(part.axis->range.high_m)}};
  return json;
}

// One list per row of Table 1; null: no answer. A range is given by its middle.
ordered_json answers_json(const Study& study) {
  ordered_json json{{"participants", ordered_json::array()}, {"rows_cm", ordered_json::array()}};
  const std::vector<AnswersColumn> columns = answers_columns(study);
  for (const AnswersColumn& column : columns) json["participants"].push_back(column.pseudonym);
  for (const AnswersRow& row : answers_rows()) {
    ordered_json values = ordered_json::array();
    for (const AnswersColumn& column : columns) {
      const std::optional<Answer>& answer = column.answers.*row.answer;
      values.push_back(answer ? json_cm(answer->middle_m()) : ordered_json());
    }
    json["rows_cm"].push_back(values);
  }
  return json;
}

}  // namespace

ordered_json json_cm(double length_m) { return rounded(100 * length_m); }
ordered_json json_s(double time_s) { return rounded(time_s); }

ordered_json curve_json(const WhatIfCurve& curve) {
  ordered_json json{{"part", curve.part},
                    {"range_cm", {json_cm(curve.range.low_m), json_cm(curve.range.high_m)}},
                    {"with_distances", curve.with_distances},
                    {"free_cm", ordered_json::array()}};
  // Rounds both ends towards the middle, so that the chart shows only certified spacings as free.
  for (const collision::SpacingInterval& free : curve.result.free)
    json["free_cm"].push_back(
        {std::ceil(1e5 * free.low_m - 1e-6) / 1e3, std::floor(1e5 * free.high_m + 1e-6) / 1e3});
  for (const char* list : {"spacing_cm", "collision_s", "undecided", "penetration_min_cm",
                           "penetration_max_cm", "clearance_min_cm", "clearance_max_cm"})
    json[list] = ordered_json::array();
  for (const LayoutResult& layout : curve.result.layouts) {
    json["spacing_cm"].push_back(json_cm(layout.spacing_m));
    json["collision_s"].push_back(rounded(layout.collision_s));
    json["undecided"].push_back(layout.undecided_frames > 0);
    json["penetration_min_cm"].push_back(json_cm(layout.penetration.min_m));
    json["penetration_max_cm"].push_back(json_cm(layout.penetration.max_m));
    json["clearance_min_cm"].push_back(json_cm(layout.clearance.min_m));
    json["clearance_max_cm"].push_back(json_cm(layout.clearance.max_m));
  }
  return json;
}

ordered_json packed_mesh(const geometry::Mesh& mesh) {
  const Eigen::AlignedBox3d box = geometry::bounds_m(mesh);
  const bool is_empty = mesh.vertices_m.empty();
  const Eigen::Vector3d low_m = is_empty ? Eigen::Vector3d(0, 0, 0) : box.min();
  const Eigen::Vector3d step_m =
      is_empty ? Eigen::Vector3d(0, 0, 0) : Eigen::Vector3d(box.sizes() / kSteps);
  std::string bytes;
  for (int axis = 0; axis < 3; ++axis) {
    std::uint32_t last = 0;
    for (const Eigen::Vector3d& p_m : mesh.vertices_m) {
      const double steps =
          step_m[axis] > 0 ? std::round((p_m[axis] - low_m[axis]) / step_m[axis]) : 0;
      const auto step = std::uint32_t(std::clamp(steps, 0.0, kSteps));
      append_little_endian(step - last, 2, bytes);
      last = step;
    }
  }
  std::uint32_t last = 0;
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t index : triangle) {
      append_little_endian(index - last, 4, bytes);
      last = index;
    }
  return {{"low_m", vector_json(low_m)},
          {"step_m", vector_json(step_m)},
          {"vertices", mesh.vertices_m.size()},
          {"triangles", mesh.triangles.size()},
          {"packed", base64(compressed(bytes))}};
}

ordered_json page_data(const Study& study) {
  ordered_json json{{"scenes", ordered_json::array()},
                    {"trials", ordered_json::array()},
                    {"answers", answers_json(study)}};
  for (const std::vector<Part>& scene : study.scenes) {
    ordered_json& parts = json["scenes"].emplace_back(ordered_json::array());
    for (const Part& part : scene) parts.push_back(part_json(part));
  }
  for (const Participant& participant : study.participants)
    for (const Trial& trial : participant.trials)
      json["trials"].push_back(trial_json(participant, trial));
  return json;
}

}  // namespace fivepipe::study::report
