// Runs the whole pipeline with real processes and compares each published message and the images
// with an independent composition of the same frames.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

#include "capture_node/segmentation/bit_morphology.h"
#include "capture_node/sources/synthetic_source.h"
#include "common/collision/oracle/triangle_reference.h"
#include "common/recording/schema/cdr.h"
#include "tests/support/capture/capture_rig.h"
#include "tests/support/recording/recordings.h"
#include "tests/support/sanitizer.h"
#include "tests/system/composition.h"

namespace fivepipe::test {
namespace {

using namespace std::chrono_literals;
using Eigen::Vector3d;
using nlohmann::ordered_json;

constexpr double kFrameRate_hz = 20;
// Of a frame of the video, on average. H.264 at CRF 23 quantises with steps of about 9 levels.
constexpr double kMaxCodecError_levels = 4.5;
// In a quarter of its turn, the hand is nowhere twice.
constexpr std::uint64_t kNearFrames = 5;

// The hand of the synthetic world moves once around in one second, so that two frames never look
// the same. The camera `head` is on the viewer.
const std::string kRig = R"(
name: content
volume_m: {min: [-0.75, -0.6, 0.0], max: [0.75, 0.6, 0.9]}
cameras:
  - {name: left, image_size_px: [180, 122], horizontal_fov_deg: 58,
     look_at: {eye_m: [-1.9, -1.0, 1.5], target_m: [-0.05, -0.02, 0.27]}}
  - {name: far, image_size_px: [180, 122], horizontal_fov_deg: 58,
     look_at: {eye_m: [-0.25, 2.0, 1.45], target_m: [0.0, 0.0, 0.38]}}
  - {name: right, image_size_px: [180, 122], horizontal_fov_deg: 58,
     look_at: {eye_m: [2.0, -0.7, 1.55], target_m: [0.05, 0.0, 0.28]}}
  - {name: head, image_size_px: [120, 90], horizontal_fov_deg: 70, mount: viewer,
     look_at: {eye_m: [0.03, 0, 0], target_m: [0.03, 0, 1]}}
)";
// `tower` is before the hand's path, `block` is touched by it, `wall` and `table` are scenery. The
// ball falls slowly across the path.
const std::string kScene = R"(
name: content
gravity_m_s2: 0.4
light_m: [0.5, -0.35, 1.9]
background_rgb: [0.3, 0.2, 0.4]
objects:
  - {name: table, box: {size_m: [1.5, 1.2, 0.04]}, position_m: [0, 0, -0.02], reaction: none,
     colour_rgb: [0.5, 0.36, 0.24]}
  - {name: wall, box: {size_m: [0.9, 0.02, 0.5]}, position_m: [0.2, 0.7, 0.25], reaction: none,
     colour_rgb: [0.62, 0.66, 0.7]}
  - {name: tower, box: {size_m: [0.07, 0.08, 0.36]}, position_m: [-0.235, -0.2, 0.18],
     colour_rgb: [0.3, 0.55, 0.8]}
  - {name: block, box: {size_m: [0.2, 0.16, 0.3]}, position_m: [-0.02, 0.3, 0.15],
     rotation_deg: [0, 0, 20], colour_rgb: [0.45, 0.72, 0.45]}
  - {name: ball, sphere: {radius_m: 0.06, subdivisions: 3}, position_m: [0.15, 0.0, 0.5],
     motion: dynamic, colour_rgb: [0.95, 0.95, 0.9]}
)";
const std::string kDeployment = R"(
name: content
rig: rig.yaml
scene: scene.yaml
frame_rate_hz: 20
settings: {still: "4", video: "false"}
viewer:
  path:
    - {t_s: 0, eye_m: [0.0, -0.75, 0.55], target_m: [0.0, 0.05, 0.2]}
    - {t_s: 1, eye_m: [0.1, -0.72, 0.5], target_m: [0.0, 0.05, 0.2]}
  horizontal_fov_deg: 65
  render_size_px: [96, 72]
  recon_size_px: [96, 72]
nodes:
  - {name: capture, program: capture_node, sources: synthetic, synthetic: {seed: 1, period_s: 1.0}}
  - {name: recon_a, program: recon_node, worker: 0, workers: 2, tile_columns: 4, tile_rows: 3}
  - {name: recon_b, program: recon_node, worker: 1, workers: 2, tile_columns: 4, tile_rows: 3}
  - {name: simulation, program: sim_node}
  - {name: rendering, program: render_node, video: "${video}", still_frame: "${still}"}
)";

