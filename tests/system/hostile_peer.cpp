// A peer in a deployment's domain: sends every message type with invented names, wrong sizes,
// extreme stamps and frame numbers, and NaN. The nodes must drop all of it. It sends no valid
// message and claims no node's name.
#include <array>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <limits>
#include <optional>
#include <random>
#include <thread>

#include "common/pipeline/bus/bus.h"
#include "common/pipeline/messages/wire_conversions.h"
#include "tests/support/not_finite.h"

namespace fivepipe::test {
namespace {

using Clock = std::chrono::steady_clock;

constexpr const char* kUsage =
    R"(Usage: hostile_peer DOMAIN SECONDS RATE_HZ [TOPIC] [--deployment NAME]

Sends SECONDS * RATE_HZ messages, at most RATE_HZ per second: of TOPIC, such as ObjectPixelMap, or
of all topics in turn; as a process of the deployment NAME, or of none.
)";

class HostilePeer {
 public:
  HostilePeer(std::uint32_t domain, const std::string& deployment)
      : bus_({domain, "loopback", "mallory", deployment}) {}

  // Sends message `number` of a topic.
  void send(std::size_t topic, std::uint64_t number) {
    number_ = number;
    (this->*kTopics[topic].send)();
  }
  static std::size_t topics() { return kTopics.size(); }
  static std::optional<std::size_t> index_of(std::string_view topic) {
    for (std::size_t i = 0; i < topics(); ++i)
      if (topic == kTopics[i].name) return i;
    return std::nullopt;
  }

 private:
  bool coin() { return random_() % 2 == 0; }
  std::string invented() { return "invented_" + std::to_string(number_); }
  // An invented name, or one that the deployment has.
  std::string name_or(const char* known) { return coin() ? invented() : known; }

  // At least one of frame number and stamp is invalid.
  template <class Message>
  void make_implausible(Message& message) {
    static constexpr std::int64_t kStamps_ns[] = {INT64_MIN, INT64_MIN + 1, -1, INT64_MAX};
    static constexpr std::uint64_t kFrames[] = {0, 1, messages::kMaxFrame + 1, UINT64_MAX - 1,
                                                UINT64_MAX};
    message.capture_stamp_ns = kStamps_ns[random_() % std::size(kStamps_ns)];
    message.frame = kFrames[random_() % std::size(kFrames)];
  }
  fivepipe_v1_Pose invalid_pose() {
    fivepipe_v1_Pose pose = messages::to_wire(Eigen::Isometry3d::Identity());
    switch (random_() % 4) {
      case 0: pose.translation_m.x = kNaN; break;
      case 1: pose.translation_m.z = -std::numeric_limits<double>::infinity(); break;
      case 2: pose.rotation.w = kNaN; break;
      default: pose.rotation.w = 1e300;
    }
    return pose;
  }
  fivepipe_v1_PixelRect wild_rect() {
    return {int(random_()), int(random_()), int(random_()), int(random_())};
  }
  template <class Sequence, class Element>
  void fill(Sequence& sequence, std::vector<Element>& storage, const Element& value) {
    storage.assign(random_() % 1000, value);
    messages::borrow(sequence, storage);
  }

