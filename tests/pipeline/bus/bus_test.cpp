#include <dds/dds.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <set>

#include "common/base/realtime.h"
#include "common/pipeline/bus/bus.h"
#include "common/pipeline/bus/discovery.h"
#include "common/pipeline/bus/profile.h"
#include "common/pipeline/bus/serialized.h"
#include "common/pipeline/messages/wire_conversions.h"
#include "common/pipeline/node/status.h"
#include "tests/support/process.h"
#include "tests/support/test_domain.h"
#include "tests/support/test_folder.h"
#include "tests/support/text.h"

namespace fivepipe::bus {
namespace {

using namespace std::chrono_literals;

fivepipe_v1_FrameComposited composited(std::uint64_t frame) {
  fivepipe_v1_FrameComposited message{};
  std::snprintf(message.viewer, sizeof message.viewer, "eye");
  message.frame = frame;
  return message;
}

TEST(Bus, DeliversSamplesInOrderWithTheirWriter) {
  Bus bus({test::own_domain()});
  auto writer = bus.writer<topics::FrameComposited>();
  auto reader = bus.reader<topics::FrameComposited>();
  ASSERT_TRUE(test::eventually(bus, 10s, [&] { return writer.readers() == 1; }));
  for (std::uint64_t frame = 1; frame <= 20; ++frame) writer.write(composited(frame));
  std::uint64_t next = 1, first_writer = 0;
  ASSERT_TRUE(test::eventually(bus, 10s, [&] {
    for (const auto& sample : reader.take()) {
      EXPECT_TRUE(sample.valid());
      EXPECT_EQ(sample->frame, next++);
      if (!first_writer) first_writer = sample.writer();
      EXPECT_EQ(sample.writer(), first_writer);
    }
    return next == 21;
  }));
}

// The reader takes the sample 20 ms after it has arrived.
TEST(Bus, SamplesStateWhenTheyArrived) {
  Bus bus({test::own_domain()});
  auto writer = bus.writer<topics::FrameComposited>();
  auto reader = bus.reader<topics::FrameComposited>();
  ASSERT_TRUE(test::eventually(bus, 10s, [&] { return writer.readers() == 1; }));
  const std::int64_t before_ns = base::now_realtime_ns();
  writer.write(composited(1));
  ASSERT_TRUE(bus.wait(10s));
  const std::int64_t arrived_ns = base::now_realtime_ns();
  while (base::now_realtime_ns() < arrived_ns + 20'000'000) continue;
  const auto samples = reader.take();
  ASSERT_EQ(samples.size(), 1u);
  EXPECT_GE(samples.begin()->arrived_ns(), before_ns);
  EXPECT_LE(samples.begin()->arrived_ns(), arrived_ns);
}

TEST(Bus, ASampleOfAPolledReaderDoesNotEndAWait) {
  Bus bus({test::own_domain()});
  auto writer = bus.writer<topics::FrameComposited>();
  auto polled = bus.polled_reader<topics::FrameComposited>();
  ASSERT_TRUE(test::eventually(bus, 10s, [&] { return writer.readers() == 1; }));
  writer.write(composited(1));
  EXPECT_TRUE(writer.wait_for_delivery(10s));
  EXPECT_FALSE(bus.wait(50ms));
  EXPECT_EQ(polled.take().size(), 1u);
}

TEST(Bus, RestartedWriterGetsANewHandle) {
  Bus bus({test::own_domain()});
  auto reader = bus.reader<topics::FrameComposited>();
  std::vector<std::uint64_t> writers;
  for (int start = 0; start < 2; ++start) {
    auto writer = bus.writer<topics::FrameComposited>();
    ASSERT_TRUE(test::eventually(bus, 10s, [&] { return writer.readers() == 1; }));
    writer.write(composited(1));
    ASSERT_TRUE(test::eventually(bus, 10s, [&] {
      for (const auto& sample : reader.take())
        if (sample.valid()) writers.push_back(sample.writer());
      return writers.size() == std::size_t(start) + 1;
    }));
  }
  EXPECT_NE(writers[0], writers[1]);
}

TEST(Bus, LatchedTopicReachesALateJoiner) {
  Bus bus({test::own_domain()});
  auto writer = bus.writer<topics::CameraInfo>();
  fivepipe_v1_CameraInfo info{};
  std::snprintf(info.camera, sizeof info.camera, "wall1");
  info.pinhole.width_px = 720;
  writer.write(info);
  auto reader = bus.reader<topics::CameraInfo>();
  bool seen = false;
  EXPECT_TRUE(test::eventually(bus, 10s, [&] {
    for (const auto& sample : reader.take())
      seen |= sample.valid() && sample->pinhole.width_px == 720;
    return seen;
  }));
}

// As the spacings of an object, each of which a recorder keeps.
TEST(Bus, AReaderOfALatchedTopicTakesEachOfSeveralChanges) {
  Bus bus({test::own_domain()});
  auto writer = bus.writer<topics::ObjectSpacing>();
  auto reader = bus.reader<topics::ObjectSpacing>();
  ASSERT_TRUE(test::eventually(bus, 10s, [&] { return writer.readers() == 1; }));
  fivepipe_v1_ObjectSpacing message{};
  std::vector<std::uint64_t> written, taken;
  for (message.frame = 1; message.frame <= 20; ++message.frame) {
    writer.write(message);
    ASSERT_TRUE(writer.wait_for_delivery(10s));
    written.push_back(message.frame);
  }
  EXPECT_TRUE(test::eventually(bus, 10s, [&] {
    for (const auto& sample : reader.take()) taken.push_back(sample->frame);
    return !taken.empty() && taken.back() == 20;
  }));
  EXPECT_EQ(taken, written);
}

TEST(Bus, ASlowReaderReceivesTheNewestSamples) {
  Bus bus({test::own_domain()});
  auto writer = bus.writer<topics::HeadPose>();
  auto reader = bus.reader<topics::HeadPose>();
  ASSERT_TRUE(test::eventually(bus, 10s, [&] { return writer.readers() == 1; }));
  fivepipe_v1_HeadPose message{};
  for (message.frame = 1; message.frame <= 1000; ++message.frame) writer.write(message);
  std::uint64_t newest = 0;
  EXPECT_TRUE(test::eventually(bus, 10s, [&] {
    const auto waiting = reader.take();
    EXPECT_LE(waiting.size(), 8u) << "the reader kept more than the depth of a stream";
    for (const auto& sample : waiting) newest = sample->frame;
    return newest == 1000;
  }));
}

TEST(Bus, IncompatibleTypeVersionIsReportedByName) {
  const std::uint32_t domain = test::own_domain();
  setenv("CYCLONEDDS_URI", profile_xml("loopback").c_str(), 1);
  Bus bus({domain});
  auto reader = bus.reader<topics::FrameComposited>();
  std::FILE* peer = popen(
      (std::string(FIVEPIPE_BINARY_DIR) + "/bus_other_version_writer " + std::to_string(domain))
          .c_str(),
      "w");
  ASSERT_NE(peer, nullptr);
  std::string problem_text;
  EXPECT_TRUE(test::eventually(bus, 10s, [&] {
    for (const std::string& problem : bus.problems()) problem_text = problem;
    return !problem_text.empty();
  }));
  EXPECT_NE(problem_text.find("fivepipe/v1/FrameComposited"), std::string::npos) << problem_text;
  EXPECT_NE(problem_text.find("another version of the message type"), std::string::npos)
      << problem_text;
  EXPECT_EQ(pclose(peer), 0);
}

using Texts = std::map<std::string, std::string>;

TEST(Bus, EachDeliveryHasItsQos) {
  Bus bus({.domain = test::own_domain(), .participant = "test"});
  const auto stream = bus.writer<topics::HeadPose>();
  const auto latched = bus.writer<topics::CameraInfo>();
  const auto event = bus.reader<topics::FrameTrace>();
  std::map<std::string, EndpointDescription> found;
  ASSERT_TRUE(test::eventually(bus, 10s, [&] {
    for (const EndpointDescription& endpoint : bus.endpoints())
      if (endpoint.own && endpoint.topic.starts_with("fivepipe/")) found[endpoint.topic] = endpoint;
    return found.size() == 3;
  }));
  const std::string reliable = "reliable, blocks 100 ms";
  EXPECT_EQ(
      found.at(topics::HeadPose::name).qos,
      (Texts{{"durability", "volatile"}, {"history", "keep_last 8"}, {"reliability", reliable}}));
  EXPECT_EQ(found.at(topics::CameraInfo::name).qos, (Texts{{"durability", "transient_local"},
                                                           {"history", "keep_last 1"},
                                                           {"reliability", reliable}}));
  EXPECT_EQ(
      found.at(topics::FrameTrace::name).qos,
      (Texts{{"durability", "volatile"}, {"history", "keep_last 64"}, {"reliability", reliable}}));
  for (const auto& [topic, endpoint] : found) {
    EXPECT_EQ(endpoint.writes, topic != topics::FrameTrace::name);
    EXPECT_EQ(endpoint.participant, "test");
    EXPECT_EQ(endpoint.guid.size(), 32u);
    EXPECT_EQ(endpoint.participant_guid, found.begin()->second.participant_guid);
  }
}

TEST(Discovery, NamesEachPolicy) {
  const std::unique_ptr<dds_qos_t, void (*)(dds_qos_t*)> qos(dds_create_qos(), dds_delete_qos);
  EXPECT_EQ(detail::qos_text(qos.get()), Texts{});
  dds_qset_reliability(qos.get(), DDS_RELIABILITY_BEST_EFFORT, 0);
  dds_qset_durability(qos.get(), DDS_DURABILITY_PERSISTENT);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_ALL, 0);
  EXPECT_EQ(detail::qos_text(qos.get()), (Texts{{"reliability", "best_effort"},
                                                {"durability", "persistent"},
                                                {"history", "keep_all"}}));
  dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, DDS_INFINITY);
  dds_qset_durability(qos.get(), DDS_DURABILITY_TRANSIENT);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, 3);
  EXPECT_EQ(detail::qos_text(qos.get()), (Texts{{"reliability", "reliable, blocks infinite"},
                                                {"durability", "transient"},
                                                {"history", "keep_last 3"}}));
  dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, DDS_MSECS(2500));
  EXPECT_EQ(detail::qos_text(qos.get()).at("reliability"), "reliable, blocks 2500 ms");
  dds_guid_t guid{};
  guid.v[0] = 0x0f, guid.v[1] = 0xa1, guid.v[15] = 0x7e;
  EXPECT_EQ(detail::guid_text(guid), "0fa1" + std::string(26, '0') + "7e");
}