struct State {
  std::int64_t source_stamp_ns;
  double time_s;  // of the simulation
};

struct Message {
  std::string node;  // that wrote it
  std::int64_t source_stamp_ns;
  ordered_json json;
};
// The messages of one frame, by topic without the prefix.
using FrameMessages = std::map<std::string, std::vector<Message>>;

hull::PixelRect rect_of(const ordered_json& rect) {
  return {rect["u0_px"], rect["v0_px"], rect["u1_px"], rect["v1_px"]};
}
Vector3d vector_of(const ordered_json& v) {
  return {v["x"].get<double>(), v["y"].get<double>(), v["z"].get<double>()};
}
Eigen::Isometry3d pose_of(const ordered_json& pose) {
  const ordered_json& q = pose["rotation"];
  Eigen::Isometry3d isometry = Eigen::Isometry3d::Identity();
  isometry.linear() = Eigen::Quaterniond(q["w"].get<double>(), q["x"].get<double>(),
                                         q["y"].get<double>(), q["z"].get<double>())
                          .matrix();
  isometry.translation() = vector_of(pose["translation_m"]);
  return isometry;
}

// Decodes a set of pixels by the definition of MapEncoding in fivepipe.idl.
hull::ObjectPixels pixels_of(const ordered_json& message, const ordered_json& payload) {
  hull::ObjectPixels pixels(message["image_width_px"].get<int>(),
                            message["image_height_px"].get<int>());
  const hull::PixelRect region = rect_of(message["region"]);
  std::size_t at = 0;
  for (int v = region.v0_px; v < region.v1_px; ++v) {
    if (message["encoding"] == "packed_bits") {
      for (int u = region.u0_px; u < region.u1_px; ++u) {
        const int i = u - region.u0_px;
        if (payload.at(at + std::size_t(i / 8)).get<int>() >> (i % 8) & 1) pixels.set(u, v);
      }
      at += std::size_t((region.width_px() + 7) / 8);
      continue;
    }
    const auto next = [&] {
      const int value = payload.at(at).get<int>() + 256 * payload.at(at + 1).get<int>();
      at += 2;
      return value;
    };
    int u = region.u0_px;
    for (int skipped = next(), set = next(); skipped != 0 || set != 0;
         skipped = next(), set = next()) {
      u += skipped;
      for (int i = 0; i < set; ++i, ++u) pixels.set(u, v);
    }
  }
  EXPECT_EQ(at, payload.size());
  return pixels;
}

class CompositeContent : public RecordingTest {
 protected:
  std::string file_;
  config::Deployment deployment_;
  config::SyntheticWorld world_;
  std::map<std::string, std::unique_ptr<capture::SyntheticImageSource>> sources_;  // by camera
  std::map<std::uint64_t, FrameMessages> frames_;  // the complete ones
  std::set<std::uint64_t> composable_;             // with all tiles, which render_node waits for
  std::vector<State> states_;                      // all of the recording
  std::int64_t first_capture_stamp_ns_ = INT64_MAX;
  std::string lacks_;  // why the frames do not suffice
  std::map<std::uint64_t, ComposedFrame> composed_;
  int highlighted_pixels_ = 0;  // of all compared images

  CompositeContent() {
    for (const auto& [name, text] :
         {std::pair{"rig.yaml", kRig}, {"scene.yaml", kScene}, {"deployment.yaml", kDeployment}})
      std::ofstream(folder_ / name) << text;
    file_ = folder_ / "deployment.yaml";
    deployment_ = config::load_deployment(file_);
    world_ = std::get<config::CaptureConfig>(deployment_.nodes[0].config).synthetic;
    const auto eye_at = [this](double t_s) {
      return config::eye_from_world_at(deployment_.viewer, t_s);
    };
    for (const config::RigCamera& camera : deployment_.rig.cameras)
      sources_[camera.name] = std::make_unique<capture::SyntheticImageSource>(
          world_, camera, kFrameRate_hz, eye_at, test_room());
  }

  const config::RigCamera& camera(const std::string& name) const {
    return *std::find_if(deployment_.rig.cameras.begin(), deployment_.rig.cameras.end(),
                         [&](const config::RigCamera& one) { return one.name == name; });
  }

