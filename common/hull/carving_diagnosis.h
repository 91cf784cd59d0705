// Carving diagnosis: why is the hull empty or too small? Reports which cameras remove a point or a
// part of space, and which of them do so alone.
//
// It reads the silhouettes directly and shares no data structure with the fast queries, so that it
// can also explain their results.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/base/worker_pool.h"
#include "common/hull/hull.h"

namespace fivepipe::hull {

// A camera's verdict on a point. `empty` removes the point. `behind` and `outside_image` remove it
// with Limits::all and have no effect with Limits::seen. `unusable`: the camera is not finite, so
// there is no hull.
enum class CameraVerdict { object, empty, behind, outside_image, unusable };

struct CameraDiagnosis {
  CameraVerdict verdict;
  bool removes;  // the camera removes the point by the given rule
  // Distance from the point's pixel to the square of the nearest object pixel [px]. 0 on the
  // object; infinity if there is no object pixel, the point is behind the camera or the camera is
  // unusable.
  double to_object_px;
};
struct PointDiagnosis {
  bool in_hull;
  std::vector<CameraDiagnosis> cameras;  // in the order of the silhouettes
  // Indices of the cameras that remove the point while all others keep it: at most one.
  std::vector<int> alone;
  bool too_few;  // no camera removes the point, but fewer see it than the rule requires
};
// Returns each camera's verdict on the point. A point that is not finite is not in the hull, and
// `cameras` is then empty. The rule's box affects only in_hull.
PointDiagnosis diagnose_point(std::span<const Silhouette> silhouettes,
                              const Eigen::Vector3d& p_world_m, const HullRule& rule = {});

// Points drawn uniformly from a box.
struct DiagnosisSampling {
  int points = 200'000;  // > 0
  std::uint64_t seed = 1;
};

// Part of a box's volume, estimated from random points, with its binomial standard error. If no
// point or every point counts, error_m3 is the volume of 3 points: the 95 % bound of the "rule of
// three".
struct SampledVolume {
  double volume_m3 = 0, error_m3 = 0;
};
struct CameraContribution {
  bool no_object_pixel = false, unusable = false;
  SampledVolume removed;               // by this camera, and possibly by others
  SampledVolume removed_alone;         // by this camera, while all others keep it
  SampledVolume removed_alone_unseen;  // the part of removed_alone behind it or outside its image
  SampledVolume kept_by_others;        // the hull without this camera; 0 if it is the only one
};
struct VolumeDiagnosis {
  Eigen::AlignedBox3d box_world_m;
  int points = 0;
  SampledVolume hull;
  SampledVolume too_few;  // no camera removes it, but fewer see it than the rule requires
  std::vector<CameraContribution> cameras;  // in the order of the silhouettes
};
// Estimates the volumes from random points of the box. The result does not depend on the number of
// threads. Points outside the rule's box count for no volume. For a box that is empty or not
// finite, all volumes are 0.
VolumeDiagnosis diagnose_volume(std::span<const Silhouette> silhouettes,
                                const Eigen::AlignedBox3d& box_world_m, base::WorkerPool& pool,
                                const HullRule& rule = {}, const DiagnosisSampling& sampling = {});

// Describes the diagnosis in one paragraph of plain text. `names` has the order of the silhouettes;
// a camera without a name is called "camera <index>".
std::string summary(const VolumeDiagnosis& diagnosis, std::span<const std::string> names = {});

}  // namespace fivepipe::hull
