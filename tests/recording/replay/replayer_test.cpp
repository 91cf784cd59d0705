// The replayer as a library, with made-up recordings. tests/system/replay_test.cpp tests the
// process.
#include "common/recording/replay/replayer.h"
#include "common/recording/replay/node_inputs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <thread>

#include "common/pipeline/messages/wire_conversions.h"
#include "tests/support/captured_log.h"
#include "tests/support/process.h"
#include "tests/support/recording/synthetic_recordings.h"
#include "tests/support/test_domain.h"
#include "tests/support/time_units.h"

namespace fivepipe::replay {
namespace {

using namespace std::chrono_literals;
using Bytes = std::vector<std::byte>;
using Clock = std::chrono::steady_clock;
namespace topics = bus::topics;

using test::kStart_ns;

// Plain CDR, little-endian.
class Cdr {
 public:
  explicit Cdr(const std::string& key) {
    add(std::uint32_t(key.size() + 1));
    for (const char c : key) add(c);
    add('\0');
  }
  template <class T>
  Cdr& add(T value) {
    while ((bytes_.size() - 4) % sizeof(T)) bytes_.push_back(std::byte{0});
    test::append_value(bytes_, value);
    return *this;
  }
  Bytes done() {
    while (bytes_.size() % 4) bytes_.push_back(std::byte{0});
    return bytes_;
  }

 private:
  Bytes bytes_ = test::cdr_header();
};

Bytes composited(std::uint64_t frame, const std::string& viewer = "viewer") {
  return Cdr(viewer).add(frame).add(kStart_ns).add(kStart_ns).done();
}
Bytes map_of(const std::string& camera, std::uint64_t frame) {
  Cdr cdr(camera);
  cdr.add(frame).add(kStart_ns);
  for (int i = 0; i < 8; ++i) cdr.add(std::uint32_t(0));  // size, region, pixels, encoding
  return cdr.add(std::uint32_t(0)).done();
}
Bytes pose_of(std::uint64_t frame) {
  Cdr cdr("viewer");
  cdr.add(frame).add(kStart_ns);
  for (int i = 0; i < 7; ++i) cdr.add(0.0);
  return cdr.add(std::uint32_t(0)).done();
}
Bytes camera_info(const std::string& camera) {
  Cdr cdr(camera);
  cdr.add(std::uint32_t(1)).add(std::uint32_t(1));
  for (int i = 0; i < 4; ++i) cdr.add(1.0);
  cdr.add(std::uint8_t(0));
  for (int i = 0; i < 7; ++i) cdr.add(0.0);
  return cdr.done();
}
Bytes command() { return Cdr("all").add(std::uint32_t(0)).done(); }

// A message that arrived, without its payload.
struct Arrived {
  std::string topic;
  std::int64_t source_stamp_ns;
  bool operator==(const Arrived&) const = default;
};

class ReplayerTest : public testing::Test {
 protected:
  ReplayerTest() { start_file({}); }

  void start_file(const recording::WriterOptions& options) {
    writer_.reset();
    std::filesystem::remove(path_);
    writer_.emplace(path_, "tests", options);
    channels_.clear();
  }
  template <class Topic>
  mcap::Id channel(const std::string& writer = "w") {
    const std::string key = std::string(Topic::name) + writer;
    if (!channels_.contains(key))
      channels_[key] = writer_->add_channel(
          Topic::name, Topic::type, schema::fivepipe_schema(Topic::type), {{"writer", writer}});
    return channels_.at(key);
  }
  template <class Topic>
  void add(double at_s, const Bytes& cdr, const std::string& writer = "w") {
    const std::int64_t stamp_ns = kStart_ns + std::int64_t(at_s * double(test::s));
    writer_->add(channel<Topic>(writer), stamp_ns, stamp_ns - 5, cdr);
  }
  // Ends the file and returns a plan that sends all of it at an unlimited rate.
  ReplayPlan finish() {
    writer_.reset();
    recording_.emplace(path_);
    ReplayPlan plan;
    for (const recording::RecordedChannel& channel : recording_->channels())
      plan.channels.insert(channel.id);
    set_range(plan, *recording_, 0, std::nullopt);
    plan.rate = 0;
    return plan;
  }
  static ReplayControl resume() { return ReplayControl::resume; }

