// The views of the hull: those of one eye, of two, and of a light.
#include "common/config/views.h"

#include "tests/support/deployment_files.h"

namespace fivepipe::config {
namespace {

using Eigen::Vector3d;
using ::testing::ElementsAre;

class Views : public test::DeploymentFile {
 protected:
  // A deployment with these keys of its viewer, each with its indentation and line break.
  static std::string with_viewer(const std::string& keys) {
    return "name: small\nrig: rig.yaml\nscene: scene.yaml\nviewer:\n  path: [{eye_m: [0, -1, 0.5], "
           "target_m: [0, 0, 0.2]}]\n" +
           keys + "nodes:\n  - {name: s, program: sim_node}\n";
  }
  static std::vector<std::string> names(const std::vector<HullView>& views) {
    std::vector<std::string> names;
    for (const HullView& view : views) names.push_back(view.name);
    return names;
  }
};

const std::string kStereo = "  stereo: {eye_distance_m: 0.06}\n";

TEST_F(Views, OfAViewerWithOneEyeIsThatOfTheHead) {
  const Deployment deployment = load(with_viewer(""));
  const std::vector<HullView> views = hull_views(deployment);
  ASSERT_THAT(names(views), ElementsAre("viewer"));
  EXPECT_EQ(views[0].recon, recon_pinhole(deployment.viewer));
  EXPECT_EQ(views[0].near_m, 0.05);
  EXPECT_EQ(views[0].far_m, 5);
  const Eigen::Isometry3d head = geometry::look_at({0.3, -1, 0.5}, {0, 0.2, 0});
  // All bits: a recording of one eye stays the same.
  EXPECT_EQ(eye_from_world(views[0], head).matrix(), head.matrix());
  EXPECT_EQ(composite_width_px(deployment.viewer), 640);
}

TEST_F(Views, OfAStereoViewerAreToBothSidesOfTheHead) {
  const Deployment deployment = load(with_viewer("  name: anna\n" + kStereo));
  const std::vector<HullView> views = hull_views(deployment);
  ASSERT_THAT(names(views), ElementsAre("anna/left", "anna/right"));
  EXPECT_EQ(composite_width_px(deployment.viewer), 1280);
  // The head looks along y from above: its x axis is the world's.
  const Eigen::Isometry3d head = geometry::look_at({0.1, -1, 0.5}, {0.1, 0, 0});
  for (const auto& [i, x_m] : {std::pair{0, 0.07}, {1, 0.13}}) {
    const geometry::Camera eye{views[std::size_t(i)].recon,
                               eye_from_world(views[std::size_t(i)], head)};
    EXPECT_TRUE(geometry::camera_center_world_m(eye).isApprox(Vector3d(x_m, -1, 0.5), 1e-12));
    EXPECT_EQ(eye.camera_from_world.linear(), head.linear()) << "the axes are parallel";
    EXPECT_EQ(eye.pinhole, recon_pinhole(deployment.viewer));
  }
}

TEST_F(Views, OfALightComesFirstAndDoesNotMove) {
  write("scene.yaml",
        test::kGoodScene + "light_m: [0, 0, 3]\nshadows: {target_m: [0, 0, 0], fov_deg: 60}\n");
  for (const std::string& stereo : {std::string(), kStereo}) {
    const Deployment deployment = load(with_viewer(stereo));
    const std::vector<HullView> views = hull_views(deployment);
    ASSERT_EQ(views.size(), stereo.empty() ? 2u : 3u);
    EXPECT_EQ(views[0].name, kLightView);
    EXPECT_EQ(eye_from_world(views[0], geometry::look_at({1, 1, 1}, {0, 0, 0})).matrix(),
              light_view(deployment.scene)->fixed->matrix());
    for (std::size_t i = 1; i < views.size(); ++i) EXPECT_FALSE(views[i].fixed);
  }
}

// A recording or another node may have another number of eyes.
TEST_F(Views, OfAViewerAreKnownByTheirNames) {
  for (const std::string& stereo : {std::string(), kStereo}) {
    const Viewer viewer = load(with_viewer(stereo)).viewer;
    for (const char* name : {"viewer", "viewer/left", "viewer/right"})
      EXPECT_TRUE(is_view_of(viewer, name)) << name;
    for (const char* name : {"viewer2", "view", "viewer/", "viewer/top", "light/0", ""})
      EXPECT_FALSE(is_view_of(viewer, name)) << name;
  }
}

TEST_F(Views, OfAStereoViewerHaveNamesThatFitIntoAMessage) {
  const std::string longest(26, 'a');
  EXPECT_EQ(hull_views(load(with_viewer("  name: " + longest + '\n' + kStereo)))[1].name.size(),
            32u);
  EXPECT_THAT(problems(with_viewer("  name: " + longest + "b\n" + kStereo)),
              ElementsAre("deployment.yaml:6:9: name of a stereo viewer must have at most 26 "
                          "characters, has 27"));
  EXPECT_TRUE(problems(with_viewer("  name: " + longest + "b\n")).empty());
}

TEST_F(Views, RejectsInvalidStereo) {
  EXPECT_THAT(problems(with_viewer("  stereo: {eye_distance_m: 0}\n")),
              ElementsAre("deployment.yaml:6:28: eye_distance_m must be greater than 0 and at most "
                          "1, is 0"));
  EXPECT_THAT(problems(with_viewer("  stereo: {eye_distance_m: .nan}\n")),
              ElementsAre("deployment.yaml:6:28: eye_distance_m must be finite, is .nan"));
  EXPECT_THAT(problems(with_viewer("  stereo: {}\n")),
              ElementsAre("deployment.yaml:6:11: eye_distance_m is missing in stereo"));
  EXPECT_THAT(problems(with_viewer("  stereo: {eye_distance: 0.06}\n")).size(), 1);
  EXPECT_THAT(problems(with_viewer("  stereo: true\n")).size(), 1);
  EXPECT_THAT(problems(with_viewer("  render_size_px: [8194, 100]\n" + kStereo)),
              ElementsAre("deployment.yaml:6:19: render_size_px[0] of a stereo viewer must be at "
                          "most 8192, is 8194"));
}

}  // namespace
}  // namespace fivepipe::config
