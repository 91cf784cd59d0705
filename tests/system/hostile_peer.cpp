// A peer in a deployment's domain: sends every message type of bus/topics.h with invented names,
// wrong sizes, extreme stamps and frame numbers, and NaN. The nodes must drop all of it. It
// publishes no status as a node of the deployment.
#include <charconv>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <functional>
#include <limits>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

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
      : bus_({domain, "loopback", "mallory", deployment}) {
    using namespace bus::topics;
    add<ReplaySession, CameraInfo, ViewInfo, Command, SpacingRequest, ObjectSpacing, HeadPose,
        ObjectColour, ObjectCoverage, ObjectPixelMap, CollisionResult, Particles, VirtualState,
        HullComponents, SimulationMetrics, TileCosts, HullTile, FrameComposited, FrameTrace,
        HostStatus, NodeStatus>();
    for (const bus::topics::Topic& topic : all())
      if (!index_of(std::string_view(topic.name).substr(kPrefix.size())))
        throw std::logic_error(std::string("no hostile message of ") + topic.name);
  }

  // Sends message `number` of a topic.
  void send(std::size_t topic, std::uint64_t number) {
    number_ = number;
    topics_[topic].send();
  }
  std::size_t topics() const { return topics_.size(); }
  std::optional<std::size_t> index_of(std::string_view topic) const {
    for (std::size_t i = 0; i < topics(); ++i)
      if (topic == topics_[i].name) return i;
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

  void make_hostile(fivepipe_v1_ObjectPixelMap& map) {
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
  }
  void make_hostile(fivepipe_v1_ObjectCoverage& coverage) {
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
  }
  void make_hostile(fivepipe_v1_ObjectColour& colour) {
    messages::set_text(colour.camera, name_or("left"));
    colour.image_width_px = 180;
    colour.image_height_px = 122;
    colour.camera_from_world = invalid_pose();
    fill(colour.pixels, bytes_, std::uint8_t(0xff));
    fill(colour.bgr, more_bytes_, std::uint8_t(0xff));
    make_implausible(colour);
  }
  void make_hostile(fivepipe_v1_CameraInfo& info) {
    messages::set_text(info.camera, name_or("left"));
    info.pinhole = {INT32_MAX, -1, kNaN, kNaN, kNaN, kNaN};
    info.camera_from_mount = invalid_pose();
  }
  void make_hostile(fivepipe_v1_HeadPose& pose) {
    messages::set_text(pose.viewer, name_or("viewer"));
    pose.eye_from_world =
        coin() ? invalid_pose() : messages::to_wire(Eigen::Isometry3d::Identity());
    fill(pose.tile_owners, bytes_, std::uint8_t(0xff));
    make_implausible(pose);
  }
  void make_hostile(fivepipe_v1_ViewInfo& view) {
    messages::set_text(view.viewer, name_or("viewer"));
    view.render = view.recon = {INT32_MAX, INT32_MAX, coin() ? 1.0 : kNaN, 1.0, 0.0, 0.0};
    view.near_m = 1;
    view.far_m = 2;
  }
  void make_hostile(fivepipe_v1_HullTile& tile) {
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
  }
  void make_hostile(fivepipe_v1_VirtualState& state) {
    messages::set_text(state.simulation, name_or("simulation"));
    objects_.assign(random_() % 4 + 1, {});
    vertices_m_.resize(objects_.size());
    for (std::size_t i = 0; i < objects_.size(); ++i) {
      messages::set_text(objects_[i].object, invented());
      objects_[i].world_from_object = invalid_pose();
      fill(objects_[i].vertices_m, vertices_m_[i], std::numeric_limits<float>::infinity());
    }
    messages::borrow(state.objects, objects_);
    state.frame = number_;
    if (coin()) make_implausible(state);
  }
  void make_hostile(fivepipe_v1_Particles& particles) {
    messages::set_text(particles.source, name_or("grains"));
    particles.frame = number_;
    fill(particles.p_m, numbers_, std::numeric_limits<float>::quiet_NaN());
    if (coin()) make_implausible(particles);
  }
  void make_hostile(fivepipe_v1_CollisionResult& result) {
    messages::set_text(result.object, name_or("curtain"));
    result.verdict = fivepipe_v1_colliding;
    result.d_rec_m = kNaN;
    fill(result.triangles, indices_, std::numeric_limits<std::uint32_t>::max());
    make_implausible(result);
  }
  void make_hostile(fivepipe_v1_TileCosts& costs) {
    messages::set_text(costs.viewer, name_or("viewer"));
    costs.worker = std::uint16_t(random_());
    fill(costs.cost_ms, numbers_, std::numeric_limits<float>::quiet_NaN());
    make_implausible(costs);
  }
  void make_hostile(fivepipe_v1_FrameComposited& composited) {
    messages::set_text(composited.viewer, name_or("viewer"));
    make_implausible(composited);
    composited.composited_stamp_ns = coin() ? INT64_MIN : INT64_MAX;
  }
  void make_hostile(fivepipe_v1_SimulationMetrics& metrics) {
    messages::set_text(metrics.simulation, name_or("simulation"));
    bodies_.assign(coin() ? 1 : 1000, {UINT32_MAX, kNaN, kNaN, UINT32_MAX, UINT32_MAX, kNaN, -1});
    messages::borrow(metrics.bodies, bodies_);
    if (coin()) make_implausible(metrics);
  }
  void make_hostile(fivepipe_v1_FrameTrace& trace) {
    messages::set_text(trace.node, invented());
    make_implausible(trace);
    trace.first_input_ns = INT64_MIN;
    trace.last_input_ns = INT64_MAX;
  }
  void make_hostile(fivepipe_v1_NodeStatus& status) {
    messages::set_text(status.node, invented());
    status.start_stamp_ns = coin() ? 1 : INT64_MAX;
    status.has_handled_frame = true;
    status.frame_rate_hz = status.cpu_s = status.memory_mb = kNaN;
    drops_.assign(random_() % 20, {});
    diagnostics_.assign(drops_.size(), {});
    for (std::size_t i = 0; i < drops_.size(); ++i) {
      const std::string subject = invented() + "_" + std::to_string(i);
      messages::set_text(drops_[i].subject, subject);
      drops_[i].count = UINT64_MAX;
      messages::set_text(diagnostics_[i].subject, subject);
    }
    messages::borrow(status.drops, drops_);
    messages::borrow(status.diagnostics, diagnostics_);
  }
  void make_hostile(fivepipe_v1_ReplaySession& session) {
    static constexpr double kRates[] = {kNaN, -1, std::numeric_limits<double>::infinity()};
    messages::set_text(session.replay, name_or("replay"));
    session.lossless = coin();
    session.rate = kRates[random_() % std::size(kRates)];
  }
  // No node has the name, or the node supports no command. DDS refuses an unknown kind.
  void make_hostile(fivepipe_v1_Command& command) {
    messages::set_text(command.target, name_or("recon_a"));
    command.kind = coin() ? fivepipe_v1_reset_simulation : fivepipe_v1_pause_simulation;
  }
  void make_hostile(fivepipe_v1_SpacingRequest& request) {
    messages::set_text(request.object, name_or("slider"));
    request.spacing_m = impossible_spacing_m();
  }
  void make_hostile(fivepipe_v1_ObjectSpacing& spacing) {
    messages::set_text(spacing.object, name_or("slider"));
    spacing.spacing_m = impossible_spacing_m();
    spacing.requested = coin();
    make_implausible(spacing);
  }
  void make_hostile(fivepipe_v1_HullComponents& hull) {
    messages::set_text(hull.simulation, name_or("simulation"));
    fivepipe_v1_HullComponent component{};
    component.id = coin() ? 0 : UINT64_MAX;
    component.centroid_m = component.velocity_m_s = {kNaN, kNaN, kNaN};
    component.volume_m3 = -1;
    component.determined_axes = 255;
    fill(hull.components, components_, component);
    // Only one has a long list. A message of 1,000 such lists is 8 MB; DDS would enlarge its buffer
    // by 4 KiB at a time, and the address sanitizer copies it each time: 1.5 s or more per message.
    if (!components_.empty()) fill(components_.front().from, ids_, UINT64_MAX);
    make_implausible(hull);
  }
  // Of a host that the deployment lacks, or by an impossible clock.
  void make_hostile(fivepipe_v1_HostStatus& host) {
    static constexpr std::int64_t kStamps_ns[] = {INT64_MIN, -1, INT64_MAX};
    messages::set_text(host.host, name_or("beta"));
    messages::set_text(host.program, coin() ? "mallory" : "up");
    messages::set_text(host.machine, invented());
    messages::set_text(host.version, invented());
    host.sent_ns = kStamps_ns[random_() % std::size(kStamps_ns)];
    fivepipe_v1_FileChecksum file{};
    messages::set_text(file.name, invented());
    fill(host.files, files_, file);
    fivepipe_v1_ClockAnswer answer{};
    messages::set_text(answer.host, "alpha");
    messages::set_text(answer.program, "up");
    answer.sent_ns = answer.offset_ns = INT64_MIN;
    answer.received_ns = INT64_MAX;
    answer.error_ns = coin() ? INT64_MIN : INT64_MAX;
    fill(host.clocks, clocks_, answer);
  }
  double impossible_spacing_m() {
    static constexpr double kSpacings_m[] = {kNaN, std::numeric_limits<double>::infinity(), -1,
                                             1e300};
    return kSpacings_m[random_() % std::size(kSpacings_m)];
  }

  template <class... Topics>
  void add() {
    (topics_.push_back({std::string_view(Topics::name).substr(kPrefix.size()),
                        [this, writer = bus_.writer<Topics>()]() mutable {
                          typename Topics::Message message{};
                          make_hostile(message);
                          writer.write(message);
                        }}),
     ...);
  }

  static constexpr std::string_view kPrefix = "fivepipe/v1/";
  struct Topic {
    std::string_view name;  // without kPrefix
    std::function<void()> send;
  };
  std::mt19937_64 random_{1};
  std::uint64_t number_ = 0;
  // What the sequences of a message point to until it is written.
  std::vector<std::uint8_t> bytes_, more_bytes_;
  std::vector<float> numbers_;
  std::vector<std::uint32_t> indices_;
  std::vector<std::uint64_t> ids_;
  std::vector<fivepipe_v1_ObjectState> objects_;
  std::vector<std::vector<float>> vertices_m_;
  std::vector<fivepipe_v1_BodyMetrics> bodies_;
  std::vector<fivepipe_v1_DropCount> drops_;
  std::vector<fivepipe_v1_Diagnostic> diagnostics_;
  std::vector<fivepipe_v1_HullComponent> components_;
  std::vector<fivepipe_v1_FileChecksum> files_;
  std::vector<fivepipe_v1_ClockAnswer> clocks_;
  bus::Bus bus_;
  std::vector<Topic> topics_;
};

bool read(const char* text, auto& value) {
  const char* end = text + std::strlen(text);
  const auto [rest, error] = std::from_chars(text, end, value);
  return error == std::errc() && rest == end;
}

int run(HostilePeer& peer, double duration_s, double rate_hz, std::optional<std::size_t> topic) {
  const auto start = Clock::now();
  const auto time_of = [&](double s) {
    return start + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(s));
  };
  std::uint64_t sent = 0;
  for (; double(sent) < duration_s * rate_hz; ++sent) {
    peer.send(topic.value_or(sent % peer.topics()), sent);
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
  const auto usage = [] {
    std::fputs(fivepipe::test::kUsage, stderr);
    return 2;
  };
  if (argc < 4 || argc > 5 || !read(argv[1], domain) || !read(argv[2], duration_s) ||
      !read(argv[3], rate_hz) || !(rate_hz > 0))
    return usage();
  fivepipe::test::HostilePeer peer(domain, deployment);
  if (argc == 5 && !(topic = peer.index_of(argv[4]))) return usage();
  return fivepipe::test::run(peer, duration_s, rate_hz, topic);
}
