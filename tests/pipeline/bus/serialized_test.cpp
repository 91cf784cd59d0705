#include "common/pipeline/bus/serialized.h"
#include "common/pipeline/bus/cdr_padding.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <random>

#include "common/pipeline/messages/wire_conversions.h"
#include "tests/support/process.h"
#include "tests/support/test_domain.h"

namespace fivepipe::bus {
namespace {

using namespace std::chrono_literals;

struct Kept {
  SampleKind kind;
  std::uint64_t writer;
  std::int64_t source_stamp_ns;
  std::vector<std::byte> cdr;
};

std::vector<Kept> take_many(Bus& bus, SerializedReader& reader, std::size_t many) {
  std::vector<Kept> kept;
  EXPECT_TRUE(test::eventually(bus, 10s, [&] {
    reader.take([&](const SerializedSample& s) {
      kept.push_back({s.kind, s.writer, s.source_stamp_ns, {s.cdr.begin(), s.cdr.end()}});
    });
    return kept.size() >= many;
  }));
  return kept;
}

topics::Topic described(const char* name) {
  return *std::find_if(topics::all().begin(), topics::all().end(),
                       [&](const topics::Topic& topic) { return std::string(topic.name) == name; });
}
const topics::Topic map_topic = described(topics::ObjectPixelMap::name);

fivepipe_v1_ObjectPixelMap map(const char* camera, std::uint64_t frame,
                               std::vector<std::uint8_t>& payload) {
  fivepipe_v1_ObjectPixelMap message{};
  std::snprintf(message.camera, sizeof message.camera, "%s", camera);
  message.frame = frame;
  message.capture_stamp_ns = std::int64_t(1'000'000 * frame);
  messages::borrow(message.payload, payload);
  return message;
}

// A process may write and end before its samples are taken.
TEST(SerializedBus, DescribesWriterAfterItIsGone) {
  Bus here({test::own_domain()});
  SerializedReader reader(here, map_topic);
  {
    Bus there({test::own_domain()});
    auto out = there.writer<topics::ObjectPixelMap>();
    ASSERT_TRUE(
        test::eventually(here, 10s, [&] { return out.readers() == 1 && reader.writers() == 1; }));
    std::vector<std::uint8_t> payload{1, 2, 3};
    out.write(map("left", 1, payload));
    ASSERT_TRUE(out.wait_for_delivery(10s));
  }
  ASSERT_TRUE(test::eventually(here, 10s, [&] { return reader.writers() == 0; }));
  const auto kept = take_many(here, reader, 1);
  ASSERT_FALSE(kept.empty());
  const auto writer = reader.writer(kept[0].writer);
  ASSERT_TRUE(writer);
  EXPECT_EQ(writer->guid.size(), 32u);
  EXPECT_EQ(writer->qos.at("history"), "keep_last 8");
}

TEST(SerializedBus, RewritesSamplesBitExactWithSourceTimestamp) {
  Bus from({test::own_domain()}), to({test::own_second_domain()});
  auto typed_out = from.writer<topics::ObjectPixelMap>();
  SerializedReader recorder(from, map_topic);
  SerializedWriter replayer(to, map_topic, WriterHistory::keep_all);
  SerializedReader recorder_again(to, map_topic);
  auto typed_in = to.reader<topics::ObjectPixelMap>();
  ASSERT_TRUE(test::eventually(
      from, 10s, [&] { return typed_out.readers() == 1 && replayer.readers() == 2; }));

  // Payloads of every length modulo the alignments.
  std::mt19937 random(5);
  std::vector<std::vector<std::uint8_t>> payloads;
  for (std::size_t length = 0; length < 40; ++length) {
    auto& payload = payloads.emplace_back(length);
    for (auto& byte : payload) byte = std::uint8_t(random());
    typed_out.write(map("left", length, payload));
  }
  const std::vector<Kept> recorded = take_many(from, recorder, payloads.size());
  ASSERT_EQ(recorded.size(), payloads.size());
  for (const Kept& sample : recorded) {
    EXPECT_EQ(sample.kind, SampleKind::data);
    ASSERT_TRUE(replayer.write({sample.kind, 0, sample.source_stamp_ns, sample.cdr}));
  }
  const std::vector<Kept> again = take_many(to, recorder_again, payloads.size());
  ASSERT_EQ(again.size(), payloads.size());
  for (std::size_t i = 0; i < again.size(); ++i) {
    EXPECT_EQ(again[i].cdr, recorded[i].cdr) << i;
    EXPECT_EQ(again[i].source_stamp_ns, recorded[i].source_stamp_ns) << i;
  }
  const auto typed = typed_in.take();  // its history is shorter than the number of samples
  ASSERT_FALSE(typed.empty());
  for (const auto& sample : typed) {
    ASSERT_TRUE(sample.valid());
    EXPECT_EQ(sample->capture_stamp_ns, std::int64_t(1'000'000 * sample->frame));
    EXPECT_TRUE(std::ranges::equal(messages::span_of(sample->payload), payloads[sample->frame]));
  }
}

TEST(SerializedBus, ForwardsUnregisteredKey) {
  Bus from({test::own_domain()}), to({test::own_second_domain()});
  auto typed_out = std::make_optional(from.writer<topics::ObjectPixelMap>());
  SerializedReader recorder(from, map_topic);
  SerializedWriter replayer(to, map_topic, WriterHistory::keep_all);
  auto typed_in = to.reader<topics::ObjectPixelMap>();
  ASSERT_TRUE(test::eventually(
      from, 10s, [&] { return typed_out->readers() == 1 && replayer.readers() == 1; }));
  std::vector<std::uint8_t> payload{1, 2, 3};
  typed_out->write(map("left", 7, payload));
  const std::vector<Kept> there = take_many(from, recorder, 1);
  ASSERT_EQ(there.size(), 1u);
  ASSERT_TRUE(replayer.write({there[0].kind, 0, there[0].source_stamp_ns, there[0].cdr}));
  ASSERT_TRUE(test::eventually(to, 10s, [&] { return !typed_in.take().empty(); }));
  typed_out.reset();
  const std::vector<Kept> gone = take_many(from, recorder, 1);
  ASSERT_EQ(gone.size(), 1u);
  ASSERT_EQ(gone[0].kind, SampleKind::unregistered);

  bool unregistered = false;
  ASSERT_TRUE(replayer.write({gone[0].kind, 0, gone[0].source_stamp_ns, gone[0].cdr}));
  EXPECT_TRUE(test::eventually(to, 10s, [&] {
    for (const auto& sample : typed_in.take())
      unregistered |=
          !sample.valid() && sample.writer_gone() && std::string(sample->camera) == "left";
    return unregistered;
  }));
}

TEST(SerializedBus, ReportsUnregisteredKeyAfterUntakenSample) {
  Bus bus({test::own_domain()});
  auto writer = std::make_optional(bus.writer<topics::ObjectPixelMap>());
  SerializedReader recorder(bus, map_topic);
  ASSERT_TRUE(test::eventually(bus, 10s, [&] { return writer->readers() == 1; }));
  std::vector<std::uint8_t> payload{1, 2, 3};
  for (std::uint64_t frame = 0; frame < 3; ++frame) writer->write(map("left", frame, payload));
  writer.reset();
  ASSERT_TRUE(test::eventually(bus, 10s, [&] { return recorder.writers() == 0; }));
  const std::vector<Kept> kept = take_many(bus, recorder, 4);
  ASSERT_EQ(kept.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_EQ(kept[i].kind, i < 3 ? SampleKind::data : SampleKind::unregistered);
  EXPECT_LT(kept[3].cdr.size(), kept[0].cdr.size());
}

TEST(SerializedBus, RejectsInvalidCdr) {
  Bus bus({test::own_domain()});
  SerializedWriter writer(bus, map_topic, WriterHistory::keep_all);
  const std::vector<std::byte> none, header(4, std::byte{0}), absurd = [] {
    std::vector<std::byte> bytes(16, std::byte{0xff});
    bytes[0] = bytes[2] = bytes[3] = std::byte{0};
    bytes[1] = std::byte{1};
    return bytes;
  }();
  const auto error_of = [&](std::span<const std::byte> cdr) {
    try {
      writer.write({SampleKind::data, 0, 1, cdr});
    } catch (const BusError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const std::string where = std::string(map_topic.name) + ": ";
  EXPECT_EQ(error_of(none), where + "0 bytes are not a serialised message");
  EXPECT_EQ(error_of(std::span(header).first(3)), where + "3 bytes are not a serialised message");
  EXPECT_EQ(error_of(header), where + "4 bytes are not a message of this type");
  EXPECT_EQ(error_of(absurd), where + "16 bytes are not a message of this type");
}

TEST(SerializedBus, TakeReturnsTheNumberOfSamplesAndChangesOfKeys) {
  Bus bus({test::own_domain()});
  SerializedReader reader(bus, map_topic);
  auto writer = std::make_optional(bus.writer<topics::ObjectPixelMap>());
  ASSERT_TRUE(test::eventually(bus, 10s, [&] { return writer->readers() == 1; }));
  std::vector<std::uint8_t> payload{1};
  for (std::uint64_t frame = 0; frame < 300; ++frame) writer->write(map("left", frame, payload));
  for (std::uint64_t frame = 0; frame < 20; ++frame) writer->write(map("right", frame, payload));
  writer.reset();
  ASSERT_TRUE(test::eventually(bus, 10s, [&] { return reader.writers() == 0; }));
  std::size_t samples = 0;
  const std::size_t returned = reader.take([&](const SerializedSample&) { ++samples; });
  EXPECT_EQ(samples, 322u) << "of two keys that have no writer any more";
  EXPECT_EQ(returned, samples);
  EXPECT_EQ(reader.take([&](const SerializedSample&) { ++samples; }), 0u);
  EXPECT_EQ(samples, 322u);
}

TEST(SerializedBus, PadsToWordsAndStatesThePadding) {
  for (std::size_t size = 4; size < 20; ++size) {
    std::vector<std::byte> cdr(size, std::byte(7));
    cdr[3] = std::byte(0);
    const std::vector<std::byte> padded = detail::padded_to_words(cdr);
    ASSERT_EQ(padded.size(), (size + 3) / 4 * 4);
    EXPECT_EQ(padded[3], std::byte(padded.size() - size));
    for (std::size_t i = 0; i < padded.size(); ++i)
      EXPECT_TRUE(i == 3 || padded[i] == std::byte(i < size ? 7 : 0)) << size << " " << i;
  }
}

// A late reader of a latched topic needs the newest sample alone.
TEST(SerializedBus, AWriterKeepsAllSamplesOnRequestUnlessItsTopicIsLatched) {
  const auto history_of = [](const char* topic, WriterHistory history) {
    Bus bus({test::own_domain()});
    const SerializedWriter writer(bus, described(topic), history);
    std::string found;
    test::eventually(bus, 10s, [&] {
      for (const EndpointDescription& endpoint : bus.endpoints())
        if (endpoint.own && endpoint.topic == topic) found = endpoint.qos.at("history");
      return !found.empty();
    });
    return found;
  };
  EXPECT_EQ(history_of(topics::ObjectPixelMap::name, WriterHistory::topic), "keep_last 8");
  EXPECT_EQ(history_of(topics::ObjectPixelMap::name, WriterHistory::keep_all), "keep_all");
  EXPECT_EQ(history_of(topics::CameraInfo::name, WriterHistory::topic), "keep_last 1");
  EXPECT_EQ(history_of(topics::CameraInfo::name, WriterHistory::keep_all), "keep_last 1");
}

TEST(SerializedBus, KeepsAllSamplesUntilTaken) {
  Bus bus({test::own_domain()});
  auto writer = bus.writer<topics::ObjectPixelMap>();
  SerializedReader recorder(bus, map_topic);
  ASSERT_TRUE(test::eventually(bus, 10s, [&] { return writer.readers() == 1; }));
  std::vector<std::uint8_t> payload(1000, 1);
  for (std::uint64_t frame = 0; frame < 500; ++frame) writer.write(map("left", frame, payload));
  EXPECT_EQ(take_many(bus, recorder, 500).size(), 500u);
  EXPECT_EQ(bus.sent().at(map_topic.name), 500u);
}

TEST(SerializedBus, DescribesWriters) {
  Bus bus({.domain = test::own_domain(), .participant = "capture"});
  auto writer = bus.writer<topics::ObjectPixelMap>();
  SerializedReader recorder(bus, map_topic);
  ASSERT_TRUE(test::eventually(bus, 10s, [&] { return writer.readers() == 1; }));
  std::vector<std::uint8_t> payload;
  writer.write(map("left", 1, payload));
  const std::vector<Kept> kept = take_many(bus, recorder, 1);
  ASSERT_EQ(kept.size(), 1u);
  const auto described_writer = recorder.writer(kept[0].writer);
  ASSERT_TRUE(described_writer);
  EXPECT_EQ(described_writer->guid.size(), 32u);
  EXPECT_EQ(described_writer->qos.at("history"), "keep_last 8");
  EXPECT_EQ(described_writer->qos.at("reliability"), "reliable, blocks 100 ms");
  int found = 0;
  for (const EndpointDescription& endpoint : bus.endpoints())
    if (endpoint.guid == described_writer->guid) {
      ++found;
      EXPECT_TRUE(endpoint.writes && endpoint.own);
      EXPECT_EQ(endpoint.topic, map_topic.name);
      EXPECT_EQ(endpoint.type, map_topic.type);
      EXPECT_EQ(endpoint.participant, "capture");
    }
  EXPECT_EQ(found, 1);
}

}  // namespace
}  // namespace fivepipe::bus