// The peers are of this process but know nothing of fivepipe.
TEST(Bus, PeersWithAnotherQosAreReportedOnce) {
  const std::uint32_t domain = test::own_domain();
  Bus bus({domain});
  const auto reader = bus.reader<topics::FrameComposited>();
  const auto writer = bus.writer<topics::HeadPose>();
  const detail::Entity participant(dds_create_participant(domain, nullptr, nullptr));
  const std::unique_ptr<dds_qos_t, void (*)(dds_qos_t*)> qos(dds_create_qos(), dds_delete_qos);
  dds_qset_reliability(qos.get(), DDS_RELIABILITY_BEST_EFFORT, 0);
  const dds_entity_t composited_topic =
      dds_create_topic(participant.handle, topics::FrameComposited::descriptor,
                       topics::FrameComposited::name, nullptr, nullptr);
  ASSERT_GT(dds_create_writer(participant.handle, composited_topic, qos.get(), nullptr), 0);
  const dds_entity_t pose_topic = dds_create_topic(participant.handle, topics::HeadPose::descriptor,
                                                   topics::HeadPose::name, nullptr, nullptr);
  dds_qset_durability(qos.get(), DDS_DURABILITY_TRANSIENT_LOCAL);
  ASSERT_GT(dds_create_reader(participant.handle, pose_topic, qos.get(), nullptr), 0);
  std::vector<std::string> problems;
  EXPECT_TRUE(test::eventually(bus, 10s, [&] {
    for (const std::string& problem : bus.problems()) problems.push_back(problem);
    return problems.size() == 2;
  }));
  std::sort(problems.begin(), problems.end());
  EXPECT_EQ(problems, (std::vector<std::string>{
                          "fivepipe/v1/FrameComposited: DDS refused a writer of another process: "
                          "reliability QoS (policy 11)",
                          "fivepipe/v1/HeadPose: DDS refused a reader of another process: "
                          "durability QoS (policy 2)"}));
  EXPECT_EQ(bus.problems(), std::vector<std::string>{});
}