  // Collects the frames of the recording of which every message was recorded. Skips those for which
  // sim_node has published a second state, because no frame set had arrived for 100 ms.
  void take_frames(const recording::Recording& recording) {
    frames_.clear();
    states_.clear();
    first_capture_stamp_ns_ = INT64_MAX;
    composable_.clear();
    std::map<std::uint64_t, FrameMessages> all;
    auto cursor = recording.messages();
    while (const auto message = cursor.next()) {
      if (message->key_change) continue;
      ordered_json json =
          schema::decode(recording.idl(*message->channel), message->channel->type, message->cdr);
      if (message->channel->topic == bus::topics::VirtualState::name) {
        states_.push_back({message->source_stamp_ns, json["simulation_time_s"]});
        first_capture_stamp_ns_ =
            std::min<std::int64_t>(first_capture_stamp_ns_, json["capture_stamp_ns"]);
      }
      const std::string topic = message->channel->topic.substr(std::string("fivepipe/v1/").size());
      if (!json.contains("capture_stamp_ns") || topic == "FrameTrace") continue;
      all[json["frame"].get<std::uint64_t>()][topic].push_back(
          {message->channel->node, message->source_stamp_ns, std::move(json)});
    }
    const std::map<std::string, std::size_t> complete{
        {"HeadPose", 1},        {"ObjectColour", 4}, {"ObjectPixelMap", 3}, {"VirtualState", 1},
        {"CollisionResult", 3}, {"HullTile", 12},    {"FrameComposited", 1}};
    for (auto& [frame, messages] : all) {
      if (messages["HullTile"].size() == 12) composable_.insert(frame);
      const bool is_complete =
          std::all_of(complete.begin(), complete.end(), [&found = messages](const auto& expected) {
            return found[expected.first].size() == expected.second;
          });
      if (is_complete) frames_[frame] = std::move(messages);
    }
  }
  // Whether the frames suffice for the comparisons: an object begins or ceases to collide, and
  // sim_node has not skipped time, which it does on a busy machine.
  bool has_enough(const recording::Recording& recording, std::size_t min_frames) {
    std::set<std::set<std::string>> colliding;
    for (auto& [frame, messages] : frames_) {
      std::set<std::string> names;
      for (const Message& message : messages["CollisionResult"])
        if (message.json["verdict"] == "colliding") names.insert(message.json["object"]);
      colliding.insert(names);
    }
    const auto statuses = final_statuses(recording);
    const auto& counts = statuses.at("simulation")["counts"];
    const bool skipped = std::any_of(counts.begin(), counts.end(), [](const auto& count) {
      return count["name"] == "milliseconds_skipped" && count["count"] > 0;
    });
    lacks_ = frames_.size() < min_frames ? "too few complete frames"
             : skipped                   ? "sim_node skipped time"
             : colliding.size() < 2      ? "no object begins or ceases to collide"
                                         : "";
    return lacks_.empty();
  }

  // Each of these compares the messages of one frame, and adds to composed_[frame] what the next
  // one needs.
  void compare_capture(std::uint64_t frame);
  void compare_simulation(std::uint64_t frame);
  void compare_reconstruction(std::uint64_t frame, const Composition& composition);
  void compare_image(const cv::Mat& image, const Composition& composition);
  // The image of a frame, by a real render_node that a lossless replay of the recording feeds.
  cv::Mat replayed_image(const std::filesystem::path& recording, std::uint64_t frame);
  // The still and the video of `fivepipe export --composites`.
  void compare_export(const std::filesystem::path& recording,
                      const std::map<std::uint64_t, Composition>& compositions);
};

