#include "common/pipeline/bus/key_limit.h"

#include <gtest/gtest.h>

#include <span>

#include "common/pipeline/bus/serialized.h"
#include "common/pipeline/messages/wire_conversions.h"
#include "tests/support/process.h"
#include "tests/support/test_domain.h"

namespace fivepipe::bus {
namespace {

using namespace std::chrono_literals;
using detail::KeyLimit;

TEST(KeyLimit, RefusesOnlyFurtherKeysOfTheSameWriter) {
  KeyLimit limit(topics::kMaxKeys);
  for (std::uint64_t key = 0; key < topics::kMaxKeys; ++key) ASSERT_TRUE(limit.accepts(1, key));
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(limit.accepts(1, 1'000'000));
  EXPECT_TRUE(limit.accepts(1, 7)) << "a known key";
  EXPECT_TRUE(limit.accepts(2, 1'000'000)) << "another writer";
  EXPECT_EQ(limit.take_refused(), (std::map<std::uint64_t, std::uint64_t>{{1, 3}}));
  EXPECT_TRUE(limit.take_refused().empty());
}

// Otherwise a replay that plays a recording again and again would use up its keys.
TEST(KeyLimit, AForgottenKeyLeavesSpaceForAnother) {
  KeyLimit limit(topics::kMaxKeys);
  for (std::uint64_t key = 0; key < 3 * topics::kMaxKeys; ++key) {
    ASSERT_TRUE(limit.accepts(1, key)) << key;
    limit.forget(key);
  }
}

TEST(KeyLimit, RemembersABoundedNumberOfWriters) {
  KeyLimit limit(topics::kMaxKeys);
  for (std::uint64_t writer = 1; writer <= 2 * KeyLimit::kMaxWriters; ++writer)
    for (std::uint64_t key = 0; key <= topics::kMaxKeys; ++key)
      limit.accepts(writer, key + (writer << 32));
  const auto refused = limit.take_refused();
  EXPECT_EQ(refused.size(), KeyLimit::kMaxWriters + 1);
  // The further writers share the keys of one.
  EXPECT_EQ(refused.at(KeyLimit::kFurtherWriters),
            KeyLimit::kMaxWriters * (topics::kMaxKeys + 1) - topics::kMaxKeys);
}

// A limit that forgets writers would accept every key of writers that take turns.
TEST(KeyLimit, WritersThatTakeTurnsDoNotExceedIt) {
  constexpr std::size_t kMaxKeys = 8, kTurns = 3000;
  KeyLimit limit(kMaxKeys);
  std::size_t accepted = 0;
  std::uint64_t key = 0;
  for (std::size_t turn = 0; turn < kTurns; ++turn)
    for (std::uint64_t writer = 1; writer <= KeyLimit::kMaxWriters + 1; ++writer)
      accepted += limit.accepts(writer, ++key);
  EXPECT_LE(accepted, (KeyLimit::kMaxWriters + 1) * kMaxKeys);
}

// Otherwise writers that are gone would leave no place for later ones.
TEST(KeyLimit, AWriterWithoutKeysLeavesItsPlaceToAnother) {
  constexpr std::uint64_t kMaxKeys = 2, kKeys = KeyLimit::kMaxWriters * kMaxKeys;
  KeyLimit limit(kMaxKeys);
  for (std::uint64_t round = 0; round < 3; ++round) {
    for (std::uint64_t key = 0; key < kKeys; ++key)
      ASSERT_TRUE(limit.accepts(1 + round * KeyLimit::kMaxWriters + key / kMaxKeys, key)) << key;
    for (std::uint64_t key = 0; key < kKeys; ++key) limit.forget(key);
  }
}

// A writer has one key: the first 256 writers keep theirs, and the next one shares its place.
TEST(KeyLimit, AKeyOfAFurtherWriterStaysKnownWhenTheWriterGetsItsOwnPlace) {
  KeyLimit limit(1);
  for (std::uint64_t writer = 1; writer <= 256; ++writer)
    ASSERT_TRUE(limit.accepts(writer, writer)) << writer;
  constexpr std::uint64_t kFurther = 257, kShared = 1000, kOwn = 1001;
  EXPECT_TRUE(limit.accepts(kFurther, kShared));
  EXPECT_FALSE(limit.accepts(kFurther, kOwn));
  EXPECT_FALSE(limit.accepts(kFurther + 1, kOwn)) << "further writers share one key";
  limit.forget(1);
  EXPECT_TRUE(limit.accepts(kFurther, kShared));
  EXPECT_TRUE(limit.accepts(kFurther, kOwn)) << "the shared key takes the writer's own place";
  limit.forget(kShared);
  EXPECT_TRUE(limit.accepts(kFurther + 1, kShared + 2)) << "a forgotten key keeps its place";
  EXPECT_FALSE(limit.accepts(kFurther + 1, kShared + 3));
}

// A reader receives the samples of 1024 keys, and the bus names the process of the
// writer that uses more.
TEST(BusKeyLimit, ReaderRefusesFurtherKeysAndNamesTheProcess) {
  Bus bus({test::own_domain()});
  auto reader = bus.reader<topics::FrameTrace>();
  auto writer = bus.writer<topics::FrameTrace>(), other = bus.writer<topics::FrameTrace>();
  ASSERT_TRUE(test::eventually(bus, 10s, [&] { return reader.writers() == 2; }));
  std::size_t received = 0;
  const auto take = [&] {
    while (true) {
      const auto batch = reader.take();
      for (const auto& sample : batch) received += sample.valid();
      if (batch.empty()) return;
    }
  };
  const auto write = [&](auto& from, std::size_t key) {
    fivepipe_v1_FrameTrace message{};
    messages::set_text(message.node, "node_" + std::to_string(key));
    from.write(message);
    take();
  };
  // Keys of one writer: more than a deployment has nodes.
  constexpr std::size_t kKeys = 1024, kTooMany = 10;
  for (std::size_t key = 0; key < kKeys + kTooMany; ++key) write(writer, key);
  EXPECT_EQ(received, kKeys);
  write(writer, 5);
  EXPECT_EQ(received, kKeys + 1) << "a known key";
  write(other, 1'000'000);
  EXPECT_EQ(received, kKeys + 2) << "another writer";
  const auto refused = bus.take_refused();
  ASSERT_EQ(refused.size(), 1u);
  EXPECT_EQ(refused[0].topic, topics::FrameTrace::name);
  EXPECT_EQ(refused[0].process, this_process());
  EXPECT_EQ(refused[0].count, kTooMany);
}

// Each tile of a view is a key.
TEST(BusKeyLimit, AReaderAcceptsTheTilesOfALargeView) {
  Bus bus({test::own_domain()});
  auto reader = bus.reader<topics::HullTile>();
  auto writer = bus.writer<topics::HullTile>();
  ASSERT_TRUE(test::eventually(bus, 10s, [&] { return reader.writers() == 1; }));
  constexpr std::uint32_t kTiles = 4096;  // keys of one writer of tiles
  for (std::uint32_t tile = 0; tile <= kTiles; ++tile) {
    fivepipe_v1_HullTile message{};
    message.tile = tile;
    writer.write(message);
    reader.take();
  }
  const auto refused = bus.take_refused();
  ASSERT_EQ(refused.size(), 1u);
  EXPECT_EQ(refused[0].count, 1u);
}

// A FrameComposited message, or its key alone, in little-endian CDR.
std::vector<std::byte> composited_cdr(const std::string& viewer, bool key_alone) {
  std::vector<std::byte> cdr{std::byte{0}, std::byte(key_alone ? 7 : 1), std::byte{0},
                             std::byte{0}};
  const auto put = [&](auto value) {
    const auto bytes = std::as_bytes(std::span(&value, 1));
    cdr.insert(cdr.end(), bytes.begin(), bytes.end());
  };
  put(std::uint32_t(viewer.size() + 1));
  for (const char c : viewer) put(c);
  put('\0');
  if (key_alone) return cdr;
  while ((cdr.size() - 4) % 8) put('\0');
  for (int field = 0; field < 3; ++field) put(std::uint64_t(0));
  return cdr;
}

// A writer of serialized messages with a reader of each kind.
class BusKeyLimitOfBothReaders : public ::testing::Test {
 protected:
  bool is_connected() {
    return test::eventually(bus_, 10s, [&] { return writer_.readers() == 2; });
  }

