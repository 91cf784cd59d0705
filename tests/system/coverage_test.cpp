// Sub-pixel silhouettes from the messages to the results: drives a real recon_node and a real
// sim_node by crafted messages.
#include <gtest/gtest.h>

#include <algorithm>

#include "common/base/worker_pool.h"
#include "common/config/views.h"
#include "common/hull/coverage/coverage_hull.h"
#include "common/pipeline/messages/view_messages.h"
#include "tests/support/scripted/capture.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

constexpr double kNear_m = 0.05, kFar_m = 3;
const std::string kCoverage = "hull: {coverage: true}\n";

struct Depths {
  std::uint64_t frame;
  Eigen::Isometry3d eye_from_world;
  hull::PixelRect covered;
  std::vector<float> depth_m;
};
Depths copied(const bus::Sample<bus::topics::HullTile>& sample) {
  const auto depth = messages::span_of(sample->depth_m);
  return {sample->frame,
          messages::from_wire(sample->eye_from_world).value(),
          messages::from_wire(sample->covered),
          {depth.begin(), depth.end()}};
}

struct Response {
  std::uint64_t frame;
  fivepipe_v1_ResponseStatus status;
  Vector3d cp_object_m, v_rec, cp_hull_m;
  double d_rec_m;
  std::vector<Vector3d> normals;
};
Response copied_response(const bus::Sample<bus::topics::CollisionResult>& sample) {
  Response response{sample->frame,
                    sample->response,
                    messages::from_wire(sample->cp_object_m),
                    messages::from_wire(sample->v_rec),
                    messages::from_wire(sample->cp_hull_m),
                    sample->d_rec_m,
                    {}};
  for (const auto& normal : messages::span_of(sample->normals))
    response.normals.push_back(messages::from_wire(normal.n_hull));
  return response;
}

class NodeWithCoverage : public ScriptedCapture {
 protected:
  bus::Writer<bus::topics::ObjectCoverage> coverages_ = bus_.writer<bus::topics::ObjectCoverage>();

  std::vector<hull::CoverageSilhouette> covered(std::uint64_t frame) const {
    std::vector<hull::CoverageSilhouette> all;
    for (const hull::Silhouette& s : silhouettes_of(frame))
      all.push_back({s.camera, hull::true_coverage(ball_of(frame), s.camera)});
    return all;
  }
  void send_coverage(std::uint64_t frame) {
    const auto silhouettes = silhouettes_of(frame);
    const auto with_coverage = covered(frame);
    for (std::size_t i = 0; i < silhouettes.size(); ++i)
      deliver(coverages_, messages::coverage_message(
                              deployment_.rig.cameras[i].name, frame, stamp_of(frame),
                              with_coverage[i].map.dense().outline(silhouettes[i].pixels))
                              .message());
  }
};

TEST_F(NodeWithCoverage, ReconNodeReconstructsIt) {
  auto views = bus_.writer<bus::topics::ViewInfo>();
  auto poses = bus_.writer<bus::topics::HeadPose>();
  auto colours = bus_.writer<bus::topics::ObjectColour>();
  Collected<bus::topics::HullTile, Depths> tiles{bus_, copied};
  const std::string path = three_cameras(
      "name: far\nobjects:\n  - {name: box, box: {size_m: [1, 1, 1]}, position_m: [9, 9, 9]}\n",
      "  - {name: recon_a, program: recon_node, backend: cpu, tile_columns: 1, tile_rows: 1}\n",
      kCoverage);
  start("recon_node", "recon_a", path);
  wait_for_readers(infos_, views, poses, colours, coverages_, maps_);
  deliver(views, messages::view_info_message(deployment_.viewer));
  for (const bool has_coverage : {true, false}) {
    const std::uint64_t frame = has_coverage ? 1 : 2;
    fivepipe_v1_HeadPose pose{};
    messages::set_text(pose.viewer, deployment_.viewer.name);
    pose.frame = frame;
    pose.capture_stamp_ns = stamp_of(frame);
    pose.eye_from_world = messages::to_wire(geometry::look_at({0.1, -0.8, 0.05}, {0, 0, 0}));
    deliver(poses, pose);
    if (has_coverage) send_coverage(frame);
    send_maps(frame);
    ASSERT_TRUE(holds([&] { return tiles.take().size() == frame; })) << said();
    const Depths& tile = tiles.all().back();
    ASSERT_EQ(tile.frame, frame);
    const hull::View view{
        {config::recon_pinhole(deployment_.viewer), tile.eye_from_world}, kNear_m, kFar_m};
    base::WorkerPool pool(1);
    const hull::HullRule& rule = deployment_.hull_rule;
    const auto expected =
        has_coverage
            ? hull::CoverageHull(pool, covered(frame), rule).depth(view, tile.covered).depth_m
            : hull::CpuHull(pool, silhouettes_of(frame), rule).depth(view, tile.covered).depth_m;
    EXPECT_GT(expected.size(), 20u);
    EXPECT_EQ(tile.depth_m, expected) << has_coverage;
  }
  EXPECT_EQ(drops_of(ended(), "missing_coverage"), 3u) << "of the second frame";
}

// The box meets the ball from above. CP_hull is on the border of the coverage, D_rec that of the
// object pixels.
TEST_F(NodeWithCoverage, SimNodeRespondsAtIt) {
  Collected<bus::topics::CollisionResult, Response> results{bus_, copied_response};
  const std::string path = three_cameras(
      "name: boxes\nobjects:\n  - {name: above, box: {size_m: [0.1, 0.1, 0.1]}, position_m: [0, "
      "0.02, 0.12], report: {response: {v_rec: [0, 0, 1], height_m: 0.3, closed_form_normal: "
      "true}}}\n",
      "  - {name: simulation, program: sim_node}\n", kCoverage);
  start("sim_node", "simulation", path);
  wait_for_readers(infos_, coverages_, maps_);
  std::vector<Response> of_frames;
  for (const std::uint64_t frame : {3, 3 + 44}) {  // nearly the same ball
    if (frame == 3) send_coverage(frame);
    send_maps(frame);
    ASSERT_TRUE(holds([&] {
      const auto& all = results.take();
      return !all.empty() && all.back().frame == frame;
    })) << said();
    of_frames.push_back(results.all().back());
    ASSERT_EQ(of_frames.back().status, fivepipe_v1_recovered);
  }
  const auto distance_m = [](const Response& response) {
    return (response.cp_hull_m - response.cp_object_m).norm();
  };
  const Response &with = of_frames[0], &without = of_frames[1];
  EXPECT_NEAR(distance_m(without), without.d_rec_m, 1e-9);
  EXPECT_GT(std::abs(distance_m(with) - with.d_rec_m), 1e-4) << "a pixel is 25 mm";
  for (const double beyond_m : {-1e-6, 1e-6})
    EXPECT_EQ(hull::in_hull(covered(3), with.cp_hull_m + beyond_m * with.v_rec), beyond_m < 0);
  ASSERT_EQ(with.normals.size(), 1u);
  EXPECT_EQ(drops_of(ended(), "missing_coverage"), 3u) << "of the second frame";
}

}  // namespace
}  // namespace fivepipe::test