// The maps show the synthetic object, the colours are those of the cameras' images, and the pose is
// that of the path, all at the time of the frame.
void CompositeContent::compare_capture(std::uint64_t frame) {
  FrameMessages& messages = frames_[frame];
  ComposedFrame& composed = composed_[frame];
  const double t_s = double(frame) / kFrameRate_hz;
  const ordered_json& pose = messages["HeadPose"][0].json;
  composed.eye_from_world = config::eye_from_world_at(deployment_.viewer, t_s);
  EXPECT_TRUE(pose_of(pose["eye_from_world"]).isApprox(composed.eye_from_world, 1e-12));
  std::map<std::string, std::int64_t> stamp_ns;
  for (const config::RigCamera& in_rig : deployment_.rig.cameras)
    for (const Message& message : messages["ObjectPixelMap"]) {
      if (message.json["camera"] != in_rig.name) continue;
      stamp_ns[in_rig.name] = message.json["capture_stamp_ns"];
      composed.silhouettes.push_back(
          {config::published_camera(in_rig), pixels_of(message.json, message.json["payload"])});
      const hull::ObjectPixels& found = composed.silhouettes.back().pixels;
      EXPECT_EQ(found.bounds(), rect_of(message.json["region"]));
      EXPECT_EQ(found.count(), message.json["object_pixels"].get<std::size_t>());
      // As for the segmentation: noise does not reach 6 sigmas, opening changes the border by at
      // most 2 px, and single pixels may have the colour of the room.
      const hull::ObjectPixels truth =
          hull::true_object_pixels(synthetic_object(world_, t_s), config::published_camera(in_rig),
                                   hull::PixelRule::touched);
      EXPECT_EQ(count_not_in(found, capture::dilated(truth, 2)), 0u) << in_rig.name;
      const hull::ObjectPixels inner = capture::eroded(truth, 2);
      EXPECT_LE(count_not_in(inner, found), 3 + inner.count() / 500) << in_rig.name;
      EXPECT_GT(inner.count(), 20u);
    }
  ASSERT_EQ(composed.silhouettes.size(), 3u);
  for (const Message& message : messages["ObjectColour"]) {
    const ordered_json& json = message.json;
    const config::RigCamera& in_rig = camera(json["camera"]);
    ColourImage image{config::published_camera(in_rig, composed.eye_from_world),
                      {},
                      pixels_of(json, json["pixels"])};
    EXPECT_TRUE(pose_of(json["camera_from_world"]).isApprox(image.camera.camera_from_world, 1e-12));
    ASSERT_EQ(sources_.at(in_rig.name)->read(std::int64_t(frame), image.bgr),
              capture::ReadStatus::image);
    for (std::size_t i = 0; i < composed.silhouettes.size(); ++i)
      if (deployment_.rig.cameras[i].name == in_rig.name) {
        image.object = &composed.silhouettes[i].pixels;
        EXPECT_EQ(image.sent, *image.object) << "a camera that gives shape sends its object";
        EXPECT_EQ(json["capture_stamp_ns"], stamp_ns.at(in_rig.name));
      }
    std::size_t at = 0, wrong = 0;
    for (int v = 0; v < image.bgr.rows; ++v)
      for (int u = 0; u < image.bgr.cols; ++u)
        if (image.sent.contains(u, v))
          for (int c = 0; c < 3; ++c)
            wrong += json["bgr"].at(at++) != image.bgr.at<cv::Vec3b>(v, u)[c];
    EXPECT_EQ(at, json["bgr"].size());
    EXPECT_EQ(wrong, 0u) << in_rig.name;
    composed.images.push_back(std::move(image));
  }
}

