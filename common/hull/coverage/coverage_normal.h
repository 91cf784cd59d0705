// Normals of the hull of coverage maps.
#pragma once
#include <optional>

#include "common/hull/coverage/sparse_coverage.h"

namespace fivepipe::hull {

// Standard deviation of the Gaussian weights with which a plane is fitted to the coverage, and half
// the size of the window [px]. On large spheres and capsules the normals have an error of 0.2 to
// 0.4 degrees. With 0.7 px it is 1 degree because of the sampling grid; with 1.5 px it is 0.1
// degrees, but on objects 3 px thin it grows from 4 to 10 degrees, because the window includes
// their other side.
inline constexpr double kNormalSigma_px = 1.0;
inline constexpr int kNormalWindow_px = 3;
// A plane whose slope is at most this has no direction, because the slope is within the rounding of
// 8 bits [1/255 per px].
inline constexpr double kMinFall = 1.0;

// Returns the unit vector in the image that points out of the silhouette at a border point: the
// downhill direction of the plane fitted to the coverage around it. Returns nullopt if that slope
// is at most kMinFall or uv is outside the image.
std::optional<Eigen::Vector2d> outward_in_image(const SparseCoverageMap& map,
                                                const Eigen::Vector2d& uv_px);

// Returns the outward unit normal of the hull's surface at a point p at which this silhouette
// limits the hull: the normal P^T l of the plane through the camera's centre and the border's
// tangent l (outward_in_image()). Returns nullopt if p is not in front of the camera or
// outward_in_image() returns nullopt.
std::optional<Eigen::Vector3d> outward_normal_world(const CoverageSilhouette& silhouette,
                                                    const Eigen::Vector3d& p_world_m);

}  // namespace fivepipe::hull