  void send_map() {
    fivepipe_v1_ObjectPixelMap map{};
    const bool known = coin();
    messages::set_text(map.camera, known ? "left" : invented());
    map.frame = number_;
    map.capture_stamp_ns = 1;
    map.image_width_px = 180;
    map.image_height_px = 122;
    map.region = {0, 0, 180, 122};
    fill(map.payload, bytes_, std::uint8_t(0xff));
    switch (random_() % 4) {
      case 0: map.image_width_px = INT32_MAX; break;
      case 1: map.region = wild_rect(); break;
      case 2: map.encoding = fivepipe_v1_run_lengths; break;
      default: make_implausible(map);
    }
    maps_.write(map);
  }
  void send_coverage() {
    fivepipe_v1_ObjectCoverage coverage{};
    messages::set_text(coverage.camera, name_or("left"));
    coverage.frame = number_;
    coverage.capture_stamp_ns = 1;
    coverage.image_width_px = 180;
    coverage.image_height_px = 122;
    coverage.region = {0, 0, 180, 122};
    fill(coverage.pixels, bytes_, std::uint8_t(0xff));
    fill(coverage.coverage, more_bytes_, std::uint8_t(0x80));
    switch (random_() % 3) {
      case 0: coverage.region = wild_rect(); break;
      case 1: coverage.encoding = fivepipe_v1_run_lengths; break;
      default: make_implausible(coverage);
    }
    coverages_.write(coverage);
  }
  void send_colour() {
    fivepipe_v1_ObjectColour colour{};
    messages::set_text(colour.camera, name_or("left"));
    colour.image_width_px = 180;
    colour.image_height_px = 122;
    colour.camera_from_world = invalid_pose();
    fill(colour.pixels, bytes_, std::uint8_t(0xff));
    fill(colour.bgr, more_bytes_, std::uint8_t(0xff));
    make_implausible(colour);
    colours_.write(colour);
  }
  void send_camera_info() {
    fivepipe_v1_CameraInfo info{};
    messages::set_text(info.camera, name_or("left"));
    info.pinhole = {INT32_MAX, -1, kNaN, kNaN, kNaN, kNaN};
    info.camera_from_mount = invalid_pose();
    infos_.write(info);
  }
  void send_pose() {
    fivepipe_v1_HeadPose pose{};
    messages::set_text(pose.viewer, name_or("viewer"));
    pose.eye_from_world =
        coin() ? invalid_pose() : messages::to_wire(Eigen::Isometry3d::Identity());
    fill(pose.tile_owners, bytes_, std::uint8_t(0xff));
    make_implausible(pose);
    poses_.write(pose);
  }
  void send_view_info() {
    fivepipe_v1_ViewInfo view{};
    messages::set_text(view.viewer, name_or("viewer"));
    view.render = view.recon = {INT32_MAX, INT32_MAX, coin() ? 1.0 : kNaN, 1.0, 0.0, 0.0};
    view.near_m = 1;
    view.far_m = 2;
    views_.write(view);
  }
  void send_tile() {
    fivepipe_v1_HullTile tile{};
    messages::set_text(tile.viewer, name_or("viewer"));
    tile.tile = std::uint16_t(random_());
    tile.tiles = std::uint16_t(random_());
    tile.eye_from_world =
        coin() ? invalid_pose() : messages::to_wire(Eigen::Isometry3d::Identity());
    tile.recon = {INT32_MAX, -1, kNaN, 1, 0, 0};
    tile.rect = wild_rect();
    tile.covered = wild_rect();
    fill(tile.depth_m, numbers_, std::numeric_limits<float>::quiet_NaN());
    if (coin()) make_implausible(tile);
    tiles_.write(tile);
  }
  void send_state() {
    fivepipe_v1_VirtualState state{};
    messages::set_text(state.simulation, name_or("simulation"));
    std::vector<fivepipe_v1_ObjectState> objects(random_() % 4 + 1);
    std::vector<std::vector<float>> vertices_m(objects.size());
    for (std::size_t i = 0; i < objects.size(); ++i) {
      messages::set_text(objects[i].object, invented());
      objects[i].world_from_object = invalid_pose();
      fill(objects[i].vertices_m, vertices_m[i], std::numeric_limits<float>::infinity());
    }
    messages::borrow(state.objects, objects);
    state.frame = number_;
    if (coin()) make_implausible(state);
    states_.write(state);
  }
  void send_particles() {
    fivepipe_v1_Particles particles{};
    messages::set_text(particles.source, name_or("grains"));
    particles.frame = number_;
    fill(particles.p_m, numbers_, std::numeric_limits<float>::quiet_NaN());
    if (coin()) make_implausible(particles);
    particles_.write(particles);
  }
  void send_collision() {
    fivepipe_v1_CollisionResult result{};
    messages::set_text(result.object, name_or("curtain"));
    result.verdict = fivepipe_v1_colliding;
    result.d_rec_m = kNaN;
    fill(result.triangles, indices_, std::numeric_limits<std::uint32_t>::max());
    make_implausible(result);
    collisions_.write(result);
  }
  void send_costs() {
    fivepipe_v1_TileCosts costs{};
    messages::set_text(costs.viewer, name_or("viewer"));
    costs.worker = std::uint16_t(random_());
    fill(costs.cost_ms, numbers_, std::numeric_limits<float>::quiet_NaN());
    make_implausible(costs);
    costs_.write(costs);
  }
  void send_composited() {
    fivepipe_v1_FrameComposited composited{};
    messages::set_text(composited.viewer, name_or("viewer"));
    make_implausible(composited);
    composited.composited_stamp_ns = coin() ? INT64_MIN : INT64_MAX;
    composited_.write(composited);
  }
  void send_metrics() {
    fivepipe_v1_SimulationMetrics metrics{};
    messages::set_text(metrics.simulation, name_or("simulation"));
    fivepipe_v1_BodyMetrics bodies{UINT32_MAX, kNaN, kNaN, UINT32_MAX, UINT32_MAX, kNaN, -1};
    std::vector<fivepipe_v1_BodyMetrics> many(coin() ? 1 : 1000, bodies);
    messages::borrow(metrics.bodies, many);
    if (coin()) make_implausible(metrics);
    metrics_.write(metrics);
  }
  void send_trace() {
    fivepipe_v1_FrameTrace trace{};
    messages::set_text(trace.node, invented());
    make_implausible(trace);
    trace.first_input_ns = INT64_MIN;
    trace.last_input_ns = INT64_MAX;
    traces_.write(trace);
  }
  void send_status() {
    fivepipe_v1_NodeStatus status{};
    messages::set_text(status.node, invented());
    status.start_stamp_ns = coin() ? 1 : INT64_MAX;
    status.has_handled_frame = true;
    status.frame_rate_hz = status.cpu_s = status.memory_mb = kNaN;
    std::vector<fivepipe_v1_DropCount> drops(random_() % 20);
    for (std::size_t i = 0; i < drops.size(); ++i) {
      messages::set_text(drops[i].subject, invented() + "_" + std::to_string(i));
      drops[i].count = UINT64_MAX;
    }
    messages::borrow(status.drops, drops);
    std::vector<fivepipe_v1_Diagnostic> diagnostics(drops.size());
    for (std::size_t i = 0; i < drops.size(); ++i)
      messages::set_text(diagnostics[i].subject, invented() + "_" + std::to_string(i));
    messages::borrow(status.diagnostics, diagnostics);
    statuses_.write(status);
  }

