// Compares payloads that Cyclone DDS writes and reads with those that follow from the IDL.
#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <thread>

#include "common/pipeline/bus/topics.h"
#include "common/recording/schema/cdr.h"
#include "common/recording/schema/wire_types.h"
#include "tests/support/recording/schema_payloads.h"
#include "tests/support/test_domain.h"

namespace fivepipe::schema {
namespace {

using Json = nlohmann::ordered_json;
using Bytes = std::vector<std::byte>;

struct SerdataUnref {
  void operator()(ddsi_serdata* serdata) const { ddsi_serdata_unref(serdata); }
};
using Serdata = std::unique_ptr<ddsi_serdata, SerdataUnref>;

// A writer and a reader of one topic, in one participant.
template <class Topic>
class Cyclone {
 public:
  using Message = typename Topic::Message;
  using Sample = std::unique_ptr<Message, void (*)(Message*)>;

  Cyclone() {
    participant_ = dds_create_participant(test::own_domain(), nullptr, nullptr);
    const dds_entity_t topic =
        dds_create_topic(participant_, Topic::descriptor, Topic::name, nullptr, nullptr);
    dds_qos_t* qos = dds_create_qos();
    dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_INFINITY);
    dds_qset_history(qos, DDS_HISTORY_KEEP_ALL, 0);
    reader_ = dds_create_reader(participant_, topic, qos, nullptr);
    writer_ = dds_create_writer(participant_, topic, qos, nullptr);
    dds_delete_qos(qos);
    // Cyclone provides the type only with a serialised sample.
    const Message empty{};
    type_of_ = write_and_take(empty);
  }
  ~Cyclone() {
    type_of_.reset();
    dds_delete(participant_);
  }

  // Returns nullopt if Cyclone rejects the payload.
  Sample sample(Bytes payload) const {
    ddsrt_iovec_t whole{payload.data(), payload.size()};
    Serdata serdata(ddsi_serdata_from_ser_iov(type_of_->type, SDK_DATA, 1, &whole, payload.size()));
    Sample result(nullptr, [](Message* message) {
      dds_sample_free(message, Topic::descriptor, DDS_FREE_ALL);
    });
    if (!serdata) return result;
    result.reset(static_cast<Message*>(dds_alloc(sizeof(Message))));
    if (!ddsi_serdata_to_sample(serdata.get(), result.get(), nullptr, nullptr)) result.reset();
    return result;
  }

  Bytes written(const Message& message) {
    const Serdata serdata = write_and_take(message);
    if (!serdata) return {};
    Bytes bytes(ddsi_serdata_size(serdata.get()));
    ddsi_serdata_to_ser(serdata.get(), 0, bytes.size(), bytes.data());
    return bytes;
  }

 private:
  Serdata write_and_take(const Message& message) {
    if (dds_write(writer_, &message) < 0) return nullptr;
    ddsi_serdata* taken = nullptr;
    dds_sample_info_t info;
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(10);
    while (dds_takecdr(reader_, &taken, 1, &info, DDS_ANY_STATE) != 1)
      if (std::chrono::steady_clock::now() > deadline)
        return nullptr;
      else
        std::this_thread::yield();
    return Serdata(taken);
  }