TEST(Bus, AConfigurationThatCycloneRefusesIsAnError) {
  setenv("CYCLONEDDS_URI", "<CycloneDDS><Domain><Nonsense/></Domain></CycloneDDS>", 1);
  const std::uint32_t domain = test::own_second_domain();
  std::string what;
  try {
    const Bus bus({domain});
  } catch (const BusError& error) {
    what = error.what();
  }
  unsetenv("CYCLONEDDS_URI");
  EXPECT_TRUE(what.starts_with("cannot open DDS domain " + std::to_string(domain) +
                               " with network profile 'loopback': "))
      << what;
}

// Without return_loan(), each batch would use new memory.
TEST(Bus, BatchesReuseTheMemoryOfEarlierOnes) {
  Bus bus({test::own_domain()});
  auto writer = bus.writer<topics::FrameComposited>();
  auto reader = bus.reader<topics::FrameComposited>();
  ASSERT_TRUE(test::eventually(bus, 10s, [&] { return writer.readers() == 1; }));
  std::set<const void*> places;
  for (std::uint64_t frame = 1; frame <= 20; ++frame) {
    writer.write(composited(frame));
    ASSERT_TRUE(bus.wait(10s));
    for (const auto& sample : reader.take()) places.insert(&*sample);
  }
  EXPECT_EQ(places.size(), 1u);
  EXPECT_FALSE(bus.wait(0ns)) << "no sample";
}

