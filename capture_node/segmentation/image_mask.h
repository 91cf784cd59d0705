// The part of a captured image in which object pixels are searched.
#pragma once
#include "common/config/rig.h"
#include "common/hull/object_pixels.h"

namespace fivepipe::capture {

// Returns the captured pixels through which the camera sees a part of the world box, and those at
// most kVolumeMargin_px beside them. The camera is fixed in the world (asserted).
hull::ObjectPixels pixels_of_volume(const config::RigCamera& camera,
                                    const Eigen::AlignedBox3d& volume_m);
// A pixel is larger than its centre, and undistortion takes the nearest one.
inline constexpr int kVolumeMargin_px = 2;

}  // namespace fivepipe::capture
