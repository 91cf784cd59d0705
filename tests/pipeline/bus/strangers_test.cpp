// Readers accept the messages of their own deployment only.
#include <gtest/gtest.h>

#include <cstdio>
#include <map>
#include <set>

#include "common/pipeline/bus/serialized.h"
#include "tests/support/process.h"
#include "tests/support/test_domain.h"

namespace fivepipe::bus {
namespace {

using namespace std::chrono_literals;
using test::eventually;
constexpr auto kMatched = 20s;

fivepipe_v1_FrameComposited composited(const char* viewer, std::uint64_t frame) {
  fivepipe_v1_FrameComposited message{};
  std::snprintf(message.viewer, sizeof message.viewer, "%s", viewer);
  message.frame = frame;
  return message;
}

// The serialised key of FrameComposited: encapsulation (CDR, little-endian), length, characters.
std::vector<std::byte> key_of(const std::string& viewer) {
  std::vector<std::byte> cdr{
      std::byte(0), std::byte(1), std::byte(0), std::byte(0), std::byte(viewer.size() + 1),
      std::byte(0), std::byte(0), std::byte(0)};
  for (const char c : viewer) cdr.push_back(std::byte(c));
  cdr.push_back(std::byte(0));
  return cdr;
}

// Participants of two deployments and of none in one domain, each with a writer.
class Strangers : public testing::Test {
 protected:
  struct Peer {
    explicit Peer(const std::string& deployment)
        : bus({.domain = test::own_domain(), .participant = "peer", .deployment = deployment}) {}
    Bus bus;
    Writer<topics::FrameComposited> composites = bus.writer<topics::FrameComposited>();
    Writer<topics::CameraInfo> infos = bus.writer<topics::CameraInfo>();
  };
  void wait_until_matched(const Bus&) {
    for (Peer* peer : {&own_, &other_, &none_})
      ASSERT_TRUE(eventually(peer->bus, kMatched, [&] { return peer->composites.readers() > 0; }));
  }
  // Sends frame 1 of the own deployment, 2 of the other one, 3 of none, then 4 of the own one.
  void send() {
    own_.composites.write(composited("own", 1));
    for (int i = 0; i < 3; ++i) other_.composites.write(composited("other", 2));
    none_.composites.write(composited("none", 3));
    for (Peer* peer : {&other_, &none_}) EXPECT_TRUE(peer->composites.wait_for_delivery(kMatched));
    own_.composites.write(composited("own", 4));
  }

  // A writer of the other deployment disposes this key.
  void dispose(const std::string& viewer) {
    SerializedWriter writer(other_.bus, topics::described<topics::FrameComposited>(),
                            WriterHistory::keep_all);
    ASSERT_TRUE(eventually(other_.bus, kMatched, [&] { return writer.readers() > 0; }));
    EXPECT_TRUE(writer.write({.kind = SampleKind::disposed, .cdr = key_of(viewer)}));
    EXPECT_TRUE(writer.wait_for_delivery(kMatched));
  }

