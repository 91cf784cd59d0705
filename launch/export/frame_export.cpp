#include "launch/export/frame_export.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/geometry/closed_mesh.h"
#include "common/hull/colour/hull_colour.h"
#include "common/surface/hull_mesh.h"

namespace fivepipe::exports {
namespace {

using Eigen::Vector3d;

// A vertex is on the border of a silhouette. This far inside, its pixel is an object pixel [m].
constexpr double kInside_m = 1e-3;
// A vertex is coloured as an eye straight above it sees it, at this distance [m].
constexpr double kEye_m = 1;
// Depth of a camera of the rig begins here [m].
constexpr double kCameraNear_m = 0.01;

std::vector<surface::Rgb> colours_of(const geometry::Mesh& mesh, const replay::RecordedFrame& frame,
                                     const hull::HullRule& rule) {
  const hull::HullColour colour(frame.set.silhouettes, frame.colours, rule);
  const std::vector<Vector3d> normals = surface::vertex_normals(mesh);
  std::vector<surface::Rgb> colours;
  for (std::size_t i = 0; i < normals.size(); ++i) {
    const Vector3d& p = mesh.vertices_m[i];
    const auto [b, g, r] = colour.at(p - kInside_m * normals[i], p + kEye_m * normals[i]);
    colours.push_back({r, g, b});
  }
  return colours;
}

double area_m2(const geometry::Mesh& mesh) {
  double twice_m2 = 0;
  for (const auto& [a, b, c] : mesh.triangles)
    twice_m2 += (mesh.vertices_m[b] - mesh.vertices_m[a])
                    .cross(mesh.vertices_m[c] - mesh.vertices_m[a])
                    .norm();
  return twice_m2 / 2;
}

double farthest_m(const Eigen::AlignedBox3d& box, const Vector3d& from_m) {
  double distance_m = 0;
  for (int corner = 0; corner < 8; ++corner)
    distance_m =
        std::max(distance_m, (box.corner(Eigen::AlignedBox3d::CornerType(corner)) - from_m).norm());
  return distance_m;
}

// The view of the request; nullopt if the head pose that it needs was not recorded.
std::optional<hull::View> view_of(const ExportRequest& request,
                                  const config::Deployment& deployment,
                                  const replay::RecordedFrame& frame) {
  if (request.camera.empty()) {
    if (!frame.eye_from_world) return std::nullopt;
    const config::Viewer& viewer = deployment.viewer;
    return hull::View{
        {config::render_pinhole(viewer), *frame.eye_from_world}, viewer.near_m, viewer.far_m};
  }
  const auto rig_camera =
      std::ranges::find(deployment.rig.cameras, request.camera, &config::RigCamera::name);
  if (rig_camera->mount != config::Mount::world && !frame.eye_from_world) return std::nullopt;
  const geometry::Camera camera = config::published_camera(
      *rig_camera, frame.eye_from_world.value_or(Eigen::Isometry3d::Identity()));
  const double far_m =
      farthest_m(deployment.hull_rule.within_world_m, geometry::camera_center_world_m(camera));
  return hull::View{camera, kCameraNear_m, std::max(far_m, 2 * kCameraNear_m)};
}

}  // namespace

std::string name_of_frame(std::size_t index, std::uint64_t frame) {
  return fmt::format("{:06}_frame_{:06}", index, frame);
}

FrameExporter::FrameExporter(const ExportRequest& request, const config::Deployment& deployment,
                             surface::SweptVolume* swept)
    : request_(request), deployment_(deployment), swept_(swept) {}

FrameFigures FrameExporter::exported(const replay::RecordedFrame& frame, std::size_t index) {
  hull_.assign(frame.set.silhouettes, deployment_.hull_rule);
  const hull::HullQuery query(hull_);
  const std::string name = name_of_frame(index, frame.set.frame);
  FrameFigures figures;
  if (request_.meshes || request_.points || request_.volumes)
    write_meshes(frame, name, query, figures);
  if (request_.components) figures.components = components_of(query);
  if (request_.depth) write_depth_of(frame, name, figures);
  if (swept_) swept_->add(query);
  return figures;
}

std::vector<collision::HullComponent> FrameExporter::components(
    const replay::RecordedFrame& frame) {
  hull_.assign(frame.set.silhouettes, deployment_.hull_rule);
  return components_of(hull::HullQuery(hull_));
}

std::vector<collision::HullComponent> FrameExporter::components_of(
    const hull::HullQuery& query) const {
  const config::HistoryRequests history =
      deployment_.scene.history.value_or(config::HistoryRequests{});
  return collision::hull_components(query, {.within_world_m = deployment_.hull_rule.within_world_m,
                                            .cell_m = history.cell_m,
                                            .outlines = true});
}

void FrameExporter::write_meshes(const replay::RecordedFrame& frame, const std::string& name,
                                 const hull::HullQuery& query, FrameFigures& figures) {
  surface::MeshFile content{surface::hull_mesh(
      query, {.within_world_m = deployment_.hull_rule.within_world_m, .cell_m = request_.cell_m})};
  figures.vertices = content.mesh.vertices_m.size();
  figures.triangles = content.mesh.triangles.size();
  figures.volume_m3 = geometry::enclosed_volume_m3(content.mesh);
  figures.area_m2 = area_m2(content.mesh);
  figures.has_colour = !frame.colours.empty();
  if (figures.has_colour && request_.colour && (request_.meshes || request_.points))
    content.colours = colours_of(content.mesh, frame, deployment_.hull_rule);
  const auto write = [&](const char* folder, surface::MeshFormat format) {
    surface::write_mesh(request_.folder / folder / (name + surface::extension_of(format)), content,
                        format);
    ++figures.files;
  };
  if (request_.meshes) write("meshes", *request_.meshes);
  content.mesh.triangles.clear();
  if (request_.points) write("points", *request_.points);
}

void FrameExporter::write_depth_of(const replay::RecordedFrame& frame, const std::string& name,
                                   FrameFigures& figures) {
  const auto view = view_of(request_, deployment_, frame);
  if (!view) return;
  const geometry::Pinhole& pinhole = view->camera.pinhole;
  write_depth(request_.folder / "depth" / (name + extension_of(*request_.depth)),
              hull_.depth(*view, {0, 0, pinhole.width_px, pinhole.height_px}), *request_.depth);
  figures.view = view->camera;
  ++figures.files;
}

}  // namespace fivepipe::exports