// The ball falls until it rests on the table, and the verdicts are those of the exact reference at
// the ball's pose.
void CompositeContent::compare_simulation(std::uint64_t frame) {
  FrameMessages& messages = frames_[frame];
  ComposedFrame& composed = composed_[frame];
  const ordered_json& state = messages["VirtualState"][0].json;
  const double t_s = state["simulation_time_s"];
  constexpr double kStep_s = 1.0 / 240;
  // The simulation's time begins with its first frame set. If no frame arrives for 100 ms, sim_node
  // advances by its clock, perhaps beyond this frame.
  double before_s = 0;
  for (const State& other : states_)
    if (other.source_stamp_ns < messages["VirtualState"][0].source_stamp_ns)
      before_s = std::max(before_s, other.time_s);
  const double capture_s =
      1e-9 * double(state["capture_stamp_ns"].get<std::int64_t>() - first_capture_stamp_ns_);
  EXPECT_NEAR(t_s, std::max(capture_s, before_s), kStep_s);
  ASSERT_EQ(state["objects"].size(), 1u);
  EXPECT_EQ(state["objects"][0]["object"], "ball");
  const Eigen::Isometry3d ball = pose_of(state["objects"][0]["world_from_object"]);
  const double z_m = std::max(0.06, 0.5 - 0.4 * t_s * (t_s + kStep_s) / 2);
  // The physics engine lets touching bodies rest up to 2 mm apart.
  EXPECT_LT((ball.translation() - Vector3d(0.15, 0, z_m)).norm(), z_m > 0.06 ? 1e-3 : 2e-3)
      << ball.translation().transpose();
  composed.world_from_object["ball"] = ball;
  const collision::HullDistance hull(composed.silhouettes);
  for (const Message& message : messages["CollisionResult"]) {
    const std::string name = message.json["object"];
    SCOPED_TRACE(name);
    EXPECT_LT(message.source_stamp_ns, messages["VirtualState"][0].source_stamp_ns);
    EXPECT_EQ(message.json["capture_stamp_ns"], state["capture_stamp_ns"]);
    const config::SceneObject& object =
        *std::find_if(deployment_.scene.objects.begin(), deployment_.scene.objects.end(),
                      [&](const config::SceneObject& one) { return one.name == name; });
    const Eigen::Isometry3d world_from_object = name == "ball" ? ball : object.world_from_object;
    const geometry::Mesh mesh = config::mesh_of(object);
    bool crosses = false;
    double deepest_m = 0;
    for (const auto& corners : mesh.triangles) {
      collision::Triangle triangle;
      for (std::size_t i = 0; i < 3; ++i)
        triangle[i] = world_from_object * mesh.vertices_m[corners[i]];
      // A triangle that is farther from the hull than its corners are from its center is free.
      const Vector3d center = (triangle[0] + triangle[1] + triangle[2]) / 3;
      double radius_m = 0;
      for (const Vector3d& corner : triangle)
        radius_m = std::max(radius_m, (corner - center).norm());
      if (hull.signed_m(center) < -radius_m) continue;
      const collision::TriangleTruth truth = collision::triangle_truth(hull, triangle);
      crosses |= truth.crosses;
      deepest_m = std::max(deepest_m, truth.deepest_m);
    }
    const std::string verdict = message.json["verdict"];
    if (!crosses) {
      EXPECT_NE(verdict, "colliding");
    }
    if (deepest_m > std::get<config::SimConfig>(deployment_.nodes[3].config).eps_m) {
      EXPECT_EQ(verdict, "colliding") << deepest_m;
    }
    if (verdict == "colliding") composed.colliding.insert(name);
    EXPECT_EQ(message.json["points_m"].empty(), verdict != "colliding");
    for (const ordered_json& point : message.json["points_m"])
      EXPECT_GE(hull.signed_m(vector_of(point)), 0);
  }
}

// The nodes to which the pose assigns the tiles have sent them, with the exact depths and with the
// colours of the cameras' images.
void CompositeContent::compare_reconstruction(std::uint64_t frame, const Composition& composition) {
  FrameMessages& messages = frames_[frame];
  const ordered_json& owners = messages["HeadPose"][0].json["tile_owners"];
  ASSERT_EQ(owners.size(), 12u);
  std::set<int> tiles;
  int hits = 0, wrong = 0, wrong_colours = 0;
  for (const Message& message : messages["HullTile"]) {
    const ordered_json& json = message.json;
    const int tile = json["tile"];
    EXPECT_TRUE(tiles.insert(tile).second);
    EXPECT_EQ(message.node, owners[std::size_t(tile)] == 0 ? "recon_a" : "recon_b");
    EXPECT_EQ(json["capture_stamp_ns"], messages["VirtualState"][0].json["capture_stamp_ns"]);
    EXPECT_TRUE(pose_of(json["eye_from_world"]).isApprox(composed_[frame].eye_from_world, 1e-12));
    const hull::PixelRect rect = rect_of(json["rect"]), covered = rect_of(json["covered"]);
    EXPECT_EQ(rect, (hull::PixelRect{tile % 4 * 24, tile / 4 * 24, tile % 4 * 24 + 24,
                                     tile / 4 * 24 + 24}));
    for (int v = rect.v0_px; v < rect.v1_px; ++v)
      for (int u = rect.u0_px; u < rect.u1_px; ++u) {
        const bool is_covered =
            u >= covered.u0_px && v >= covered.v0_px && u < covered.u1_px && v < covered.v1_px;
        const std::size_t i =
            is_covered ? std::size_t((v - covered.v0_px) * covered.width_px() + u - covered.u0_px)
                       : 0;
        const double depth_m = is_covered ? json["depth_m"].at(i).get<double>() : 0,
                     expected_m = composition.hull_depth_m(u, v);
        wrong += !(std::abs(depth_m - expected_m) <= kHullDepthError * expected_m);
        if (expected_m == 0) continue;
        ++hits;
        Vector3d bgr;
        for (std::size_t c = 0; c < 3; ++c) bgr[Eigen::Index(c)] = json["bgr"].at(3 * i + c);
        const ExpectedColour expected = composition.hull_bgr(u, v);
        if (!expected.matches(bgr) && ++wrong_colours < 4)
          ADD_FAILURE() << "at " << u << ' ' << v << ": " << bgr.transpose() << " instead of "
                        << expected.bgr[1].transpose();
      }
  }
  EXPECT_EQ(wrong, 0) << "depths";
  EXPECT_GT(hits, 300);
  EXPECT_EQ(wrong_colours, 0) << "of " << hits;
  EXPECT_EQ(messages["TileCosts"].size(), std::set<int>(owners.begin(), owners.end()).size());
  for (const Message& costs : messages["TileCosts"]) {
    std::set<int> of_worker;
    for (std::size_t tile = 0; tile < owners.size(); ++tile)
      if (owners[tile] == costs.json["worker"]) of_worker.insert(int(tile));
    EXPECT_EQ(costs.json["tiles"].get<std::set<int>>(), of_worker);
    EXPECT_EQ(costs.json["cost_ms"].size(), of_worker.size());
  }
}