// A Bus in the own second domain of this process, with this configuration.
class ConfiguredBus : public testing::Test {
 protected:
  ~ConfiguredBus() override { unsetenv("CYCLONEDDS_URI"); }
  static Bus bus_with(const std::string& xml, bool frequent_heartbeats = false) {
    setenv("CYCLONEDDS_URI", xml.c_str(), 1);
    return Bus({.domain = test::own_second_domain(), .frequent_heartbeats = frequent_heartbeats});
  }
};

TEST_F(ConfiguredBus, WarnsOfASmallReceiveBufferOnly) {
  const auto xml = [](const std::string& inside) {
    return "<CycloneDDS><Domain><Internal>" + inside + "</Internal></Domain></CycloneDDS>";
  };
  EXPECT_TRUE(bus_with(xml("")).warnings().empty());
  const std::size_t granted = kernel_rmem_max_bytes();
  if (granted == 0) return;  // the kernel does not state it
  const auto warnings = bus_with(xml("<SocketReceiveBufferSize min=\"900000MB\"/>")).warnings();
  ASSERT_EQ(warnings.size(), 1u);
  const std::string start =
      "the kernel grants receive buffers of " + std::to_string(granted) + " bytes";
  EXPECT_EQ(warnings[0].substr(0, start.size()), start);
}

// Cyclone DDS writes its configuration to its log.
TEST_F(ConfiguredBus, RequestsFrequentHeartbeatsOnDemand) {
  const test::TestFolder folder;
  const auto heartbeats = [&](bool frequent) {
    const std::filesystem::path log = folder.path / (frequent ? "frequent" : "default");
    bus_with("<CycloneDDS><Domain><Tracing><Verbosity>config</Verbosity><OutputFile>" +
                 log.string() + "</OutputFile></Tracing></Domain></CycloneDDS>",
             frequent);
    std::ifstream file(log);
    for (std::string line; std::getline(file, line);)
      if (line.find("HeartbeatInterval/#text") != std::string::npos) return line;
    return std::string();
  };
  EXPECT_NE(heartbeats(true).find("200 us"), std::string::npos) << heartbeats(true);
  EXPECT_NE(heartbeats(false), "");
  EXPECT_EQ(heartbeats(false).find("200 us"), std::string::npos) << heartbeats(false);
}

