// The exact silhouettes of the actors of the synthetic world, without images and segmentation.
#pragma once
#include <algorithm>
#include <vector>

#include "capture_node/synthetic/world.h"
#include "common/config/rig.h"

namespace fivepipe::test {

inline Eigen::AlignedBox3d box_of(const capture::SyntheticPart& part) {
  Eigen::AlignedBox3d box_m;
  if (const auto* capsule = std::get_if<hull::Capsule>(&part.shape)) {
    for (const Eigen::Vector3d& end : {capsule->a_world_m, capsule->b_world_m}) {
      box_m.extend(end - Eigen::Vector3d::Constant(capsule->radius_m));
      box_m.extend(end + Eigen::Vector3d::Constant(capsule->radius_m));
    }
  } else {
    const auto& box = std::get<geometry::OrientedBox>(part.shape);
    const Eigen::Vector3d half_m = box.world_from_box.linear().cwiseAbs() * box.half_m,
                          center_m = box.world_from_box.translation();
    box_m = {Eigen::Vector3d(center_m - half_m), Eigen::Vector3d(center_m + half_m)};
  }
  return box_m;
}

// Bounds of the pixels that can see the part.
inline Eigen::AlignedBox2d bounds_px(const capture::SyntheticPart& part,
                                     const geometry::Camera& camera) {
  const Eigen::AlignedBox3d box_m = box_of(part);
  Eigen::AlignedBox2d bounds;
  for (int corner = 0; corner < 8; ++corner) {
    const auto at = static_cast<Eigen::AlignedBox3d::CornerType>(corner);
    bounds.extend(geometry::project(camera, box_m.corner(at)).value());
  }
  return bounds;
}

// Sets the pixels whose centers are in the silhouette.
inline std::vector<hull::Silhouette> silhouettes_of(
    const std::vector<capture::SyntheticPart>& parts,
    const std::vector<geometry::Camera>& cameras) {
  std::vector<hull::Silhouette> silhouettes;
  for (const geometry::Camera& camera : cameras) {
    hull::ObjectPixels pixels(camera.pinhole.width_px, camera.pinhole.height_px);
    for (const capture::SyntheticPart& part : parts) {
      const Eigen::AlignedBox2d bounds = bounds_px(part, camera);
      const int u1 = std::min(pixels.width_px() - 1, int(bounds.max().x()) + 1),
                v1 = std::min(pixels.height_px() - 1, int(bounds.max().y()) + 1);
      for (int v = std::max(0, int(bounds.min().y())); v <= v1; ++v)
        for (int u = std::max(0, int(bounds.min().x())); u <= u1; ++u) {
          if (pixels.contains(u, v)) continue;
          const geometry::Ray ray = geometry::ray_through(camera, {double(u), double(v)});
          if (std::visit([&](const auto& shape) { return ray_entry(shape, ray).has_value(); },
                         part.shape))
            pixels.set(u, v);
        }
    }
    silhouettes.push_back({camera, pixels});
  }
  return silhouettes;
}

// The cameras of the rig that give shape.
inline std::vector<geometry::Camera> cameras_of(const config::Rig& rig) {
  std::vector<geometry::Camera> cameras;
  for (const std::size_t i : config::shape_cameras(rig))
    cameras.push_back(config::published_camera(rig.cameras[i]));
  return cameras;
}

}  // namespace fivepipe::test
