// OpenCV's lens model with five coefficients: where a lens images a direction. Normalised
// coordinates are tangents of angles to the optical axis: x right, y down.
#pragma once
#include "common/geometry/camera.h"

namespace fivepipe::geometry {

struct LensDistortion {
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
  bool none() const { return k1 == 0 && k2 == 0 && p1 == 0 && p2 == 0 && k3 == 0; }
};

// Maps normalised undistorted to normalised distorted coordinates.
Eigen::Vector2d distorted(const LensDistortion& lens, const Eigen::Vector2d& xy);

// Returns the normalised undistorted coordinates of a pixel of the captured image, by fixed-point
// iteration on the lens model. It need not converge for pixels beyond monotonic_radius().
Eigen::Vector2d undistorted(const Pinhole& captured, const LensDistortion& lens,
                            const Eigen::Vector2d& uv_px);

// Returns the normalised radius up to which the distorted radius increases with the undistorted
// one. Beyond it the radial model folds back, and its pixels do not show what the lens sees.
// Infinite if the model never folds.
double monotonic_radius(const LensDistortion& lens);

// Returns the captured pinhole, enlarged to an image that contains all that the captured image
// shows within monotonic_radius(). Its pixels have the angles of those at the centre of the
// captured image. Without distortion it is the captured pinhole.
Pinhole whole_pinhole(const Pinhole& captured, const LensDistortion& lens);

}  // namespace fivepipe::geometry
