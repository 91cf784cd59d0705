// Cases that every backend of collision detection passes, through CollisionDetector.

#include "common/collision/detection/cpu/cpu_detector.h"
#include "common/collision/detection/gl/gl_detector.h"
#include "common/collision/detection/paper/paper_detector.h"
#include "tests/support/allocated_bytes.h"
#include "tests/support/collision_triangles.h"

namespace fivepipe::test {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

enum class Backend { cpu, gl, paper };

std::string name_of(const testing::TestParamInfo<Backend>& backend) {
  return backend.param == Backend::cpu ? "Cpu" : backend.param == Backend::gl ? "Gl" : "Paper";
}

std::unique_ptr<collision::CollisionDetector> detector_of(
    Backend backend, const collision::DetectionOptions& options) {
  switch (backend) {
    case Backend::cpu: return collision::cpu_detector(options);
    case Backend::gl: return collision::gl_detector(options);
    case Backend::paper: break;
  }
  return collision::paper_detector(400, 10);
}

class CertifiedBackend : public GlTest, public testing::WithParamInterface<Backend> {};
INSTANTIATE_TEST_SUITE_P(Backends, CertifiedBackend, testing::Values(Backend::cpu, Backend::gl),
                         name_of);

// A detection of the same objects reuses the memory of the one before: the caller gets the
// detector's own results. Counts the calling thread only, which is the thread that would copy.
TEST_P(CertifiedBackend, ARepeatedDetectionCopiesNoPoints) {
  const CollisionHull hull(hand_like());
  const collision::Bvh tree(geometry::sphere_mesh(0.05, 3));
  const collision::DetectionObject object{&tree};
  const auto detector = detector_of(GetParam(), {.spacing_m = 1e-3, .max_points = 1u << 20});
  detector->set_hull(hull.query, hull.silhouettes);
  const collision::CollisionPoint* points[2] = {};
  std::size_t count = 0, allocated = 0;
  for (int call = 0; call < 4; ++call) {
    const std::size_t before = allocated_bytes();
    const auto collisions = detector->detect({&object, 1});
    allocated = allocated_bytes() - before;
    count = collisions[0].points.size();
    points[call % 2] = collisions[0].points.data();
  }
  EXPECT_GT(count, 5000u);
  EXPECT_EQ(points[0], points[1]);
  EXPECT_LT(allocated, count * sizeof(collision::CollisionPoint));
}

}  // namespace
}  // namespace fivepipe::test