void CompositeContent::compare_image(const cv::Mat& image, const Composition& composition) {
  ASSERT_EQ(image.size(), cv::Size(96, 72));
  std::map<Composition::Shown, int> seen, wrong;
  int undecided = 0;
  for (int v = 0; v < image.rows; ++v)
    for (int u = 0; u < image.cols; ++u) {
      const auto expected = composition.composite(u, v);
      if (!expected) {
        ++undecided;
        continue;
      }
      const cv::Vec3b& bgr = image.at<cv::Vec3b>(v, u);
      ++seen[expected->shown];
      if (!expected->colour.matches({double(bgr[0]), double(bgr[1]), double(bgr[2])}) &&
          ++wrong[expected->shown] < 4)
        ADD_FAILURE() << "at " << u << ' ' << v << ": " << bgr << " instead of "
                      << expected->colour.bgr[0].transpose() << ", surface "
                      << int(expected->shown);
    }
  for (const auto& [shown, count] : wrong)
    EXPECT_EQ(count, 0) << "surface " << int(shown) << " of " << seen[shown];
  EXPECT_GT(seen[Composition::Shown::hull], 100);
  EXPECT_GT(seen[Composition::Shown::object], 1000);
  EXPECT_GT(seen[Composition::Shown::background], 100);
  EXPECT_LT(undecided, image.rows * image.cols / 20);
  highlighted_pixels_ += seen[Composition::Shown::highlighted_object];
}

cv::Mat CompositeContent::replayed_image(const std::filesystem::path& recording,
                                         std::uint64_t frame) {
  const std::filesystem::path still = folder_ / "out" / "composite.png";
  std::filesystem::remove(still);
  const auto rendering =
      node("render_node", "rendering", file_, {"--set", "still=" + std::to_string(frame)});
  const auto replay =
      fivepipe("replay", {"replay", recording, "--lossless", "--inputs-of", "rendering",
                          "--in-flight", "1", "--rate", "max", "--wait", "60"});
  EXPECT_EQ(replay->wait_for_end(kStart), 0) << replay->said();
  // The still is written at its frame, or by a node that ends without it.
  EXPECT_TRUE(eventually(bus_, 10s, [&] { return std::filesystem::exists(still); }))
      << rendering->said();
  rendering->signal(SIGTERM);
  EXPECT_EQ(rendering->wait_for_end(10s), 0) << rendering->said();
  return cv::imread(still);
}

double luma_of(const Vector3d& bgr) {  // ITU-R BT.601
  return bgr.dot(Vector3d(0.114, 0.587, 0.299));
}
// The luma of each pixel, row by row; NaN where the colour is not known.
std::vector<double> luma_of(const Composition& composition, cv::Size size_px) {
  std::vector<double> luma;
  for (int v = 0; v < size_px.height; ++v)
    for (int u = 0; u < size_px.width; ++u) {
      const auto expected = composition.composite(u, v);
      luma.push_back(expected ? luma_of(expected->colour.bgr[0]) : std::nan(""));
    }
  return luma;
}
// The mean of the absolute differences [levels of 255].
double luma_difference(const cv::Mat& image, const std::vector<double>& expected) {
  double sum = 0;
  int count = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    if (std::isnan(expected[i])) continue;
    const cv::Vec3b& bgr = image.at<cv::Vec3b>(int(i) / image.cols, int(i) % image.cols);
    sum += std::abs(luma_of(Vector3d(bgr[0], bgr[1], bgr[2])) - expected[i]);
    ++count;
  }
  return sum / count;
}