  template <class Topic>
  void read() {
    readers_.emplace_back(Topic::name, bus::SerializedReader(peer_, topics::described<Topic>()));
  }
  void take() {
    for (auto& [topic, reader] : readers_)
      reader.take([&, name = topic](const bus::SerializedSample& sample) {
        if (sample.kind == bus::SampleKind::data)
          arrived_.push_back({name, sample.source_stamp_ns});
        is_disposed_ |= sample.kind == bus::SampleKind::disposed;
      });
  }
  // Waits until the readers have `count` messages.
  bool have_arrived(std::size_t count) {
    return test::eventually(peer_, 10s, [&] {
      take();
      return arrived_.size() >= count;
    });
  }
  bool is_ready(const Replayer& replayer) {
    return test::eventually(bus_, 10s, [&] { return replayer.missing_reader().empty(); });
  }

  const std::uint32_t domain_ = test::own_domain();
  test::TestFolder folder_;
  const std::filesystem::path path_ = folder_.path / "made.mcap";
  std::optional<recording::RecordingWriter> writer_;
  std::map<std::string, mcap::Id> channels_;
  std::optional<recording::Recording> recording_;
  bus::Bus bus_{{.domain = domain_, .participant = "replay", .frequent_heartbeats = true}};
  bus::Bus peer_{{.domain = domain_, .participant = "peer", .frequent_heartbeats = true}};
  std::vector<std::pair<std::string, bus::SerializedReader>> readers_;
  std::vector<Arrived> arrived_;
  bool is_disposed_ = false;  // a key
};

TEST(ReplayCounts, AreCompleteIfEverythingWasSentAndHandled) {
  const auto with = [](const auto& change) {
    ReplayCounts counts;
    change(counts);
    return counts.complete();
  };
  EXPECT_TRUE(ReplayCounts{}.complete());
  EXPECT_EQ(ReplayCounts{}.frames, 0u);
  EXPECT_EQ(ReplayCounts{}.seconds, 0);
  EXPECT_FALSE(with([](ReplayCounts& c) { c.in_file["a"] = 1; }));
  EXPECT_FALSE(with([](ReplayCounts& c) { c.late = 1; }));
  EXPECT_FALSE(with([](ReplayCounts& c) { c.damaged = 1; }));
  EXPECT_FALSE(with([](ReplayCounts& c) { c.expected["node"] = c.frames = 1; }));
  EXPECT_FALSE(with([](ReplayCounts& c) { c.expected["node"] = c.handled["node"] = 0; }));
  EXPECT_TRUE(with([](ReplayCounts& c) {
    c.expected["node"] = c.handled["node"] = c.frames = c.in_file["a"] = c.sent["a"] = 1;
  }));
}

TEST_F(ReplayerTest, SendsTheWholeFileInEachRoundAndCountsItOnce) {
  add<topics::FrameComposited>(0, composited(3));
  add<topics::Command>(0.1, command());
  add<topics::FrameComposited>(0.2, composited(3), "other");
  add<topics::FrameComposited>(0.3, composited(4));
  writer_->add(channel<topics::FrameComposited>(), kStart_ns + test::s, kStart_ns,
               recording::KeyChange::disposed, Cdr("viewer").done());
  const ReplayPlan plan = finish();
  read<topics::FrameComposited>();
  Replayer replayer(bus_, *recording_, plan);
  ASSERT_TRUE(is_ready(replayer));
  for (std::size_t round = 1; round <= 2; ++round) {
    replayer.run(resume);
    const std::map<std::string, std::uint64_t> all = {{topics::FrameComposited::name, 3},
                                                      {topics::Command::name, 1}};
    EXPECT_EQ(replayer.counts().in_file, all);
    EXPECT_EQ(replayer.counts().sent, all);
    EXPECT_EQ(replayer.counts().frames, 2u);
    EXPECT_GT(replayer.counts().seconds, 0);
    EXPECT_LT(replayer.counts().seconds, 60);
    EXPECT_TRUE(replayer.counts().complete());
    ASSERT_TRUE(have_arrived(3));
    std::set<std::int64_t> stamps_ns;
    for (const Arrived& message : arrived_) stamps_ns.insert(message.source_stamp_ns);
    EXPECT_EQ(stamps_ns, (std::set<std::int64_t>{kStart_ns - 5, kStart_ns + 200'000'000 - 5,
                                                 kStart_ns + 300'000'000 - 5}));
    EXPECT_TRUE(test::eventually(peer_, 10s, [&] {
      take();
      return is_disposed_;
    }));
    EXPECT_EQ(arrived_.size(), 3u);
    is_disposed_ = false;
    arrived_.clear();
  }
}

TEST_F(ReplayerTest, SkipsAndCountsDamagedChunks) {
  for (const bool lossless : {false, true}) {
    start_file({.compression = mcap::Compression::none, .chunk_bytes = 1});
    for (std::uint64_t frame = 0; frame < 3; ++frame)
      add<topics::FrameComposited>(0.01 * double(frame), composited(frame));
    finish();
    const mcap::ChunkIndex damaged = mcap::Reader(path_).chunks().at(1);
    Bytes bytes = test::file_bytes(path_);
    bytes[damaged.offset + damaged.length_bytes - 1] ^= std::byte(1);
    recording_.reset();
    test::write_file(path_, bytes);
    ReplayPlan plan = finish();
    plan.lossless = lossless;
    if (lossless) plan.nodes = {{"peer", "sim_node", inputs_of("sim_node", {})}};
    Replayer replayer(bus_, *recording_, plan);
    replayer.run(resume);
    EXPECT_EQ(replayer.counts().damaged, 1u) << lossless;
    EXPECT_EQ(replayer.counts().frames, 2u) << lossless;
    EXPECT_EQ(replayer.counts().sent.at(topics::FrameComposited::name), 2u) << lossless;
    EXPECT_FALSE(replayer.counts().complete());
  }
}

// One sleep until the message would ignore the user's keys.
TEST_F(ReplayerTest, PollsForControlWhileItWaitsForAFarMessage) {
  add<topics::FrameComposited>(0, composited(0));
  add<topics::FrameComposited>(3600, composited(1));
  ReplayPlan plan = finish();
  plan.rate = 1;
  Replayer replayer(bus_, *recording_, plan);
  int calls = 0;
  replayer.run([&] { return ++calls < 5 ? ReplayControl::resume : ReplayControl::stop; });
  EXPECT_EQ(calls, 5);
  EXPECT_EQ(replayer.counts().frames, 1u);
  EXPECT_TRUE(replayer.counts().complete()) << "all messages up to the stop";
}

TEST_F(ReplayerTest, RateScalesTheTimeBetweenMessages) {
  add<topics::FrameComposited>(0, composited(0));
  add<topics::FrameComposited>(3600, composited(1));
  ReplayPlan plan = finish();
  plan.rate = 1e5;
  Replayer replayer(bus_, *recording_, plan);
  replayer.run(resume);
  EXPECT_EQ(replayer.counts().frames, 2u);
  EXPECT_GE(replayer.counts().seconds, 0.036);
}

// The clock of the replay stops during a pause.
TEST_F(ReplayerTest, APauseDelaysAllLaterMessages) {
  add<topics::FrameComposited>(0, composited(0));
  add<topics::FrameComposited>(0.25, composited(1));
  ReplayPlan plan = finish();
  plan.rate = 1;
  Replayer replayer(bus_, *recording_, plan);
  int calls = 0;
  std::optional<Clock::time_point> paused;
  replayer.run([&] {
    if (++calls < 2) return ReplayControl::resume;
    if (!paused) paused = Clock::now();
    return Clock::now() - *paused < 300ms ? ReplayControl::pause : ReplayControl::resume;
  });
  EXPECT_EQ(replayer.counts().frames, 2u);
  EXPECT_GT(replayer.counts().seconds, 0.4) << "0.25 s and the pause";
}

// One step sends one frame, the messages before it, and those up to the next frame.
TEST_F(ReplayerTest, EachStepSendsOneFrame) {
  add<topics::Command>(0, command());
  add<topics::Command>(0.1, command());
  for (std::uint64_t frame = 0; frame < 4; ++frame) {
    const double at_s = 1 + double(frame);
    add<topics::FrameComposited>(at_s, composited(frame));
    add<topics::FrameComposited>(at_s + 0.1, composited(frame), "other");
    add<topics::Command>(at_s + 0.2, command());
  }
  ReplayPlan plan = finish();
  for (const double rate : {0.0, 1.0}) {
    plan.rate = rate;
    Replayer replayer(bus_, *recording_, plan);
    for (const std::uint64_t steps : {2, 0, 1}) {
      std::uint64_t calls = 0, idle_calls = 0;
      replayer.run([&] {
        if (++calls <= steps) return ReplayControl::step;
        return ++idle_calls < 4 ? ReplayControl::pause : ReplayControl::stop;
      });
      EXPECT_EQ(replayer.counts().frames, steps) << rate;
      auto sent = replayer.counts().sent;
      EXPECT_EQ(sent[topics::FrameComposited::name], 2 * steps) << rate;
      EXPECT_EQ(sent[topics::Command::name], steps ? 2 + steps : 0) << rate;
    }
  }
}

// A later reader needs the newest latched messages; other messages before the start stay unsent.
TEST_F(ReplayerTest, ARangeIncludesTheLatchedMessagesBeforeIt) {
  add<topics::CameraInfo>(0, camera_info("before"));
  writer_->add(channel<topics::CameraInfo>(), kStart_ns, kStart_ns,
               recording::KeyChange::unregistered, Cdr("before").done());
  add<topics::FrameComposited>(0.5, composited(0));
  add<topics::CameraInfo>(1, camera_info("at the start"));
  add<topics::FrameComposited>(1, composited(1));
  add<topics::FrameComposited>(2, composited(2));
  ReplayPlan plan = finish();
  set_range(plan, *recording_, 1, 1.5);
  read<topics::CameraInfo>();
  read<topics::FrameComposited>();
  Replayer replayer(bus_, *recording_, plan);
  ASSERT_TRUE(is_ready(replayer));
  replayer.run(resume);
  EXPECT_EQ(replayer.counts().in_file,
            (std::map<std::string, std::uint64_t>{{topics::CameraInfo::name, 1},
                                                  {topics::FrameComposited::name, 1}}));
  ASSERT_TRUE(have_arrived(3));
  const auto time_ns = [](double s) { return kStart_ns - 5 + std::int64_t(s * 1e9); };
  const std::vector<Arrived> expected = {{topics::CameraInfo::name, time_ns(0)},
                                         {topics::CameraInfo::name, time_ns(1)},
                                         {topics::FrameComposited::name, time_ns(1)}};
  std::stable_sort(arrived_.begin(), arrived_.end(), [](const Arrived& a, const Arrived& b) {
    return std::tie(a.topic, a.source_stamp_ns) < std::tie(b.topic, b.source_stamp_ns);
  });
  EXPECT_EQ(arrived_, expected);
}

TEST_F(ReplayerTest, NamesTheReaderThatIsMissing) {
  add<topics::FrameComposited>(0, composited(0));
  ReplayPlan plan = finish();
  const Replayer any(bus_, *recording_, plan);
  EXPECT_EQ(any.missing_reader(), "no node reads any of the topics");
  plan.nodes = {{"capture", "capture_node", inputs_of("capture_node", {})}};
  const Replayer named(bus_, *recording_, plan);
  EXPECT_EQ(named.missing_reader(),
            std::string("node 'capture' does not read ") + topics::FrameComposited::name + " yet");
  bus::Bus capture({.domain = domain_, .participant = "capture"});
  const auto first = capture.reader<topics::FrameComposited>();
  const std::string second_missing =
      std::string("node 'capture' does not read ") + topics::TileCosts::name + " yet";
  EXPECT_TRUE(test::eventually(bus_, 10s, [&] { return named.missing_reader() == second_missing; }))
      << named.missing_reader();
  EXPECT_TRUE(is_ready(any)) << any.missing_reader();
  const auto second = capture.reader<topics::TileCosts>();
  EXPECT_TRUE(is_ready(named)) << named.missing_reader();
}

TEST_F(ReplayerTest, ListsOtherWritersOfTheReplayedTopics) {
  add<topics::FrameComposited>(0, composited(0));
  add<topics::FrameTrace>(0, test::cdr_header());  // not sent here
  add<topics::NodeStatus>(0, test::cdr_header());
  const ReplayPlan plan = finish();
  const Replayer replayer(bus_, *recording_, plan);
  const auto reader = peer_.reader<topics::FrameComposited>();
  const auto command = peer_.writer<topics::Command>();
  const auto traces = peer_.writer<topics::FrameTrace>();
  const auto statuses = peer_.writer<topics::NodeStatus>();
  // Discovery has found all of the above when it finds this reader.
  const auto last = peer_.reader<topics::TileCosts>();
  ASSERT_TRUE(test::eventually(bus_, 10s, [&] {
    const auto endpoints = bus_.endpoints();
    return std::count_if(endpoints.begin(), endpoints.end(),
                         [](const auto& endpoint) { return endpoint.participant == "peer"; }) >= 5;
  }));
  EXPECT_EQ(replayer.conflicts(), std::vector<std::string>());
  const auto other = peer_.writer<topics::FrameComposited>();
  const std::vector<std::string> expected = {std::string("'peer' writes ") +
                                             topics::FrameComposited::name};
  EXPECT_TRUE(test::eventually(bus_, 10s, [&] { return !replayer.conflicts().empty(); }));
  EXPECT_EQ(replayer.conflicts(), expected);
}

TEST_F(ReplayerTest, RefusesTypesOfAnotherVersion) {
  for (const char* topic : {topics::Command::name, topics::HeadPose::name})
    writer_->add(writer_->add_channel(topic, test::kFramedType, test::kFramedIdl, {}), kStart_ns,
                 kStart_ns, test::framed(0, 0));
  const ReplayPlan plan = finish();
  try {
    Replayer(bus_, *recording_, plan);
    FAIL();
  } catch (const recording::RecordingError& error) {
    const auto of = [&](const char* topic) {
      return path_.string() + ": " + topic + ": this build does not know its type " +
             test::kFramedType;
    };
    EXPECT_EQ(error.what(), of(topics::Command::name) + "\n" + of(topics::HeadPose::name));
  }
}

// The peer is a sim_node of one camera. It handles a frame when the test calls handle().
class LosslessReplayerTest : public ReplayerTest {
 protected:
  ReplayPlan lossless() {
    ReplayPlan plan = finish();
    plan.lossless = true;
    plan.nodes = {{"peer", "sim_node", inputs_of("sim_node", {})}};
    plan.shape_cameras = 1;
    return plan;
  }
  // Waits until the node and the replayer have found each other.
  bool are_connected(const Replayer& replayer) {
    return test::eventually(
        bus_, 10s, [&] { return replayer.missing_reader().empty() && traces_.readers() == 1; });
  }
  // Waits until the node has the frame's map.
  bool has_map(std::uint64_t frame) {
    return test::eventually(peer_, 10s, [&] {
      for (const auto& sample : maps_.take())
        if (sample.valid()) received_.insert(sample->frame);
      return received_.contains(frame);
    });
  }
  void handle(std::uint64_t frame) {
    fivepipe_v1_FrameTrace trace{};
    messages::set_text(trace.node, "peer");
    trace.frame = frame;
    traces_.write(trace);
  }
  // Records what the replayer has sent.
  void listen_to(Replayer& replayer) {
    sent_.clear();
    received_.clear();
    handled_ = 0;
    replayer.on_frame_sent = [this](std::uint64_t frame, const SendTimes& times) {
      sent_.push_back(frame);
      EXPECT_GT(times.start_ns, kStart_ns);
      EXPECT_GE(times.release_ns, times.start_ns);
      EXPECT_GE(times.end_ns, times.release_ns);
      EXPECT_LT(times.end_ns - times.start_ns, 60 * test::s);
    };
  }
  // Handles the oldest frame if the replayer has sent none since the last call: it waits.
  ReplayControl handle_if_waited_for() {
    if (sent_.size() == sent_before_ && handled_ < sent_.size()) handle(sent_[handled_++]);
    sent_before_ = sent_.size();
    return ReplayControl::resume;
  }

