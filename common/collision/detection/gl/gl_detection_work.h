// The state of GlDetection (gl_detection.h) and its steps. Included by its sources only.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/collision/detection/contact_points.h"
#include "common/collision/detection/gl/gl_contact_passes.h"
#include "common/collision/detection/gl/gl_contact_points.h"
#include "common/collision/detection/gl/gl_detection.h"

namespace fivepipe::collision {

// The decision on a contact. Its points are consecutive, and each is in the hull.
struct ResolvedContact {
  CollisionVerdict verdict = CollisionVerdict::free;
  bool coarser = false, walk = false;  // walk: the CPU must walk the triangle
  std::size_t first_point = 0, points = 0;
};

// The results of one task of the CPU walk.
struct WalkedTriangles {
  ContactPoints points;
  std::size_t over_budget = 0;
};

struct GlDetection::Work {
  explicit Work(const GlDetectionRoom& parts) : room(parts), parts_room(parts.first) {}

  // gl_detection.cpp: the stages of detect().
  void clear(std::size_t count);
  void detect_on_cpu(std::span<const DetectionObject> objects, const std::vector<char>& fits,
                     const DetectionOptions& options);
  void open_contacts(std::span<const DetectionObject> objects);
  bool resolve_exact(std::span<const DetectionObject> objects, const DetectionOptions& options);
  void gather(std::span<const DetectionObject> objects, const DetectionOptions& options);

  // gl_contact_resolution.cpp: from contacts to verdicts and points.
  void refine();
  std::span<const gl_contact::Part> found_of(std::size_t contact) const;
  std::vector<std::size_t> count_points() const;
  bool too_many_points(std::size_t object, std::size_t points, double radius_m);
  void add_candidates(std::span<const DetectionObject> objects);
  void confirm(std::span<const DetectionObject> objects);
  bool walk(std::span<const DetectionObject> objects, const DetectionOptions& options,
            std::span<const std::size_t> points_found);

  GlContactPasses passes;
  CpuDetection cpu;
  const hull::HullQuery* query = nullptr;
  bool maps_fit = false;
  GlDetectionRoom room;
  std::size_t parts_room;

  struct Sampling {  // by object
    double spacing_m;
    std::size_t point_limit;  // with more, the object is sampled again at twice the spacing
  };
  std::vector<Sampling> samplings;
  std::vector<GlContact> contacts;            // by object, triangle
  std::vector<std::uint32_t> refined_number;  // index on the GPU, by contact
  std::optional<GlContactPasses::Refined> refined;
  std::vector<std::size_t> first_found;   // by triangle on the GPU, with an end
  std::vector<ResolvedContact> resolved;  // by contact
  std::vector<Eigen::Vector3d> points_world_m;
  std::vector<std::uint8_t> confirmed;
  std::vector<WalkedTriangles> walked;
  std::vector<ObjectCollision> collisions;
  GlDetectionCounts counts;
};

}  // namespace fivepipe::collision
