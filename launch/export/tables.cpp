#include "launch/export/tables.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace fivepipe::exports {
namespace {

std::string begin_of(const FrameTime& time) {
  return fmt::format("{},{},{},{:.6f}", time.index, time.frame, time.capture_stamp_ns, time.time_s);
}

constexpr const char* kBeginHead = "index,frame,capture_stamp_ns,time_s";

std::string text_of_vector(const Eigen::Vector3d& v) {
  return fmt::format("{:.6g},{:.6g},{:.6g}", v.x(), v.y(), v.z());
}

const char* text_of_origin(collision::ComponentOrigin origin) {
  switch (origin) {
    case collision::ComponentOrigin::appeared: return "appeared";
    case collision::ComponentOrigin::tracked: return "tracked";
    case collision::ComponentOrigin::merged: return "merged";
    case collision::ComponentOrigin::split: return "split";
  }
  return "";
}

}  // namespace

std::string frames_head() {
  return std::string(kBeginHead) + ",duration_s,volume_m3,area_m2,vertices,triangles\n";
}

std::string frame_line(const FrameTime& time, const FrameFigures& figures) {
  return fmt::format("{},{:.6f},{:.8g},{:.8g},{},{}\n", begin_of(time), time.duration_s,
                     figures.volume_m3, figures.area_m2, figures.vertices, figures.triangles);
}

std::string components_head() {
  return std::string(kBeginHead) +
         ",id,origin,from,volume_m3,centroid_x_m,centroid_y_m,centroid_z_m,box_min_x_m,"
         "box_min_y_m,box_min_z_m,box_max_x_m,box_max_y_m,box_max_z_m,clipped,"
         "velocity_x_m_s,velocity_y_m_s,velocity_z_m_s,angular_velocity_x_rad_s,"
         "angular_velocity_y_rad_s,angular_velocity_z_rad_s,determined_axes\n";
}

std::string component_lines(const FrameTime& time,
                            const std::vector<collision::TrackedComponent>& components) {
  std::string lines;
  for (const collision::TrackedComponent& tracked : components) {
    const collision::HullComponent& component = tracked.component;
    lines += fmt::format("{},{},{},{},{:.6g},{},{},{},{:d},", begin_of(time), tracked.id,
                         text_of_origin(tracked.origin), fmt::join(tracked.from, " "),
                         component.volume_m3, text_of_vector(component.centroid_world_m),
                         text_of_vector(component.box_world_m.min()),
                         text_of_vector(component.box_world_m.max()), component.clipped);
    if (tracked.motion)
      lines += fmt::format("{},{},{}\n", text_of_vector(tracked.motion->velocity_world_m_s),
                           text_of_vector(tracked.motion->angular_velocity_world_rad_s),
                           tracked.motion->determined_axes);
    else
      lines += ",,,,,,\n";
  }
  return lines;
}

std::string views_head() {
  std::string head = std::string(kBeginHead) + ",width_px,height_px,fx_px,fy_px,cx_px,cy_px";
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column)
      head += fmt::format(",camera_from_world_{}{}", row, column);
  return head + '\n';
}

std::string view_line(const FrameTime& time, const geometry::Camera& camera) {
  const geometry::Pinhole& k = camera.pinhole;
  std::string line = fmt::format("{},{},{},{:.9g},{:.9g},{:.9g},{:.9g}", begin_of(time), k.width_px,
                                 k.height_px, k.fx_px, k.fy_px, k.cx_px, k.cy_px);
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column)
      line += fmt::format(",{:.12g}", camera.camera_from_world(row, column) + 0.0);  // no -0
  return line + '\n';
}

}  // namespace fivepipe::exports