  Peer own_{"lab one"}, other_{"lab two"}, none_{""};
};

TEST_F(Strangers, AreRefusedAndNamed) {
  Bus bus({.domain = test::own_domain(), .deployment = "lab one"});
  auto reader = bus.reader<topics::FrameComposited>();
  wait_until_matched(bus);
  EXPECT_TRUE(eventually(bus, kMatched, [&] { return reader.writers() == 1; })) << "its own one";
  send();
  std::set<std::uint64_t> frames;
  EXPECT_TRUE(eventually(bus, kMatched, [&] {
    for (const auto& sample : reader.take()) frames.insert(sample->frame);
    return frames.contains(4);
  }));
  EXPECT_EQ(frames, (std::set<std::uint64_t>{1, 4}));
  std::map<std::string, std::uint64_t> refused;  // by deployment
  for (const RefusedSamples& of_writer : bus.take_refused()) {
    EXPECT_EQ(of_writer.reason, RefusedSamples::Reason::other_deployment);
    EXPECT_EQ(of_writer.topic, topics::FrameComposited::name);
    EXPECT_EQ(of_writer.process, this_process());
    refused[of_writer.deployment] += of_writer.count;
  }
  EXPECT_EQ(refused, (std::map<std::string, std::uint64_t>{{"", 1}, {"lab two", 3}}));
  EXPECT_TRUE(bus.take_refused().empty());
  const std::vector<std::string> problems = bus.problems();
  ASSERT_EQ(problems.size(), 1u);
  EXPECT_NE(problems.front().find("deployment 'lab one' without being part of it"),
            std::string::npos)
      << problems.front();
  EXPECT_TRUE(bus.problems().empty()) << "once";
}

TEST_F(Strangers, AreAcceptedByAReaderWithoutADeployment) {
  Bus bus({test::own_domain()});
  auto reader = bus.reader<topics::FrameComposited>();
  wait_until_matched(bus);
  send();
  std::set<std::uint64_t> frames;
  EXPECT_TRUE(eventually(bus, kMatched, [&] {
    for (const auto& sample : reader.take()) frames.insert(sample->frame);
    return frames == std::set<std::uint64_t>{1, 2, 3, 4};
  }));
  EXPECT_TRUE(bus.take_refused().empty());
}

// Their messages existed before the reader.
TEST_F(Strangers, LatchedMessagesAreRefusedToo) {
  for (Peer* peer : {&own_, &other_, &none_}) {
    fivepipe_v1_CameraInfo info{};
    std::snprintf(info.camera, sizeof info.camera, "%s",
                  peer == &own_     ? "own"
                  : peer == &other_ ? "other"
                                    : "none");
    peer->infos.write(info);
  }
  Bus bus({.domain = test::own_domain(), .deployment = "lab one"});
  auto reader = bus.reader<topics::CameraInfo>();
  std::set<std::string> cameras;
  std::uint64_t refused = 0;
  EXPECT_TRUE(eventually(bus, kMatched, [&] {
    for (const auto& sample : reader.take()) cameras.insert(sample->camera);
    for (const RefusedSamples& of_writer : bus.take_refused()) refused += of_writer.count;
    return refused == 2 && !cameras.empty();
  }));
  EXPECT_EQ(cameras, std::set<std::string>{"own"});
}

// A writer that ends disposes its keys, also those that it shares with a writer of this deployment.
TEST_F(Strangers, TheEndOfTheirKeysIsNotReported) {
  Bus bus({.domain = test::own_domain(), .deployment = "lab one"});
  auto reader = bus.reader<topics::FrameComposited>();
  wait_until_matched(bus);
  own_.composites.write(composited("eye", 1));
  std::uint64_t newest = 0;
  const auto take = [&] {
    for (const auto& sample : reader.take()) {
      EXPECT_TRUE(sample.valid() && !sample.writer_gone());
      newest = sample->frame;
    }
    return newest;
  };
  EXPECT_TRUE(eventually(bus, kMatched, [&] { return take() == 1; }));
  {
    Peer stranger("lab two");
    ASSERT_TRUE(eventually(bus, kMatched, [&] { return stranger.composites.readers() > 0; }));
    stranger.composites.write(composited("eye", 7));
    EXPECT_TRUE(stranger.composites.wait_for_delivery(kMatched));
  }
  EXPECT_FALSE(eventually(bus, 200ms, [&] { return take() != 1; }));
  dispose("eye");
  EXPECT_FALSE(eventually(bus, 200ms, [&] { return take() != 1; }));
  own_.composites.write(composited("eye", 2));
  EXPECT_TRUE(eventually(bus, kMatched, [&] { return take() == 2; }));
}

TEST_F(Strangers, AreNotRecordedWithADeployment) {
  Bus bus({.domain = test::own_domain(), .deployment = "lab one"});
  SerializedReader reader(bus, topics::described<topics::FrameComposited>());
  wait_until_matched(bus);
  send();
  std::size_t samples = 0;
  EXPECT_TRUE(eventually(bus, kMatched, [&] {
    samples += reader.take([](const SerializedSample&) {});
    return samples >= 2;
  }));
  EXPECT_EQ(samples, 2u);
  dispose("own");
  EXPECT_FALSE(
      eventually(bus, 200ms, [&] { return reader.take([](const SerializedSample&) {}) > 0; }));
  std::uint64_t refused = 0;
  for (const RefusedSamples& of_writer : bus.take_refused()) refused += of_writer.count;
  EXPECT_EQ(refused, 4u);
}

TEST_F(Strangers, DiscoveryStatesTheDeploymentOfEachEndpoint) {
  Bus bus({test::own_domain()});
  std::map<std::string, int> writers;
  EXPECT_TRUE(eventually(bus, kMatched, [&] {
    writers.clear();
    for (const EndpointDescription& endpoint : bus.endpoints())
      writers[endpoint.deployment] += endpoint.topic == topics::FrameComposited::name;
    return writers["lab one"] == 1 && writers["lab two"] == 1;
  }));
  EXPECT_EQ(writers[""], 1);
}

}  // namespace
}  // namespace fivepipe::bus