// The still is exact. The codec of the video loses less than the hand changes from frame to frame,
// so each of its images is that of its frame.
void CompositeContent::compare_export(const std::filesystem::path& recording,
                                      const std::map<std::uint64_t, Composition>& compositions) {
  const std::uint64_t still = compositions.rbegin()->first;
  const std::filesystem::path out = folder_ / "export";
  Program exporter({FIVEPIPE_BINARY_DIR "/fivepipe", "export", recording, "--composites", "--out",
                    out, "--set", "video=true", "--set", "still=" + std::to_string(still)},
                   folder_ / "export.log");
  ASSERT_EQ(exporter.wait_for_end(kStart), 0) << exporter.said();
  EXPECT_NE(exporter.said().find("\n" + std::to_string(composable_.size()) +
                                 " composited frames in composite.mp4."),
            std::string::npos)
      << exporter.said();
  compare_image(cv::imread(out / "composites" / "composite.png"), compositions.at(still));
  // The video repeats an image for a frame that is missing.
  cv::VideoCapture video(out / "composites" / "composite.mp4");
  std::map<std::uint64_t, cv::Mat> images;
  std::uint64_t number = *composable_.begin();
  for (cv::Mat image; video.read(image); ++number) images[number] = image.clone();
  EXPECT_EQ(number, *composable_.rbegin() + 1);
  double largest = 0;
  for (const auto& [frame, composition] : compositions) {
    ASSERT_TRUE(images.contains(frame)) << frame;
    ASSERT_EQ(images.at(frame).size(), cv::Size(96, 72));
    const std::vector<double> expected = luma_of(composition, {96, 72});
    const double own = luma_difference(images.at(frame), expected);
    EXPECT_LE(own, kMaxCodecError_levels) << "frame " << frame;
    largest = std::max(largest, own);
    for (const auto& [other, image] : images)
      if (composable_.contains(other) && other != frame && other + kNearFrames >= frame &&
          other <= frame + kNearFrames) {
        EXPECT_LT(own, luma_difference(image, expected)) << frame << " looks like " << other;
      }
  }
  std::cout << "video: mean difference of luma at most " << largest << " levels\n";
}

TEST_F(CompositeContent, EveryMessageAndImageMatchesAnIndependentComposition) {
  const bool is_long = std::getenv("FIVEPIPE_LONG") != nullptr;
  const std::size_t min_frames = is_long ? 30 : 6;
  // A busy machine skips frames, and sim_node simulates by the clock.
  std::filesystem::path file;
  bool enough = false;
  for (double duration_s = is_long ? 2.0 : 0.7; !enough && duration_s < 10 * kSlowdown;
       duration_s *= 2) {
    std::filesystem::remove(file);
    file = recorded(duration_s, file_);
    const recording::Recording recording(file);
    take_frames(recording);
    enough = has_enough(recording, min_frames);
  }
  // The comparisons find more than this if nothing ever collides.
  if (!enough) ADD_FAILURE() << lacks_;
  ASSERT_GE(frames_.size(), min_frames);
  std::set<std::set<std::string>> colliding;
  std::map<std::uint64_t, Composition> compositions;
  for (const auto& [frame, messages] : frames_) {
    SCOPED_TRACE("frame " + std::to_string(frame));
    compare_capture(frame);
    compare_simulation(frame);
    compositions.emplace(frame, Composition(deployment_, composed_[frame]));
    compare_reconstruction(frame, compositions.at(frame));
    colliding.insert(composed_[frame].colliding);
    if (HasFatalFailure()) return;
  }
  // The first frame of each set of colliding objects, or all frames.
  std::vector<std::uint64_t> stills;
  for (const auto& [frame, composed] : composed_)
    if (is_long || colliding.erase(composed.colliding)) stills.push_back(frame);
  for (const std::uint64_t frame : stills) {
    SCOPED_TRACE("image of frame " + std::to_string(frame));
    compare_image(replayed_image(file, frame), compositions.at(frame));
  }
  compare_export(file, compositions);
  EXPECT_GT(highlighted_pixels_, 50) << "no compared image shows a colliding object";
}

}  // namespace
}  // namespace fivepipe::test
