#include "common/config/objects/joint_reader.h"

#include <fmt/format.h>

#include "common/config/yaml/numbers.h"

namespace fivepipe::config {
namespace {

constexpr Range kDamping_1_s{0, 1000};
constexpr double kMaxSlide_m = 100;

Joint read_joint_of(YamlMap map, JointKind kind) {
  Joint joint{.kind = kind};
  const bool is_hinge = kind == JointKind::hinge;
  const std::string from_key = is_hinge ? "from_deg" : "from_m",
                    to_key = is_hinge ? "to_deg" : "to_m";
  const double largest = is_hinge ? kMaxHinge_deg : kMaxSlide_m, scale = is_hinge ? kDegree_rad : 1;
  if (is_hinge) joint.point_m = map.vector3("point_m", kAny);
  if (map.has("axis")) {
    if (const auto axis = map.direction("axis")) joint.axis = axis->normalized();
  } else {
    map.vector3("axis", kAny);  // reports that it is missing
  }
  const std::size_t problems_before = map.problem_count();
  const double from = map.number(from_key, {-largest, largest}, 0),
               to = map.number(to_key, {-largest, largest}, 0);
  if (from > 0)
    map.problem_at(from_key, fmt::format("{} must be at most 0, where the object starts, is {:g}",
                                         from_key, from));
  if (to < 0)
    map.problem_at(
        to_key, fmt::format("{} must be at least 0, where the object starts, is {:g}", to_key, to));
  joint.lowest = scale * from;
  joint.highest = scale * to;
  joint.damping_1_s = map.number("damping_1_s", kDamping_1_s, joint.damping_1_s);
  map.finish();
  if (map.problem_count() == problems_before && !(from < to))
    map.problem(fmt::format("the joint cannot move: set {}, {} or both", from_key, to_key));
  return joint;
}

}  // namespace

std::optional<Joint> read_joint(YamlMap& object) {
  const bool has_hinge = object.has("hinge"), has_slider = object.has("slider");
  if (has_hinge && has_slider)
    object.problem_at("slider", "hinge and slider are both set: an object has one joint");
  if (has_hinge) return read_joint_of(object.map("hinge"), JointKind::hinge);
  if (has_slider) return read_joint_of(object.map("slider"), JointKind::slider);
  return std::nullopt;
}

}  // namespace fivepipe::config
