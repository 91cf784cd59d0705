#include "common/pipeline/messages/wire_conversions.h"

#include <cmath>

namespace fivepipe::messages {

fivepipe_v1_Vec3 to_wire(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

fivepipe_v1_Pose to_wire(const Eigen::Isometry3d& pose) {
  const Eigen::Quaterniond q(pose.linear());
  return {to_wire(Eigen::Vector3d(pose.translation())), {q.x(), q.y(), q.z(), q.w()}};
}

fivepipe_v1_Pinhole to_wire(const geometry::Pinhole& k) {
  return {k.width_px, k.height_px, k.fx_px, k.fy_px, k.cx_px, k.cy_px};
}
fivepipe_v1_PixelRect to_wire(const hull::PixelRect& r) {
  return {r.u0_px, r.v0_px, r.u1_px, r.v1_px};
}

Eigen::Vector3d from_wire(const fivepipe_v1_Vec3& v) { return {v.x, v.y, v.z}; }
geometry::Pinhole from_wire(const fivepipe_v1_Pinhole& k) {
  return {k.width_px, k.height_px, k.fx_px, k.fy_px, k.cx_px, k.cy_px};
}
hull::PixelRect from_wire(const fivepipe_v1_PixelRect& r) {
  return {r.u0_px, r.v0_px, r.u1_px, r.v1_px};
}

std::optional<Eigen::Isometry3d> from_wire(const fivepipe_v1_Pose& pose) {
  const Eigen::Quaterniond q(pose.rotation.w, pose.rotation.x, pose.rotation.y, pose.rotation.z);
  const Eigen::Vector3d t = from_wire(pose.translation_m);
  if (!t.allFinite() || !(std::abs(q.norm() - 1) <= kMaxQuaternionError)) return std::nullopt;
  Eigen::Isometry3d isometry = Eigen::Isometry3d::Identity();
  isometry.linear() = q.normalized().toRotationMatrix();
  isometry.translation() = t;
  return isometry;
}

std::optional<std::string> why_implausible(std::uint64_t frame, std::int64_t stamp_ns) {
  if (frame > kMaxFrame) return "frame number above 2^53";
  if (stamp_ns < 0 || stamp_ns > kMaxStamp_ns) return "timestamp before 1970 or after 2200";
  return std::nullopt;
}

}  // namespace fivepipe::messages
