#include "launch/study/what_if/part_words.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "common/base/usage_error.h"
#include "common/config/mesh/mesh_file.h"
#include "launch/units/length.h"

namespace fivepipe::study {
namespace {

using Eigen::Vector3d;

constexpr double kMaxLength_m = 500;
constexpr double kDegree_rad = EIGEN_PI / 180;

[[noreturn]] void refuse_word(const std::string& option, const std::string& text,
                              const std::string& form) {
  throw base::UsageError(option + ": '" + text + "' is " + form);
}

double length_from(const std::string& option, const std::string& text) {
  const auto length = length_m(text);
  if (!length)
    refuse_word(option, text,
                "no length; write a number and its unit, such as 18cm, 180mm, 0.18m or 7in");
  if (!(std::abs(*length) <= kMaxLength_m)) refuse_word(option, text, "longer than 500 m");
  return *length;
}

collision::SpacingInterval range_from(const std::string& text) {
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos)
    throw base::UsageError("--range: write FROM:TO, such as 14cm:30cm, not '" + text + "'");
  const collision::SpacingInterval range{length_from("--range", text.substr(0, colon)),
                                         length_from("--range", text.substr(colon + 1))};
  if (range.low_m > range.high_m)
    throw base::UsageError("--range: " + text + " begins after its end");
  return range;
}

// Returns false if the text is not three numbers with commas.
bool three_numbers(const std::string& text, Vector3d& numbers) {
  char rest = 0;
  return std::sscanf(text.c_str(), "%lf,%lf,%lf%c", &numbers.x(), &numbers.y(), &numbers.z(),
                     &rest) == 3 &&
         numbers.allFinite();
}

Vector3d axis_from(const std::string& text) {
  for (int i = 0; i < 3; ++i)
    for (const double sign : {1.0, -1.0})
      if (text == (sign < 0 ? "-" : "") + std::string(1, char('x' + i)))
        return sign * Vector3d::Unit(i);
  Vector3d axis = Vector3d::Zero();
  if (three_numbers(text, axis) && axis.norm() > 0) return axis.normalized();
  refuse_word("--axis", text, "none of x, y, z, -x, -y, -z and DX,DY,DZ");
}

Vector3d position_from(const std::string& text) {
  const std::size_t first = text.find(','), last = text.rfind(',');
  if (first == std::string::npos || std::count(text.begin(), text.end(), ',') != 2)
    refuse_word("--position", text, "not X,Y,Z, such as 30cm,0cm,52cm");
  return {length_from("--position", text.substr(0, first)),
          length_from("--position", text.substr(first + 1, last - first - 1)),
          length_from("--position", text.substr(last + 1))};
}

// As rotation_deg of the scene file: about the world's x, then y, then z axis.
Eigen::Quaterniond rotation_from(const std::string& text) {
  Vector3d angles_deg = Vector3d::Zero();
  if (!three_numbers(text, angles_deg))
    refuse_word("--rotation", text, "not X,Y,Z in degrees, such as 0,0,90");
  const Vector3d angles_rad = kDegree_rad * angles_deg;
  return Eigen::AngleAxisd(angles_rad.z(), Vector3d::UnitZ()) *
         Eigen::AngleAxisd(angles_rad.y(), Vector3d::UnitY()) *
         Eigen::AngleAxisd(angles_rad.x(), Vector3d::UnitX());
}

// "FILE,UNIT", or "FILE.glb" or "FILE.step"
AddedMesh mesh_from(const PartWords& words) {
  AddedMesh mesh;
  const std::size_t comma = words.mesh.rfind(',');
  mesh.file = words.mesh.substr(0, comma);
  const std::string unit = comma == std::string::npos ? "" : words.mesh.substr(comma + 1);
  const bool is_unit = unit == "m" || unit == "cm" || unit == "mm" || unit == "in";
  const auto unit_m = is_unit ? length_m("1" + unit) : std::nullopt;
  if (comma == std::string::npos ? !config::has_unit(mesh.file) : !unit_m)
    refuse_word("--mesh", words.mesh,
                "not FILE,UNIT with m, cm, mm or in, such as bracket.stl,mm; only glTF and STEP "
                "need no unit");
  mesh.unit_m = unit_m;
  if (!words.position.empty()) mesh.world_from_mesh.translation() = position_from(words.position);
  if (!words.rotation.empty())
    mesh.world_from_mesh.linear() = rotation_from(words.rotation).toRotationMatrix();
  return mesh;
}

}  // namespace

std::vector<PartWords> parts_of_words(const std::vector<PartWord>& words) {
  static constexpr std::array<std::pair<const char*, std::string PartWords::*>, 7> kOptions{
      {{"--part", &PartWords::part},
       {"--axis", &PartWords::axis},
       {"--at", &PartWords::at},
       {"--range", &PartWords::range},
       {"--mesh", &PartWords::mesh},
       {"--position", &PartWords::position},
       {"--rotation", &PartWords::rotation}}};
  std::vector<PartWords> parts;
  if (words.empty()) return parts;
  parts.emplace_back();
  for (const auto& [option, value] : words) {
    if (option == "--part") {
      if (std::ranges::find(parts, value, &PartWords::part) != parts.end())
        throw base::UsageError("--part: " + value + " is there twice");
      if (!parts.back().part.empty()) parts.emplace_back();
    }
    for (const auto& [name, member] : kOptions) {
      if (name != option) continue;
      std::string& word = parts.back().*member;
      if (!word.empty())
        throw base::UsageError(option + ": twice for the part " + parts.back().part +
                               "; write the options of a part after its --part");
      word = value;
    }
  }
  if (parts.front().part.empty())
    throw base::UsageError(words.front().first + ": name its part: --part NAME");
  return parts;
}

WhatIfPart part_from(const PartWords& words) {
  WhatIfPart part;
  part.name = words.part;
  if (words.mesh.empty() && !(words.position.empty() && words.rotation.empty()))
    throw base::UsageError(
        "--position and --rotation place a mesh that was not in the recording; "
        "give it by --mesh FILE,UNIT");
  if (!words.mesh.empty()) {
    if (part.name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_") != std::string::npos)
      refuse_word("--part", part.name, "no name of a-z, 0-9 and _");
    part.added = mesh_from(words);
  }
  part.axis_of_scene = words.axis.empty();
  part.at_of_scene = words.at.empty();
  part.range_of_scene = words.range.empty();
  if (!part.axis_of_scene) part.axis_world = axis_from(words.axis);
  if (!part.range_of_scene) part.range = range_from(words.range);
  if (!part.at_of_scene) part.at_m = length_from("--at", words.at);
  return part;
}

}  // namespace fivepipe::study