// The reader is in a process that takes nothing more, so a writer that keeps all samples waits.
TEST(Bus, SamplesThatAStoppedProcessDoesNotTakeAreCounted) {
  unsetenv("CYCLONEDDS_URI");
  std::string profile = profile_xml("loopback");
  for (std::size_t at; (at = profile.find("64MB")) != std::string::npos;)
    profile.replace(at, 4, "2kB");  // so many bytes may wait for acknowledgement
  // A busy machine may pause this process for longer than the lease of the stopped peer.
  profile = test::replaced(profile, "<LeaseDuration>2s", "<LeaseDuration>60s");
  setenv("CYCLONEDDS_URI", profile.c_str(), 1);
  const std::uint32_t domain = test::own_domain();
  Bus bus({domain});
  const auto topic = topics::described<topics::ObjectPixelMap>();
  SerializedWriter writer(bus, topic, WriterHistory::keep_all);
  SerializedReader reader(bus, topic);
  auto typed = bus.writer<topics::ObjectPixelMap>();
  const test::TestFolder folder;
  const test::Program peer({FIVEPIPE_BINARY_DIR "/map_reader", std::to_string(domain)},
                           folder.path / "log");
  unsetenv("CYCLONEDDS_URI");  // other tests may run after this one in the same process
  ASSERT_TRUE(test::eventually(bus, 20s, [&] {
    return writer.readers() == 2 && typed.readers() == 2;
  })) << peer.said();
  std::vector<std::uint8_t> payload(4000);
  fivepipe_v1_ObjectPixelMap message{};
  messages::borrow(message.payload, payload);
  typed.write(message);
  std::vector<std::byte> cdr;
  ASSERT_TRUE(test::eventually(bus, 10s, [&] {
    reader.take([&](const SerializedSample& s) { cdr.assign(s.cdr.begin(), s.cdr.end()); });
    return !cdr.empty();
  }));
  ASSERT_TRUE(writer.write({SampleKind::data, 0, 1, cdr}));
  ASSERT_TRUE(writer.wait_for_delivery(10s));
  EXPECT_TRUE(bus.take_not_sent().empty());
  peer.signal(SIGSTOP);
  using Counts = std::map<std::string, std::uint64_t>;
  std::uint64_t written = 2;
  while (writer.write({SampleKind::data, 0, 1, cdr}) && written < 20) ++written;
  EXPECT_LT(written, 20u);
  EXPECT_FALSE(writer.wait_for_delivery(1ms));
  EXPECT_EQ(bus.take_not_sent(), (Counts{{topic.name, 1}}));
  EXPECT_EQ(bus.sent(), (Counts{{topic.name, written}}));
  EXPECT_TRUE(bus.take_not_sent().empty()) << "counts a sample once";
  peer.signal(SIGCONT);
  EXPECT_TRUE(writer.wait_for_delivery(10s));
}

TEST(Profile, TheEnvironmentReplacesTheProfile) {
  const test::TestFolder folder;
  const std::filesystem::path file = folder.path / "profile.xml";
  std::ofstream(file) << "<CycloneDDS>of a file</CycloneDDS>\n";
  setenv("CYCLONEDDS_URI", ("file://" + file.string()).c_str(), 1);
  EXPECT_EQ(profile_xml("loopback"), "<CycloneDDS>of a file</CycloneDDS>\n");
  std::filesystem::remove(file);
  std::string what;
  try {
    profile_xml("loopback");
  } catch (const BusError& error) {
    what = error.what();
  }
  EXPECT_EQ(what, file.string() + ", which CYCLONEDDS_URI names: there is no such file");
  setenv("CYCLONEDDS_URI", "<CycloneDDS/>", 1);
  EXPECT_EQ(profile_xml("any"), "<CycloneDDS/>");
  setenv("CYCLONEDDS_URI", "", 1);
  const std::string shipped = profile_xml("loopback");
  unsetenv("CYCLONEDDS_URI");
  EXPECT_EQ(shipped, profile_xml("loopback"));
  EXPECT_NE(shipped.find("NetworkInterface"), std::string::npos);
}

