// Why is the hull empty, or too small? Which cameras remove a point, or a part of space, and which
// of them alone.
//
// Made for people, from the silhouettes themselves: it shares no structure with the fast queries
// that it may have to explain.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/base/worker_pool.h"
#include "common/hull/hull.h"

namespace fivepipe::hull {

// What a camera says of a point. By Limits::seen, behind and outside_image take no part; by
// Limits::all they remove it, as empty does. unusable: the camera is not finite, and leaves no hull
// at all.
enum class CameraVerdict { object, empty, behind, outside_image, unusable };
const char* to_string(CameraVerdict verdict);

struct CameraDiagnosis {
  CameraVerdict verdict;
  bool removes;  // by the rule
  // From the point's pixel to the nearest object pixel's square [px]: 0 on the object, infinity
  // without object pixel, behind, or unusable.
  double to_object_px;
};
struct PointDiagnosis {
  bool in_hull;
  std::vector<CameraDiagnosis> cameras;  // as the silhouettes
  std::vector<int> alone;  // cameras without which the others would keep the point; at most one,
                           // for what two remove neither does alone
  int seen_by = 0;         // cameras that have it in front of them and in their image
  bool too_few;  // no camera removes it, but fewer see it than the rule wants (none: no camera)
};
// A point that is not finite is in no hull, and no camera's fault.
PointDiagnosis diagnose_point(std::span<const Silhouette> silhouettes,
                              const Eigen::Vector3d& p_world_m, const HullRule& rule = {});

// Points drawn evenly from a box of space.
struct DiagnosisSampling {
  int points = 200'000;  // > 0
  std::uint64_t seed = 1;
};

// Of a box: measured by random points, each with its standard error (binomial; where no point or
// every point counts, the volume of 3 points, which the true one stays under, or within, in 95 of
// 100 cases).
struct SampledVolume {
  double volume_m3 = 0, error_m3 = 0;
};
struct CameraContribution {
  bool no_object_pixel = false, unusable = false;
  SampledVolume removed;               // by it, whoever else does
  SampledVolume removed_alone;         // what all others keep
  SampledVolume removed_alone_unseen;  // part of `removed_alone`: behind it or outside its image,
                                       // not for want of an object pixel
  SampledVolume kept_by_others;  // the hull without this camera; nothing where it is the only one
};
struct VolumeDiagnosis {
  Eigen::AlignedBox3d box_world_m;
  int points = 0;
  SampledVolume hull,
      too_few;  // too_few: no camera removes it, but fewer see it than the rule wants
  std::vector<CameraContribution> cameras;  // as the silhouettes
};
// The same for every number of threads. A box that is empty or not finite has no volume, and no
// camera a share.
VolumeDiagnosis diagnose_volume(std::span<const Silhouette> silhouettes,
                                const Eigen::AlignedBox3d& box_world_m, base::WorkerPool& pool,
                                const HullRule& rule = {}, const DiagnosisSampling& sampling = {});

// One paragraph for whoever set up the cameras. Names as the silhouettes; cameras without a name
// are called "camera <index>".
std::string summary(const VolumeDiagnosis& diagnosis, std::span<const std::string> names = {});

}  // namespace fivepipe::hull
