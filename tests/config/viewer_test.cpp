// The viewer's pinholes and the path of its eye.
#include <cmath>
#include <limits>
#include <numbers>

#include "common/config/deployment.h"
#include "common/config/view/head_path.h"
#include "tests/support/scene_files.h"

namespace fivepipe::config {
namespace {

using Eigen::Vector3d;
using ::testing::ElementsAre;

Vector3d eye_at(const Viewer& viewer, double t_s) {
  return geometry::camera_center_world_m({recon_pinhole(viewer), eye_from_world_at(viewer, t_s)});
}

TEST(ViewerPinholes, HaveTheSameFieldOfView) {
  Viewer viewer;
  viewer.horizontal_fov_rad = std::numbers::pi / 2;
  EXPECT_NEAR(render_pinhole(viewer).fx_px, 320, 1e-9);
  // Both images have the same corner in normalised coordinates.
  const geometry::Pinhole render = render_pinhole(viewer), recon = recon_pinhole(viewer);
  EXPECT_NEAR((-0.5 - render.cx_px) / render.fx_px, (-0.5 - recon.cx_px) / recon.fx_px, 1e-12);
  EXPECT_NEAR((479.5 - render.cy_px) / render.fy_px, (239.5 - recon.cy_px) / recon.fy_px, 1e-12);
}

TEST(EyePath, OneKeyIsAFixedView) {
  Viewer viewer;
  viewer.path = {{0, {0, -1, 0.5}, {0, 0, 0.5}}};
  for (const double t_s : {-3.0, 0.0, 1.0, 1e6})
    EXPECT_TRUE(
        eye_from_world_at(viewer, t_s).isApprox(geometry::look_at({0, -1, 0.5}, {0, 0, 0.5})));
}

TEST(EyePath, PassesThroughItsKeysAndLooksAtTheirTargets) {
  Viewer viewer;
  viewer.path = {{0, {0, -1, 0.5}, {0, 0, 0}},
                 {0.7, {0.3, -1, 0.6}, {0.1, 0, 0}},
                 {2, {-0.2, -1.1, 0.4}, {0, 0.1, 0.2}},
                 {3, {0, -1, 0.5}, {0, 0, 0}}};
  for (const HeadKey& key : viewer.path) {
    EXPECT_TRUE(eye_at(viewer, key.t_s).isApprox(key.eye_world_m, 1e-12)) << key.t_s;
    EXPECT_TRUE(eye_from_world_at(viewer, key.t_s)
                    .isApprox(geometry::look_at(key.eye_world_m, key.target_world_m), 1e-9))
        << key.t_s;
  }
}

TEST(EyePath, UniformMotionIsPreserved) {
  const Vector3d start(0, -1, 0.5), velocity_m_s(0.1, 0.02, -0.03);
  Viewer viewer;
  for (const double t_s : {0.0, 0.3, 1.0, 1.1, 4.0})
    viewer.path.push_back({t_s, start + t_s * velocity_m_s, {0, 1, 0.5}});
  for (double t_s = 0; t_s < 4; t_s += 0.01)
    EXPECT_TRUE(eye_at(viewer, t_s).isApprox(start + t_s * velocity_m_s, 1e-12)) << t_s;
}

// The Catmull-Rom basis half-way between equidistant keys is (-p0 + 9 p1 + 9 p2 - p3) / 16.
TEST(EyePath, IsACatmullRomSpline) {
  Viewer viewer;
  const Vector3d p[5] = {
      {0, -1, 0.5}, {0.4, -1.2, 0.6}, {0.1, -0.9, 0.7}, {-0.3, -1, 0.2}, {0, -1, 0.5}};
  for (int i = 0; i < 5; ++i) viewer.path.push_back({double(i), p[i], {0, 1, 0.5}});
  EXPECT_TRUE(eye_at(viewer, 1.5).isApprox((-p[0] + 9 * p[1] + 9 * p[2] - p[3]) / 16, 1e-12));
  EXPECT_TRUE(eye_at(viewer, 0.5).isApprox((-p[3] + 9 * p[0] + 9 * p[1] - p[2]) / 16, 1e-12))
      << "on a closed path, p3 precedes p0";
}

TEST(EyePath, RepeatsAfterItsLastKeyWithContinuousVelocity) {
  Viewer viewer;
  viewer.path = {{0, {0, -1, 0.5}, {0, 0, 0}},
                 {1, {0.3, -1, 0.6}, {0, 0, 0}},
                 {2, {-0.3, -1, 0.6}, {0, 0, 0}},
                 {4, {0, -1, 0.5}, {0, 0, 0}}};
  for (double t_s = 0.05; t_s < 4; t_s += 0.1) {
    EXPECT_TRUE(eye_at(viewer, t_s + 8).isApprox(eye_at(viewer, t_s), 1e-9));
    EXPECT_TRUE(eye_at(viewer, t_s - 4).isApprox(eye_at(viewer, t_s), 1e-9));
  }
  const double h_s = 1e-5;
  const Vector3d before_m_s = (eye_at(viewer, 4) - eye_at(viewer, 4 - h_s)) / h_s,
                 after_m_s = (eye_at(viewer, 4 + h_s) - eye_at(viewer, 4)) / h_s;
  EXPECT_LT((before_m_s - after_m_s).norm(), 1e-4)
      << "differs by more than acceleration times h at the seam";
  EXPECT_GT(after_m_s.norm(), 0.05);
}

TEST(EyePath, JumpsToItsStartAfterTheLastKeyIfOpen) {
  Viewer viewer;
  viewer.path = {{0, {0, -1, 0.5}, {0, 0, 0}}, {2, {1, -1, 0.5}, {0, 0, 0}}};
  EXPECT_TRUE(eye_at(viewer, 1.5).isApprox(Vector3d(0.75, -1, 0.5), 1e-12));
  EXPECT_TRUE(eye_at(viewer, 2.5).isApprox(Vector3d(0.25, -1, 0.5), 1e-12));
}

TEST(EyePath, ReportsFaultsByKey) {
  const Vector3d target(0, 0, 0);
  EXPECT_TRUE(head_path_faults({{0, {0, -1, 0}, target}}).empty());
  const auto fault = [](const std::vector<HeadKey>& path) {
    return head_path_faults(path).empty() ? "none" : std::to_string(head_path_faults(path)[0].key);
  };
  EXPECT_EQ(fault({{1, {0, -1, 0}, target}}), "0") << "does not start at 0";
  EXPECT_EQ(fault({{0, {0, -1, 0}, target}, {1, {0, -1, 0}, target}, {1, {0, -1, 0}, target}}), "2")
      << "equal times";
  EXPECT_EQ(fault({{0, {0, -1, 0}, target}, {1, {0, 0, 1}, target}}), "1") << "looks straight down";
  EXPECT_EQ(fault({{0, {0, -1, 0}, target}, {1, target, target}}), "1") << "target at the eye";
  EXPECT_EQ(fault({{0, {-1, 0, 1}, target}, {2, {1, 0, 1}, target}}), "0")
      << "looks straight down half-way";
  EXPECT_EQ(fault({{0, {std::numeric_limits<double>::quiet_NaN(), -1, 0}, target}}), "0");
}

TEST(EyePath, ViewsWithinATenThousandthOfUpHaveNoUpDirection) {
  const auto has_up = [](double sine) {
    return has_up_direction({0, 0, 0}, {sine, 0, -std::sqrt(1 - sine * sine)}, Vector3d::UnitZ());
  };
  EXPECT_TRUE(has_up(1.01e-4));
  EXPECT_FALSE(has_up(0.99e-4));
  EXPECT_FALSE(has_up_direction({1, 2, 3}, {1, 2, 3}, Vector3d::UnitZ()));
}

TEST(EyePath, FaultsSayWhatIsWrong) {
  const auto faults = [](const std::vector<HeadKey>& path) {
    std::vector<std::string> texts;
    for (const HeadPathFault& fault : head_path_faults(path))
      texts.push_back(std::to_string(fault.key) + ": " + fault.what);
    return texts;
  };
  const Vector3d eye(0, -1, 0), target(0, 0, 0);
  const std::string no_up =
      "the target is at the eye, or straight above or below it: the view has no up direction";
  EXPECT_THAT(faults({{0.5, eye, target}, {2, target, target}, {1, eye, target}}),
              ElementsAre("0: t_s of the first key must be 0, is 0.5", "1: " + no_up,
                          "2: t_s must be greater than that of the previous key (2), is 1"));
  const std::string between =
      "between this key and the next, the eye looks straight up or down: the view has no up "
      "direction";
  const Vector3d left(-1, 0, 1), right(1, 0, 1);
  EXPECT_THAT(
      faults({{0, left, target}, {2, right, target}, {4, left, target}, {6, right, target}}),
      ElementsAre("1: " + between));
}

// The eye moves straight over its target, at this fraction of the segment.
TEST(EyePath, IsCheckedAtEach64thOfASegment) {
  for (const double fraction : {1.0 / 64, 2.0 / 64, 31.0 / 64, 63.0 / 64}) {
    const Vector3d start(-64 * fraction, 0, 1);
    EXPECT_EQ(head_path_faults({{0, start, {0, 0, 0}}, {3, start + Vector3d(64, 0, 0), {0, 0, 0}}})
                  .size(),
              1u)
        << fraction;
  }
  // 63 of these views have no up direction.
  EXPECT_EQ(
      head_path_faults({{0, {-1.01e-4, 0, 1}, {0, 0, 0}}, {1, {1.01e-4, 0, 1}, {0, 0, 0}}}).size(),
      1u);
  EXPECT_TRUE(
      head_path_faults({{0, {-1, 1e-3, 1}, {0, 0, 0}}, {1, {1, 1e-3, 1}, {0, 0, 0}}}).empty());
}

// t - period * floor(t / period) rounds to the period.
TEST(EyePath, ATimeJustBeforeAPeriodHasTheLastPose) {
  Viewer viewer;
  viewer.path = {{0, {0, -1, 0.5}, {0, 0, 0}}, {2, {1, -1, 0.5}, {0, 0, 0}}};
  EXPECT_TRUE(eye_at(viewer, -1e-20).isApprox(Vector3d(1, -1, 0.5), 1e-12));
}

// A path of which only the eye, or only the target, returns has one-sided tangents at its ends.
TEST(EyePath, IsOpenIfOnlyTheEyeOrTheTargetReturns) {
  const Vector3d eye[3] = {{0, -1, 0.5}, {0.4, -1.2, 0.6}, {0, -1, 0.5}},
                 target[3] = {{0, 1, 0.5}, {0.1, 1.1, 0.4}, {0.3, 1, 0.5}};
  const auto first_tangent_half = [](const Vector3d* p) {
    return Vector3d((p[0] + p[1]) / 2 + (p[1] - p[0]) / 8 - (p[2] - p[0]) / 16);
  };
  for (const bool swapped : {false, true}) {
    Viewer viewer;
    for (int i = 0; i < 3; ++i)
      viewer.path.push_back(swapped ? HeadKey{double(i), target[i], eye[i]}
                                    : HeadKey{double(i), eye[i], target[i]});
    EXPECT_TRUE(eye_at(viewer, 0.5).isApprox(first_tangent_half(swapped ? target : eye), 1e-12));
  }
}

// An open path has one-sided tangents at its ends.
TEST(EyePath, IsClosedIfItsEndsAreWithinANanometre) {
  for (const double gap_m : {0.9e-9, 1.1e-9}) {
    Viewer viewer;
    const Vector3d p[4] = {{0, -1, 0.5}, {0.4, -1.2, 0.6}, {0.1, -0.9, 0.7}, {gap_m, -1, 0.5}};
    for (int i = 0; i < 4; ++i) viewer.path.push_back({double(i), p[i], {0, 1, 0.5}});
    const Vector3d velocity_0 = gap_m < 1e-9 ? Vector3d((p[1] - p[2]) / 2) : Vector3d(p[1] - p[0]),
                   velocity_1 = (p[2] - p[0]) / 2;
    EXPECT_LT((eye_at(viewer, 0.5) - (p[0] + p[1]) / 2 - (velocity_0 - velocity_1) / 8).norm(),
              1e-8);
  }
}

class HeadFile : public test::SceneFiles {
 protected:
  std::vector<HeadKey> read(const std::string& text) {
    Problems problems;
    const std::vector<HeadKey> path = read_head_path(write("head.csv", text), problems);
    problems.throw_if_any();
    return path;
  }
  std::vector<std::string> problems(const std::string& text) {
    return problems_of([&] { read(text); });
  }
  const std::string header_ = "t_s,eye_x_m,eye_y_m,eye_z_m,target_x_m,target_y_m,target_z_m\n";
};

TEST_F(HeadFile, ReadsKeysAndSkipsBlanks) {
  const std::vector<HeadKey> path =
      read(header_ + "0,0,-1,0.5,0,0,0\r\n 0.5 , 1e-1,-1,0.5, 0,0.25,0\n\n");
  ASSERT_EQ(path.size(), 2u);
  EXPECT_EQ(path[1].t_s, 0.5);
  EXPECT_EQ(path[1].eye_world_m, Vector3d(0.1, -1, 0.5));
  EXPECT_EQ(path[1].target_world_m, Vector3d(0, 0.25, 0));
}

TEST_F(HeadFile, ReportsEveryProblemWithItsLocation) {
  EXPECT_THAT(problems("t_s,eye_x_cm,eye_y_m,eye_z_m,target_x_m,target_y_m,target_z_m\n0,0,-1,0.5,"
                       "0,0,0\n1,0,-1,nan,0,0,0x\n2,0,-1\n"),
              ElementsAre("head.csv:1:5: the first line must be "
                          "t_s,eye_x_m,eye_y_m,eye_z_m,target_x_m,target_y_m,target_z_m",
                          "head.csv:3:8: eye_z_m must be a finite number, is \"nan\"",
                          "head.csv:3:16: target_z_m must be a finite number, is \"0x\"",
                          "head.csv:4:1: the line must have 7 columns, has 3"));
  EXPECT_THAT(
      problems(header_ + "0,0,-1,0.5,0,0,0\n\n0,0,-1,0.5,0,0,0\n"),
      ElementsAre("head.csv:4:1: t_s must be greater than that of the previous key (0), is 0"));
  EXPECT_THAT(problems("t_s,eye_x_m\n"),
              ElementsAre("head.csv:1:12: the first line must be "
                          "t_s,eye_x_m,eye_y_m,eye_z_m,target_x_m,target_y_m,target_z_m"));
  EXPECT_THAT(problems("t_s,eye_x_m,eye_y_m,eye_z_m,target_x_m,target_y_m,target_z_m, x,y\n"),
              ElementsAre("head.csv:1:63: the first line must have 7 columns, has 9"));
  EXPECT_THAT(problems(header_ + "0,0,-1,0.5,0,0,0,8\n"),
              ElementsAre("head.csv:2:1: the line must have 7 columns, has 8"));
  EXPECT_THAT(problems(header_ + "0,0,-1,0.5,0,,\n"),
              ElementsAre("head.csv:2:14: target_y_m must be a finite number, is \"\"",
                          "head.csv:2:15: target_z_m must be a finite number, is \"\""));
  EXPECT_THAT(problems(header_ + "0,0,-1,0.5,  ,0,0\n"),
              ElementsAre("head.csv:2:14: target_x_m must be a finite number, is \"\""));
  EXPECT_THAT(problems(header_),
              ElementsAre("head.csv:1:1: the file contains no key: add a line below the header"));
  EXPECT_THAT(problems(""),
              ElementsAre("head.csv:1:1: the file contains no key: add a line below the header"));
}

}  // namespace
}  // namespace fivepipe::config