  struct Topic {
    const char* name;
    void (HostilePeer::*send)();
  };
  static const std::array<Topic, 15> kTopics;

  std::mt19937_64 random_{1};
  std::uint64_t number_ = 0;
  std::vector<std::uint8_t> bytes_, more_bytes_;
  std::vector<float> numbers_;
  std::vector<std::uint32_t> indices_;
  bus::Bus bus_;
  bus::Writer<bus::topics::ObjectPixelMap> maps_ = bus_.writer<bus::topics::ObjectPixelMap>();
  bus::Writer<bus::topics::ObjectCoverage> coverages_ = bus_.writer<bus::topics::ObjectCoverage>();
  bus::Writer<bus::topics::ObjectColour> colours_ = bus_.writer<bus::topics::ObjectColour>();
  bus::Writer<bus::topics::CameraInfo> infos_ = bus_.writer<bus::topics::CameraInfo>();
  bus::Writer<bus::topics::HeadPose> poses_ = bus_.writer<bus::topics::HeadPose>();
  bus::Writer<bus::topics::ViewInfo> views_ = bus_.writer<bus::topics::ViewInfo>();
  bus::Writer<bus::topics::HullTile> tiles_ = bus_.writer<bus::topics::HullTile>();
  bus::Writer<bus::topics::VirtualState> states_ = bus_.writer<bus::topics::VirtualState>();
  bus::Writer<bus::topics::Particles> particles_ = bus_.writer<bus::topics::Particles>();
  bus::Writer<bus::topics::CollisionResult> collisions_ =
      bus_.writer<bus::topics::CollisionResult>();
  bus::Writer<bus::topics::TileCosts> costs_ = bus_.writer<bus::topics::TileCosts>();
  bus::Writer<bus::topics::FrameComposited> composited_ =
      bus_.writer<bus::topics::FrameComposited>();
  bus::Writer<bus::topics::SimulationMetrics> metrics_ =
      bus_.writer<bus::topics::SimulationMetrics>();
  bus::Writer<bus::topics::FrameTrace> traces_ = bus_.writer<bus::topics::FrameTrace>();
  bus::Writer<bus::topics::NodeStatus> statuses_ = bus_.writer<bus::topics::NodeStatus>();
};

const std::array<HostilePeer::Topic, 15> HostilePeer::kTopics = {{
    {"ObjectPixelMap", &HostilePeer::send_map},
    {"ObjectCoverage", &HostilePeer::send_coverage},
    {"ObjectColour", &HostilePeer::send_colour},
    {"CameraInfo", &HostilePeer::send_camera_info},
    {"HeadPose", &HostilePeer::send_pose},
    {"ViewInfo", &HostilePeer::send_view_info},
    {"HullTile", &HostilePeer::send_tile},
    {"VirtualState", &HostilePeer::send_state},
    {"Particles", &HostilePeer::send_particles},
    {"CollisionResult", &HostilePeer::send_collision},
    {"TileCosts", &HostilePeer::send_costs},
    {"FrameComposited", &HostilePeer::send_composited},
    {"SimulationMetrics", &HostilePeer::send_metrics},
    {"FrameTrace", &HostilePeer::send_trace},
    {"NodeStatus", &HostilePeer::send_status},
}};

bool read(const char* text, auto& value) {
  const char* end = text + std::strlen(text);
  const auto [rest, error] = std::from_chars(text, end, value);
  return error == std::errc() && rest == end;
}

int run(std::uint32_t domain, double duration_s, double rate_hz, std::optional<std::size_t> topic,
        const std::string& deployment) {
  HostilePeer peer(domain, deployment);
  const auto start = Clock::now();
  const auto time_of = [&](double s) {
    return start + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(s));
  };
  std::uint64_t sent = 0;
  for (; double(sent) < duration_s * rate_hz; ++sent) {
    peer.send(topic.value_or(sent % HostilePeer::topics()), sent);
    std::this_thread::sleep_until(time_of(double(sent + 1) / rate_hz));
  }
  return 0;
}

}  // namespace
}  // namespace fivepipe::test

int main(int argc, char** argv) {
  using fivepipe::test::read;
  std::uint32_t domain = 0;
  double duration_s = 0, rate_hz = 0;
  std::optional<std::size_t> topic;
  std::string deployment;
  if (argc > 2 && std::string_view(argv[argc - 2]) == "--deployment") {
    deployment = argv[argc - 1];
    argc -= 2;
  }
  if (argc == 5) topic = fivepipe::test::HostilePeer::index_of(argv[4]);
  if (argc < 4 || argc > 5 || !read(argv[1], domain) || !read(argv[2], duration_s) ||
      !read(argv[3], rate_hz) || !(rate_hz > 0) || (argc == 5 && !topic)) {
    std::fputs(fivepipe::test::kUsage, stderr);
    return 2;
  }
  return fivepipe::test::run(domain, duration_s, rate_hz, topic, deployment);
}