  Bus bus_{{test::own_domain()}};
  const topics::Topic topic_ = topics::described<topics::FrameComposited>();
  Reader<topics::FrameComposited> typed_ = bus_.reader<topics::FrameComposited>();
  SerializedReader serialized_{bus_, topic_};
  SerializedWriter writer_{bus_, topic_, WriterHistory::topic};
};

// A replay that plays a recording again and again registers and unregisters its keys each time.
TEST_F(BusKeyLimitOfBothReaders, AnUnregisteredKeyLeavesSpaceForAnother) {
  ASSERT_TRUE(is_connected());
  for (std::size_t key = 0; key < 2 * topics::kMaxKeys; ++key) {
    const std::string viewer = "viewer_" + std::to_string(key);
    const auto data = composited_cdr(viewer, false), only_key = composited_cdr(viewer, true);
    ASSERT_TRUE(writer_.write({SampleKind::data, 0, 1, data}));
    ASSERT_TRUE(writer_.write({SampleKind::unregistered, 0, 2, only_key}));
    for (const auto& sample : typed_.take())
      EXPECT_TRUE(!sample.valid() || viewer == sample->viewer);
    serialized_.take([](const SerializedSample&) {});
  }
  EXPECT_TRUE(bus_.take_refused().empty());
}

// DDS passes a change of a key's state by the limit, unlike a sample.
TEST_F(BusKeyLimitOfBothReaders, DisposingFurtherKeysIsCountedAndNamesTheProcess) {
  ASSERT_TRUE(is_connected());
  constexpr std::size_t kTooMany = 10;
  for (std::size_t key = 0; key < topics::kMaxKeys + kTooMany; ++key) {
    const auto only_key = composited_cdr("viewer_" + std::to_string(key), true);
    ASSERT_TRUE(writer_.write({SampleKind::disposed, 0, 1, only_key}));
    for (const auto& sample : typed_.take()) EXPECT_FALSE(sample.valid());
    serialized_.take([](const SerializedSample&) {});
  }
  const auto refused = bus_.take_refused();
  ASSERT_EQ(refused.size(), 2u) << "one for each reader";
  for (const RefusedSamples& of_reader : refused) {
    EXPECT_EQ(of_reader.process, this_process());
    EXPECT_EQ(of_reader.count, kTooMany);
  }
}

}  // namespace
}  // namespace fivepipe::bus
