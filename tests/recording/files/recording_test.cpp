#include "common/recording/files/recording.h"

#include <gtest/gtest.h>

#include "tests/support/recording/synthetic_recordings.h"

namespace fivepipe::recording {
namespace {

using test::kStart_ns;
using Bytes = std::vector<std::byte>;

// Types of another version are no obstacle to a replay that does not send them.
TEST(RecordingTypes, DifferencesAreOfTheGivenChannelsAndNotOfKeyStates) {
  const test::TestFolder folder;
  const std::filesystem::path path = folder.path / "made.mcap";
  {
    RecordingWriter writer(path, "tests", {});
    for (const char* of : {"one", "other"}) {
      const mcap::Id channel =
          writer.add_channel("unknown", test::kFramedType, test::kFramedIdl, {{"writer", of}});
      writer.add(channel, kStart_ns, kStart_ns, Bytes(8));
      writer.add(channel, kStart_ns, kStart_ns, KeyChange::disposed, Bytes(8));
    }
    writer.add(writer.add_channel("unknown too", test::kFramedType, test::kFramedIdl, {}),
               kStart_ns, kStart_ns, Bytes(8));
  }
  const Recording recording(path);
  std::set<mcap::Id> all, key_states, messages;
  for (const RecordedChannel& channel : recording.channels()) {
    all.insert(channel.id);
    (channel.key_states ? key_states : messages).insert(channel.id);
  }
  const auto problem = [&](const std::string& topic) {
    return path.string() + ": " + topic + ": this build does not know its type " +
           test::kFramedType;
  };
  using Problems = std::vector<std::string>;
  EXPECT_EQ(key_states.size(), 2u);
  EXPECT_EQ(recording.type_differences(all),
            (Problems{problem("unknown"), problem("unknown too")}));
  EXPECT_EQ(recording.type_differences(key_states), Problems{});
  EXPECT_EQ(recording.type_differences({}), Problems{});
  for (const mcap::Id id : messages)
    EXPECT_EQ(recording.type_differences({id}), Problems{problem(recording.channel(id)->topic)});
}

TEST(RecordingChunks, TheAgeOfAChunkCountsFromItsFirstMessage) {
  const test::TestFolder folder;
  const std::filesystem::path path = folder.path / "made.mcap";
  constexpr std::int64_t kAge_ns = 500'000'000;
  RecordingWriter writer(path, "tests", {.chunk_s = 0.5});
  const mcap::Id channel = writer.add_channel("t", test::kFramedType, test::kFramedIdl, {});
  const auto add = [&](std::int64_t after_ns) {
    writer.add(channel, kStart_ns + after_ns, kStart_ns, Bytes(8));
  };
  writer.tick(kStart_ns);
  add(0);
  add(kAge_ns - 2);
  writer.tick(kStart_ns + kAge_ns - 1);
  add(kAge_ns - 1);
  writer.tick(kStart_ns + kAge_ns);
  add(kAge_ns);
  writer.tick(kStart_ns + 2 * kAge_ns - 1);
  writer.finish();
  const Recording recording(path);
  const auto& chunks = recording.mcap().chunks();
  ASSERT_EQ(chunks.size(), 2u);
  EXPECT_EQ(chunks[0].end_ns, std::uint64_t(kStart_ns + kAge_ns - 1));
  EXPECT_EQ(chunks[1].start_ns, std::uint64_t(kStart_ns + kAge_ns));
}

}  // namespace
}  // namespace fivepipe::recording
