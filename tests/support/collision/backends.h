// A test fixture that runs each backend of collision detection through CollisionDetector.
#pragma once
#include <map>
#include <ostream>
#include <string>
#include <tuple>

#include "common/collision/detection/cpu/cpu_detector.h"
#include "common/collision/detection/gl/gl_detector.h"
#include "common/collision/detection/paper/paper_detector.h"
#include "tests/support/collision/triangles.h"

namespace fivepipe::test {

enum class Backend { cpu, gl, paper };

inline const char* name_of(Backend backend) {
  return backend == Backend::cpu ? "Cpu" : backend == Backend::gl ? "Gl" : "Paper";
}
inline std::string backend_name(const testing::TestParamInfo<Backend>& backend) {
  return name_of(backend.param);
}
// Prints the parameter of a failed test.
inline void PrintTo(Backend backend, std::ostream* out) { *out << name_of(backend); }

class BackendTest : public GlTest, public testing::WithParamInterface<Backend> {
 protected:
  static void TearDownTestSuite() {
    detectors_.clear();
    GlTest::TearDownTestSuite();
  }

  // One result per object. A detector is made once per backend and options, because it compiles its
  // shaders. Backend paper ignores the options.
  std::vector<collision::ObjectCollision> detect(
      const CollisionHull& hull, std::span<const collision::DetectionObject> objects,
      const collision::DetectionOptions& options = kVerdictOnly) {
    auto& detector = detectors_[{GetParam(), options.eps_m, options.spacing_m, options.max_points}];
    if (!detector) detector = make_detector(options);
    detector->set_hull(hull.query, hull.silhouettes);
    const auto collisions = detector->detect(objects);
    EXPECT_EQ(glGetError(), GLenum(GL_NO_ERROR));
    if (GetParam() != Backend::paper) {
      EXPECT_EQ(detector->counts().points_unconfirmed, 0u);
    }
    return {collisions.begin(), collisions.end()};
  }
  collision::ObjectCollision detect(
      const CollisionHull& hull, const collision::Bvh& tree,
      const collision::DetectionOptions& options = kVerdictOnly,
      const Eigen::Isometry3d& world_from_object = Eigen::Isometry3d::Identity(),
      const Eigen::Vector3d& rp_object_world_m = kOrigin) {
    const collision::DetectionObject object{&tree, world_from_object, rp_object_world_m};
    return detect(hull, {&object, 1}, options)[0];
  }
  collision::CollisionVerdict verdict(const CollisionHull& hull,
                                      const collision::Triangle& triangle,
                                      const collision::DetectionOptions& options = kVerdictOnly) {
    return detect(hull, collision::Bvh(mesh_of({triangle})), options).verdict;
  }

  static std::unique_ptr<collision::CollisionDetector> make_detector(
      const collision::DetectionOptions& options) {
    switch (GetParam()) {
      case Backend::cpu: return collision::cpu_detector(options);
      case Backend::gl: return collision::gl_detector(options);
      case Backend::paper: break;
    }
    return collision::paper_detector(400, 10);
  }

 private:
  using Key = std::tuple<Backend, double, double, std::size_t>;
  static inline std::map<Key, std::unique_ptr<collision::CollisionDetector>> detectors_;
};

}  // namespace fivepipe::test