  dds_entity_t participant_, reader_, writer_;
  Serdata type_of_;
};

template <class Topic>
std::string type_name() {
  const std::string topic = Topic::name;
  return "fivepipe::v1::" + topic.substr(topic.rfind('/') + 1);
}

template <class Topic>
class SchemaCyclone : public ::testing::Test {};
using Topics = ::testing::Types<
    bus::topics::CameraInfo, bus::topics::ObjectPixelMap, bus::topics::ObjectCoverage,
    bus::topics::ObjectColour, bus::topics::ViewInfo, bus::topics::HeadPose, bus::topics::HullTile,
    bus::topics::TileCosts, bus::topics::Particles, bus::topics::VirtualState,
    bus::topics::CollisionResult, bus::topics::HullComponents, bus::topics::SimulationMetrics,
    bus::topics::FrameComposited, bus::topics::FrameTrace, bus::topics::ReplaySession,
    bus::topics::Command, bus::topics::SpacingRequest, bus::topics::ObjectSpacing,
    bus::topics::HostStatus, bus::topics::NodeStatus>;
TYPED_TEST_SUITE(SchemaCyclone, Topics);

TYPED_TEST(SchemaCyclone, CycloneOutputDecodesByIdl) {
  Cyclone<TypeParam> cyclone;
  const std::string type = type_name<TypeParam>();
  for (std::uint32_t seed = 1; seed <= 50; ++seed) {
    const test::Payload made =
        test::PayloadMaker(fivepipe_idl(), seed % 2 ? std::endian::little : std::endian::big, seed)
            .make(type);
    const auto sample = cyclone.sample(made.bytes);
    ASSERT_TRUE(sample) << "Cyclone refuses the payload of seed " << seed;
    const Bytes written = cyclone.written(*sample);
    EXPECT_EQ(written.at(1), std::byte{1});
    // Compares text, because JSON's == equates 2^63 and the nearest double.
    EXPECT_EQ(decode(fivepipe_idl(), type, written).dump(), made.values.dump()) << "seed " << seed;
  }
}

TYPED_TEST(SchemaCyclone, IsNamedAsInTheIdl) {
  EXPECT_EQ(TypeParam::descriptor->m_typename, type_name<TypeParam>());
}

Json pose(const fivepipe_v1_Pose& pose) {
  const auto& t = pose.translation_m;
  const auto& r = pose.rotation;
  return {{"translation_m", {{"x", t.x}, {"y", t.y}, {"z", t.z}}},
          {"rotation", {{"x", r.x}, {"y", r.y}, {"z", r.z}, {"w", r.w}}}};
}
Json rect(const fivepipe_v1_PixelRect& rect) {
  return {
      {"u0_px", rect.u0_px}, {"v0_px", rect.v0_px}, {"u1_px", rect.u1_px}, {"v1_px", rect.v1_px}};
}
template <class Sequence>
Json list(const Sequence& sequence) {
  Json result = Json::array();
  for (std::uint32_t i = 0; i < sequence._length; ++i) result.push_back(sequence._buffer[i]);
  return result;
}

TEST(SchemaCycloneByHand, ObjectPixelMap) {
  std::uint8_t octets[] = {7, 0, 255};
  fivepipe_v1_ObjectPixelMap map{"wall1",
                                 (1ull << 63) + 1,
                                 -5,
                                 720,
                                 480,
                                 {1, 2, 30, 40},
                                 99,
                                 fivepipe_v1_run_lengths,
                                 {3, 3, octets, false}};
  const Json decoded = decode(fivepipe_idl(), "fivepipe::v1::ObjectPixelMap",
                              Cyclone<bus::topics::ObjectPixelMap>().written(map));
  const Json expected = {
      {"camera", "wall1"},     {"frame", (1ull << 63) + 1}, {"capture_stamp_ns", -5},
      {"image_width_px", 720}, {"image_height_px", 480},    {"region", rect(map.region)},
      {"object_pixels", 99},   {"encoding", "run_lengths"}, {"payload", {7, 0, 255}}};
  EXPECT_EQ(decoded, expected);
  EXPECT_EQ(decoded["frame"].dump(), "9223372036854775809");
}

TEST(SchemaCycloneByHand, HullTile) {
  float depths[] = {0.0f, 1.25f};
  std::uint8_t colours[] = {1, 2, 3, 4, 5, 6};
  char empty[][33] = {"wall1", "", "a name of thirty-two characters."};
  fivepipe_v1_HullTile tile{};
  std::strcpy(tile.viewer, "eye");
  tile.tile = 3;
  tile.tiles = 65535;
  tile.frame = 12;
  tile.capture_stamp_ns = 1'700'000'000'123'456'789;
  tile.eye_from_world = {{1, -2, 3.5}, {0, 0, 0.6, 0.8}};
  tile.recon = {320, 240, 300.5, 301.5, 160, 120};
  tile.rect = {0, 0, 160, 120};
  tile.covered = {8, 9, 10, 10};
  tile.depth_m = {2, 2, depths, false};
  tile.bgr = {6, 6, colours, false};
  tile.empty_cameras = {3, 3, empty, false};
  const Json decoded = decode(fivepipe_idl(), "fivepipe::v1::HullTile",
                              Cyclone<bus::topics::HullTile>().written(tile));
  const Json recon = {{"width_px", 320}, {"height_px", 240}, {"fx_px", 300.5},
                      {"fy_px", 301.5},  {"cx_px", 160.0},   {"cy_px", 120.0}};
  const Json expected = {{"viewer", "eye"},
                         {"tile", 3},
                         {"tiles", 65535},
                         {"frame", 12},
                         {"capture_stamp_ns", tile.capture_stamp_ns},
                         {"eye_from_world", pose(tile.eye_from_world)},
                         {"recon", recon},
                         {"rect", rect(tile.rect)},
                         {"covered", rect(tile.covered)},
                         {"depth_m", list(tile.depth_m)},
                         {"bgr", list(tile.bgr)},
                         {"empty_cameras", {"wall1", "", empty[2]}}};
  EXPECT_EQ(decoded, expected);
}

TEST(SchemaCycloneByHand, CollisionResultAndItsParts) {
  Cyclone<bus::topics::CollisionResult> cyclone;
  const auto made = test::PayloadMaker(fivepipe_idl(), std::endian::little, 7)
                        .make("fivepipe::v1::CollisionResult");
  const auto sample = cyclone.sample(made.bytes);
  ASSERT_TRUE(sample);
  const Json decoded =
      decode(fivepipe_idl(), "fivepipe::v1::CollisionResult", cyclone.written(*sample));
  EXPECT_EQ(decoded["object"], sample->object);
  EXPECT_EQ(sample->verdict == fivepipe_v1_undecided, decoded["verdict"] == "undecided");
  EXPECT_EQ(decoded["points_truncated"], sample->points_truncated);
  EXPECT_EQ(decoded["triangles"], list(sample->triangles));
  EXPECT_EQ(decoded["residual_m"], sample->residual_m);
  ASSERT_EQ(decoded["contacts"].size(), sample->contacts._length);
  ASSERT_GT(sample->contacts._length, 0u) << "choose another seed";
  const auto& contact = sample->contacts._buffer[sample->contacts._length - 1];
  EXPECT_EQ(decoded["contacts"].back()["camera"], contact.camera);
  EXPECT_EQ(decoded["contacts"].back()["on_hull_m"]["z"], contact.on_hull_m.z);
  EXPECT_EQ(decoded["contacts"].back()["triangle"], contact.triangle);
}

TEST(SchemaCycloneByHand, NodeStatus) {
  fivepipe_v1_NamedCount counts[] = {{"frames", 4}, {"tiles", 1ull << 40}};
  fivepipe_v1_LatencySummary latency{"hull", 1, 2, 3, 4, 5};
  fivepipe_v1_DropCount drop{"bad_map", "wall1", "wrong image size", 6};
  fivepipe_v1_TopicCounts topic{"a/topic", 1, 2, 3, 4, 5};
  fivepipe_v1_EmptyCameraCount empty_camera{"wall2", 8};
  fivepipe_v1_ObjectCollisionCounts collision{"ball", 1, 20, 3};
  fivepipe_v1_Diagnostic diagnostic{"camera wall1", "too dark"};
  fivepipe_v1_NodeStatus status{};
  std::strcpy(status.node, "recon_a");
  status.has_handled_frame = true;
  status.frame_rate_hz = 60;
  status.counts = {2, 2, counts, false};
  status.latencies = {1, 1, &latency, false};
  status.diagnostics = {1, 1, &diagnostic, false};
  status.drops = {1, 1, &drop, false};
  status.topics = {1, 1, &topic, false};
  status.empty_cameras = {1, 1, &empty_camera, false};
  status.collisions = {1, 1, &collision, false};
  std::strcpy(status.gl_renderer, "llvmpipe");
  const Json decoded = decode(fivepipe_idl(), "fivepipe::v1::NodeStatus",
                              Cyclone<bus::topics::NodeStatus>().written(status));
  const Json expected = {
      {"node", "recon_a"},
      {"version", ""},
      {"start_stamp_ns", 0},
      {"has_handled_frame", true},
      {"final_report", false},
      {"frame", 0},
      {"frame_rate_hz", 60.0},
      {"cpu_s", 0.0},
      {"memory_mb", 0.0},
      {"gl_renderer", "llvmpipe"},
      {"counts", Json::array({{{"name", "frames"}, {"count", 4}},
                              {{"name", "tiles"}, {"count", 1ull << 40}}})},
      {"drops", Json::array({{{"reason", "bad_map"},
                              {"subject", "wall1"},
                              {"detail", "wrong image size"},
                              {"count", 6}}})},
      {"topics", Json::array({{{"topic", "a/topic"},
                               {"sent", 1},
                               {"not_sent", 2},
                               {"received", 3},
                               {"recorded", 4},
                               {"lost", 5}}})},
      {"empty_cameras", Json::array({{{"camera", "wall2"}, {"frames", 8}}})},
      {"collisions",
       Json::array({{{"object", "ball"}, {"frames", 1}, {"points", 20}, {"first_contacts", 3}}})},
      {"latencies", Json::array({{{"name", "hull"},
                                  {"p50_ms", 1.0},
                                  {"p95_ms", 2.0},
                                  {"p99_ms", 3.0},
                                  {"max_ms", 4.0},
                                  {"count", 5}}})},
      {"diagnostics", Json::array({{{"subject", "camera wall1"}, {"text", "too dark"}}})}};
  EXPECT_EQ(decoded, expected);
}

}  // namespace
}  // namespace fivepipe::schema