  bus::Reader<topics::ObjectPixelMap> maps_ = peer_.reader<topics::ObjectPixelMap>();
  const bus::Reader<topics::ReplaySession> sessions_ = peer_.reader<topics::ReplaySession>();
  const bus::Reader<topics::CameraInfo> cameras_ = peer_.reader<topics::CameraInfo>();
  const bus::Reader<topics::Command> commands_ = peer_.reader<topics::Command>();
  bus::Writer<topics::FrameTrace> traces_ = peer_.writer<topics::FrameTrace>();
  std::set<std::uint64_t> received_;
  std::vector<std::uint64_t> sent_;
  std::size_t handled_ = 0, sent_before_ = 0;
};

TEST_F(LosslessReplayerTest, KeepsTheGivenNumberOfFramesInFlight) {
  constexpr std::uint64_t kFrames = 5;
  for (std::uint64_t frame = 0; frame < kFrames; ++frame)
    add<topics::ObjectPixelMap>(0.01 * double(frame), map_of("c", frame));
  ReplayPlan plan = lossless();
  for (const SendOrder order :
       {SendOrder::inputs_first, SendOrder::pipelined, SendOrder::as_captured}) {
    plan.frames_in_flight = order == SendOrder::pipelined ? 1 : 3;
    plan.order = order;
    Replayer replayer(bus_, *recording_, plan);
    ASSERT_TRUE(are_connected(replayer));
    listen_to(replayer);
    std::vector<std::uint64_t> traced;
    replayer.set_trace_listener(
        [&](const fivepipe_v1_FrameTrace& trace) { traced.push_back(trace.frame); });
    std::size_t max_open = 0;
    replayer.run([&] {
      max_open = std::max(max_open, sent_.size() - handled_);
      return handle_if_waited_for();
    });
    EXPECT_EQ(max_open, std::size_t(plan.frames_in_flight)) << int(order);
    EXPECT_EQ(sent_, (std::vector<std::uint64_t>{0, 1, 2, 3, 4}));
    EXPECT_EQ(traced, sent_);
    const ReplayCounts& counts = replayer.counts();
    EXPECT_EQ(counts.frames, kFrames);
    EXPECT_EQ(counts.expected, (std::map<std::string, std::uint64_t>{{"peer", kFrames}}));
    EXPECT_EQ(counts.handled, counts.expected);
    EXPECT_EQ(counts.late, 0u);
    EXPECT_TRUE(counts.complete());
  }
}

// Whichever message of a frame was recorded first. A pipelined replay has sent the inputs of the
// next frame too.
TEST_F(LosslessReplayerTest, SendsTheInputsOfAFrameBeforeItsMaps) {
  for (std::uint64_t frame = 0; frame < 3; ++frame) {
    add<topics::ObjectPixelMap>(double(frame), map_of("c", frame));
    add<topics::HeadPose>(double(frame) + 0.1, pose_of(frame));
  }
  ReplayPlan plan = lossless();
  read<topics::HeadPose>();
  for (const SendOrder order : {SendOrder::inputs_first, SendOrder::pipelined}) {
    plan.order = order;
    plan.frames_in_flight = 1;
    Replayer replayer(bus_, *recording_, plan);
    ASSERT_TRUE(are_connected(replayer));
    listen_to(replayer);
    arrived_.clear();
    replayer.run([&] {
      if (handled_ == sent_.size()) return ReplayControl::resume;
      const std::uint64_t frame = sent_.back();
      EXPECT_TRUE(has_map(frame));
      take();
      if (order == SendOrder::pipelined)
        EXPECT_TRUE(have_arrived(std::min<std::size_t>(frame + 2, 3)));
      else
        EXPECT_EQ(arrived_.size(), frame + 1);
      return handle_if_waited_for();
    });
    EXPECT_TRUE(replayer.counts().complete());
    EXPECT_EQ(replayer.counts().sent,
              (std::map<std::string, std::uint64_t>{{topics::ObjectPixelMap::name, 3},
                                                    {topics::HeadPose::name, 3}}));
    EXPECT_EQ(arrived_.size(), 3u);
  }
}

// Otherwise it would take effect between other frames in another run. Nodes keep latched messages.
TEST_F(LosslessReplayerTest, AMessageOfNoFrameWaitsUntilAllFramesAreHandledUnlessItIsLatched) {
  add<topics::ObjectPixelMap>(0, map_of("c", 0));
  add<topics::CameraInfo>(0.1, camera_info("c"));
  add<topics::Command>(0.2, command());
  add<topics::ObjectPixelMap>(0.3, map_of("c", 1));
  ReplayPlan plan = lossless();
  read<topics::CameraInfo>();
  read<topics::Command>();
  for (const SendOrder order : {SendOrder::inputs_first, SendOrder::pipelined}) {
    plan.order = order;
    Replayer replayer(bus_, *recording_, plan);
    ASSERT_TRUE(are_connected(replayer));
    listen_to(replayer);
    arrived_.clear();
    int calls = 0;
    replayer.run([&] {
      if (sent_.empty() || ++calls < 5) return ReplayControl::resume;
      if (calls == 5) {
        EXPECT_EQ(sent_, std::vector<std::uint64_t>{0});
        EXPECT_TRUE(have_arrived(1));
        EXPECT_EQ(arrived_.at(0).topic, topics::CameraInfo::name);
        EXPECT_EQ(arrived_.size(), 1u);
      }
      return handle_if_waited_for();
    });
    EXPECT_TRUE(have_arrived(2));
    EXPECT_EQ(arrived_.back().topic, topics::Command::name);
    EXPECT_EQ(arrived_.size(), 2u);
    EXPECT_EQ(sent_.size(), 2u);
    EXPECT_TRUE(replayer.counts().complete());
  }
}

// No node answers such frames, and its queue must not overflow.
TEST_F(LosslessReplayerTest, WaitsAfterEveryFourFramesThatNoNodeHandles) {
  for (std::uint64_t frame = 0; frame < 8; ++frame)
    add<topics::FrameComposited>(0.01 * double(frame), composited(frame));
  const ReplayPlan plan = lossless();
  Replayer replayer(bus_, *recording_, plan);
  replayer.run(resume);
  EXPECT_EQ(replayer.counts().frames, 8u);
  EXPECT_EQ(replayer.counts().expected.at("peer"), 0u);
  EXPECT_GE(replayer.counts().seconds, 0.2);
}

// A message of no frame ends a series of frames that no node handles, so this takes no pause.
TEST_F(LosslessReplayerTest, CountsLateMessages) {
  for (std::uint64_t frame = 0; frame < 130; ++frame) {
    add<topics::FrameComposited>(0.01 * double(frame), composited(frame));
    if (frame % 3 == 2) add<topics::Command>(0.01 * double(frame), command());
  }
  add<topics::FrameComposited>(1.3, composited(3), "other");
  const ReplayPlan plan = lossless();
  Replayer replayer(bus_, *recording_, plan);
  replayer.run(resume);
  EXPECT_EQ(replayer.counts().late, 1u);
  EXPECT_EQ(replayer.counts().frames, 130u);
  EXPECT_EQ(replayer.counts().sent.at(topics::FrameComposited::name), 131u);
  EXPECT_FALSE(replayer.counts().complete());
}

TEST_F(LosslessReplayerTest, EndsIfANodeStalls) {
  for (std::uint64_t frame = 0; frame < 5; ++frame)
    add<topics::ObjectPixelMap>(0.01 * double(frame), map_of("c", frame));
  ReplayPlan plan = lossless();
  plan.timeout = 1ms;
  const test::CapturedLog log;
  Replayer replayer(bus_, *recording_, plan);
  ASSERT_TRUE(are_connected(replayer));
  replayer.run(resume);
  EXPECT_NE(log.text().find("node 'peer' has not handled frame 0"), std::string::npos)
      << log.text();
  EXPECT_EQ(replayer.counts().frames, 2u);
  EXPECT_EQ(replayer.counts().expected.at("peer"), 2u);
  EXPECT_EQ(replayer.counts().handled.at("peer"), 0u);
  EXPECT_FALSE(replayer.counts().complete());
}

// The user ends the replay: the frames in flight count if their traces arrive soon.
TEST_F(LosslessReplayerTest, AStopWaitsForTheFramesInFlight) {
  for (std::uint64_t frame = 0; frame < 9; ++frame)
    add<topics::ObjectPixelMap>(0.01 * double(frame), map_of("c", frame));
  const ReplayPlan plan = lossless();
  Replayer replayer(bus_, *recording_, plan);
  ASSERT_TRUE(are_connected(replayer));
  std::thread node;
  int calls = 0;
  replayer.run([&] {
    if (++calls < 5) return ReplayControl::resume;
    node = std::thread([&] {
      for (const std::uint64_t frame : {0, 1}) {
        std::this_thread::sleep_for(60ms);
        handle(frame);
      }
    });
    return ReplayControl::stop;
  });
  node.join();
  EXPECT_EQ(calls, 5);
  EXPECT_EQ(replayer.counts().frames, 2u);
  EXPECT_EQ(replayer.counts().handled.at("peer"), 2u);
  EXPECT_TRUE(replayer.counts().complete());
}

}  // namespace
}  // namespace fivepipe::replay