TEST(Profile, ReceiveBufferSizesHaveUnits) {
  const auto xml = [](const std::string& size) {
    return "<a><SocketReceiveBufferSize max=\"9MB\" min=\"" + size + "\"/></a>";
  };
  for (const auto& [size, bytes] : {std::pair<std::string, std::size_t>{"4MB", 4'194'304},
                                    {"4MiB", 4'194'304},
                                    {"0.5 MB", 524'288},
                                    {"3kB", 3072},
                                    {"3 kiB", 3072},
                                    {"5000B", 5000},
                                    {"5000", 5000}}) {
    for (const std::size_t enough : {bytes, bytes + 1, std::size_t(0)}) {
      EXPECT_EQ(fitted_to_kernel(xml(size), enough).xml, xml(size)) << size;
      EXPECT_EQ(fitted_to_kernel(xml(size), enough).warning, "") << size;
    }
    const std::string granted = std::to_string(bytes - 1), wanted = std::to_string(bytes);
    const FittedProfile fitted = fitted_to_kernel(xml(size), bytes - 1);
    EXPECT_EQ(fitted.xml, xml(granted + "B"));
    EXPECT_EQ(
        fitted.warning,
        "the kernel grants receive buffers of " + granted +
            " bytes, but the network profile requests " + wanted +
            "; large samples may be lost. Raise the limit: sysctl -w net.core.rmem_max=" + wanted);
  }
  EXPECT_EQ(fitted_to_kernel("<a/>", 1).xml, "<a/>");
}

TEST(Profile, ReceiveBufferIsFittedToTheKernelWithAWarning) {
  const std::string xml = profile_xml("loopback");
  EXPECT_EQ(fitted_to_kernel(xml, 8 << 20).xml, xml);
  EXPECT_TRUE(fitted_to_kernel(xml, 8 << 20).warning.empty());
  const FittedProfile fitted = fitted_to_kernel(xml, 212992);
  EXPECT_NE(fitted.xml.find("min=\"212992B\""), std::string::npos);
  EXPECT_NE(fitted.warning.find("sysctl -w net.core.rmem_max=4194304"), std::string::npos);
}

TEST(Profile, UnknownNameListsShippedProfiles) {
  unsetenv("CYCLONEDDS_URI");
  try {
    profile_xml("wifi");
    FAIL();
  } catch (const BusError& error) {
    std::string known;
    for (const std::string& name : profile_names()) known += (known.empty() ? "" : ", ") + name;
    EXPECT_NE(known.find("loopback"), std::string::npos);
    EXPECT_EQ(error.what(), "unknown network profile 'wifi'; choose one of: " + known);
  }
}

Network of_hosts(const std::string& profile, const std::string& interface) {
  Network network = profile;
  network.interface = interface;
  network.peers = {"10.0.0.1", "10.0.0.2"};
  return network;
}

TEST(Profile, OtherMachinesAreReachedByInterfaceAndPeers) {
  unsetenv("CYCLONEDDS_URI");
  EXPECT_FALSE(reaches_other_machines("loopback"));
  for (const std::string profile : {"lan", "lossy"}) {
    EXPECT_TRUE(reaches_other_machines(profile));
    // The loopback interface stands for any, by its name or its address.
    for (const std::string interface : {"lo", "127.0.0.1"}) {
      const std::string xml = profile_xml(of_hosts(profile, interface));
      EXPECT_TRUE(test::contains(xml, "<Interfaces><NetworkInterface " +
                                          std::string(interface == "lo" ? "name" : "address") +
                                          "=\"" + interface + "\"/></Interfaces>"));
      EXPECT_TRUE(test::contains(
          xml, "<Peers><Peer Address=\"10.0.0.1\"/><Peer Address=\"10.0.0.2\"/></Peers>"));
    }
    EXPECT_THROW(profile_xml(profile), BusError) << "without hosts";
    try {
      profile_xml(of_hosts(profile, "eth77"));
      ADD_FAILURE() << "no error";
    } catch (const BusError& error) {
      EXPECT_TRUE(test::contains(error.what(),
                                 "this machine has no network interface 'eth77'; it has lo ("))
          << error.what();
    }
  }
}

TEST(Profile, ADomainOpensWithEachProfile) {
  unsetenv("CYCLONEDDS_URI");
  for (const char* profile : {"lan", "lossy"}) {
    Network network = of_hosts(profile, "lo");
    network.peers = {"127.0.0.1"};
    EXPECT_NO_THROW(Bus({.domain = test::own_domain(), .network = network})) << profile;
  }
}

void expect_typed_fields(const fivepipe_v1_NodeStatus& status) {
  EXPECT_STREQ(status.gl_renderer, "test renderer");
  ASSERT_EQ(status.drops._length, 2u);
  EXPECT_STREQ(status.drops._buffer[0].reason, "bad_map");
  EXPECT_STREQ(status.drops._buffer[0].subject, "wall1");
  EXPECT_STREQ(status.drops._buffer[0].detail, "wrong image size");
  EXPECT_EQ(status.drops._buffer[0].count, 1u);
  EXPECT_STREQ(status.drops._buffer[1].reason, "late_map");
  EXPECT_STREQ(status.drops._buffer[1].subject, "");
  EXPECT_EQ(status.drops._buffer[1].count, 2u);
  ASSERT_EQ(status.empty_cameras._length, 1u);
  EXPECT_STREQ(status.empty_cameras._buffer[0].camera, "wall2");
  EXPECT_EQ(status.empty_cameras._buffer[0].frames, 2u);
  ASSERT_EQ(status.collisions._length, 1u);
  EXPECT_STREQ(status.collisions._buffer[0].object, "ball");
  EXPECT_EQ(status.collisions._buffer[0].frames, 2u);
  EXPECT_EQ(status.collisions._buffer[0].points, 42u);
  EXPECT_EQ(status.collisions._buffer[0].first_contacts, 1u);
  ASSERT_EQ(status.topics._length, 2u);
  EXPECT_STREQ(status.topics._buffer[0].topic, topics::NodeStatus::name);
  EXPECT_STREQ(status.topics._buffer[1].topic, "some/topic");
  EXPECT_EQ(status.topics._buffer[1].received, 5u);
  EXPECT_EQ(status.topics._buffer[1].recorded, 3u);
  EXPECT_EQ(status.topics._buffer[1].lost, 2u);
  ASSERT_EQ(status.diagnostics._length, 1u);
  EXPECT_STREQ(status.diagnostics._buffer[0].subject, "camera wall1");
  EXPECT_STREQ(status.diagnostics._buffer[0].text, "too bright");
}

TEST(NodeStatusReporter, PublishesTypedFieldsAndTheFinalReport) {
  Bus bus({test::own_domain()});
  auto reader = bus.reader<topics::NodeStatus>();
  {
    node::NodeStatusReporter status(bus, "node_under_test");
    status.count("frames_captured", 3);
    status.drop("late_map", 2);
    status.drop({"bad_map", "wall1", "wrong image size"});
    status.empty_camera("wall2");
    status.empty_camera("wall2");
    status.collided("ball", 40);
    status.collided("ball", 2);
    status.first_contact("ball");
    status.recorded("some/topic", {5, 3, 2});
    for (int i = 1; i <= 100; ++i) status.latency("capture", 1e-3 * i);
    status.frame_handled(17);
    status.set_gl_renderer("test renderer");
    status.diagnostic("camera wall1", "too dark");
    status.diagnostic("camera wall1", "too bright");
    status.diagnostic("start", "nearly done");
    status.diagnostic("start", "");
    // A volatile writer's last sample reaches only readers that are already matched.
    ASSERT_TRUE(test::eventually(bus, 10s, [&] { return reader.writers() == 1; }));
  }
  bool final_seen = false;
  ASSERT_TRUE(test::eventually(bus, 10s, [&] {
    for (const auto& sample : reader.take()) {
      if (!sample.valid() || !sample->final_report) continue;
      final_seen = true;
      EXPECT_STREQ(sample->node, "node_under_test");
      EXPECT_EQ(sample->frame, 17u);
      EXPECT_EQ(sample->counts._length, 2u);
      EXPECT_STREQ(sample->counts._buffer[0].name, "cpu_us_frames");
      EXPECT_STREQ(sample->counts._buffer[1].name, "frames_captured");
      EXPECT_EQ(sample->counts._buffer[1].count, 3u);
      expect_typed_fields(*sample);
      EXPECT_NEAR(sample->latencies._buffer[0].p50_ms, 51, 1);
      EXPECT_NEAR(sample->latencies._buffer[0].p99_ms, 100, 1);
    }
    return final_seen;
  }));
}

}  // namespace
}  // namespace fivepipe::bus
