#include "common/recording/files/frame_groups.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "tests/support/recording/synthetic_recordings.h"

namespace fivepipe::recording {
namespace {

using test::kFrame_ns, test::kStart_ns;

// A message. Topics a, b and c belong to frames and have this rank; `free` belongs to none.
struct Made {
  std::string topic;
  std::optional<std::uint64_t> frame;
  std::int64_t log_stamp_ns;
  std::uint32_t number = 0;           // its index in the file
  std::int64_t capture_stamp_ns = 0;  // 0: equal to log_stamp_ns
};

int rank_of(const std::string& topic) { return topic[0] - 'a'; }

class FrameGroupsTest : public testing::Test {
 protected:
  test::TestFolder folder_;
  std::optional<Recording> recording_;

  // Numbers the messages, writes them to a file and returns its groups.
  std::vector<FrameGroup> groups_of(std::vector<Made>& messages, std::uint64_t* late = nullptr) {
    const auto path = folder_.path / "made.mcap";
    recording_.reset();
    std::filesystem::remove(path);
    {
      RecordingWriter writer(path, "tests", {.chunk_bytes = 600});  // several chunks
      std::map<std::string, mcap::Id> channels;
      for (const char* topic : {"a", "b", "c"})
        channels[topic] =
            writer.add_channel(topic, test::kFramedType, test::kFramedIdl, {{"writer", topic}});
      channels["free"] = writer.add_channel("free", test::kFramelessType, test::kFramelessIdl, {});
      std::uint32_t number = 0;
      for (Made& made : messages) {
        made.number = number++;
        writer.add(channels.at(made.topic), made.log_stamp_ns, made.log_stamp_ns,
                   made.frame ? test::framed(*made.frame, made.number,
                                             made.capture_stamp_ns ? made.capture_stamp_ns
                                                                   : made.log_stamp_ns)
                              : test::frameless(7, made.number));
      }
    }
    recording_.emplace(path);
    FrameGroups groups(*recording_, recording_->messages(), rank_of);
    std::vector<FrameGroup> all;
    while (auto group = groups.next()) all.push_back(std::move(*group));
    if (late) *late = groups.late();
    return all;
  }
};

// Each frame has one a, three b and one c, at random positions within `spread` frames; frameless
// messages are in between.
std::vector<Made> shuffled(std::mt19937& random, std::uint64_t frames, std::uint64_t spread) {
  std::vector<std::pair<std::uint64_t, Made>> placed;
  for (std::uint64_t frame = 0; frame < frames; ++frame) {
    for (const char* topic : {"a", "b", "b", "b", "c"}) {
      const std::uint64_t later = frame + random() % spread;
      placed.push_back({100 * later + random() % 100, {topic, 50 + frame, 0}});
    }
    placed.push_back({100 * frame + random() % 100, {"free", std::nullopt, 0}});
  }
  std::stable_sort(placed.begin(), placed.end(),
                   [](const auto& x, const auto& y) { return x.first < y.first; });
  std::vector<Made> messages;
  for (auto& [place, made] : placed) {
    made.log_stamp_ns = kStart_ns + std::int64_t(place) * kFrame_ns / 100;
    messages.push_back(made);
  }
  return messages;
}

TEST_F(FrameGroupsTest, GroupsInterleavedFramesByRank) {
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    std::mt19937 random(seed);
    std::vector<Made> messages = shuffled(random, 60, 1 + seed % 8);
    std::uint64_t late = 1;
    const auto groups = groups_of(messages, &late);
    EXPECT_EQ(late, 0u);
    std::set<std::uint64_t> seen;
    std::vector<std::uint32_t> first_of_group, numbers;
    for (const FrameGroup& group : groups) {
      std::uint32_t first = UINT32_MAX;
      for (const OwnedMessage& message : group.messages) {
        numbers.push_back(test::number_of(message.cdr));
        first = std::min(first, numbers.back());
        EXPECT_EQ(messages[numbers.back()].frame, group.frame);
      }
      first_of_group.push_back(first);
      EXPECT_EQ(messages[first].log_stamp_ns, group.log_stamp_ns);
      EXPECT_EQ(group.capture_stamp_ns, group.frame ? group.log_stamp_ns : 0);
      for (const OwnedMessage& message : group.messages) {
        const std::int64_t log_stamp_ns = messages[test::number_of(message.cdr)].log_stamp_ns;
        EXPECT_EQ(message.log_stamp_ns, log_stamp_ns);
        EXPECT_EQ(message.source_stamp_ns, log_stamp_ns);
        EXPECT_EQ(message.capture_stamp_ns, group.frame ? log_stamp_ns : 0);
        EXPECT_FALSE(message.key_change);
      }
      if (!group.frame) {
        EXPECT_EQ(group.messages.size(), 1u);
        continue;
      }
      EXPECT_TRUE(seen.insert(*group.frame).second)
          << "frame " << *group.frame << " was returned twice, seed " << seed;
      ASSERT_EQ(group.messages.size(), 5u) << "frame " << *group.frame << ", seed " << seed;
      std::string topics;
      for (const OwnedMessage& message : group.messages) topics += message.channel->topic;
      EXPECT_EQ(topics, "abbbc");
      EXPECT_LT(test::number_of(group.messages[1].cdr), test::number_of(group.messages[2].cdr));
      EXPECT_LT(test::number_of(group.messages[2].cdr), test::number_of(group.messages[3].cdr));
    }
    // Groups, including frameless ones, have the order of their first messages; no message is lost.
    EXPECT_TRUE(std::is_sorted(first_of_group.begin(), first_of_group.end())) << seed;
    std::sort(numbers.begin(), numbers.end());
    ASSERT_EQ(numbers.size(), messages.size());
    for (std::uint32_t i = 0; i < numbers.size(); ++i) EXPECT_EQ(numbers[i], i);
  }
}

TEST_F(FrameGroupsTest, LateMessagesAreCountedAndGroupedAlone) {
  constexpr std::uint64_t kManyFrames = FrameGroups::kReorderWindow_frames + 40;
  std::vector<Made> messages;
  for (std::uint64_t frame = 0; frame < kManyFrames; ++frame)
    for (const char* topic : {"a", "b"})
      messages.push_back({topic, frame, kStart_ns + std::int64_t(frame) * kFrame_ns});
  const std::size_t at = 2 * (3 + FrameGroups::kReorderWindow_frames + 2);
  messages.insert(messages.begin() + std::ptrdiff_t(at),
                  {"c", 3, messages[at].log_stamp_ns, 0, kStart_ns + 3 * kFrame_ns});
  std::uint64_t late = 0;
  const auto groups = groups_of(messages, &late);
  EXPECT_EQ(late, 1u);
  EXPECT_EQ(groups.size(), kManyFrames + 1);
  const auto alone = std::find_if(groups.begin(), groups.end(),
                                  [](const FrameGroup& group) { return !group.frame; });
  ASSERT_NE(alone, groups.end());
  EXPECT_EQ(alone->messages.at(0).channel->topic, "c");
}

// A message belongs to its frame if it precedes the first message of the 120th frame after it.
TEST_F(FrameGroupsTest, AFrameIsOpenUntilThe120thFrameAfterIt) {
  for (const bool in_time : {false, true}) {
    std::vector<Made> messages;
    for (std::uint64_t frame = 0; frame < 130; ++frame)
      messages.push_back({"a", frame, kStart_ns + std::int64_t(frame) * kFrame_ns});
    const std::size_t at = in_time ? 3 + 120 : 3 + 121;
    messages.insert(messages.begin() + std::ptrdiff_t(at),
                    {"b", 3, messages[at - 1].log_stamp_ns, 0, kStart_ns + 3 * kFrame_ns});
    std::uint64_t late = 0;
    const auto groups = groups_of(messages, &late);
    EXPECT_EQ(late, in_time ? 0u : 1u);
    EXPECT_EQ(groups.size(), in_time ? 130u : 131u);
    EXPECT_EQ(groups.at(3).messages.size(), in_time ? 2u : 1u);
    if (in_time) continue;
    const auto alone = std::find_if(groups.begin(), groups.end(),
                                    [](const FrameGroup& group) { return !group.frame; });
    ASSERT_NE(alone, groups.end());
    EXPECT_EQ(alone->log_stamp_ns, messages[at].log_stamp_ns);
    EXPECT_EQ(alone->capture_stamp_ns, 0);
    EXPECT_EQ(alone->messages.at(0).capture_stamp_ns, kStart_ns + 3 * kFrame_ns);
  }
}

// When the first message of frame 400 has been read, frames up to 280 have been returned; the
// newest 256 of them are remembered.
TEST_F(FrameGroupsTest, LateMessagesOf256FramesAreRecognized) {
  std::vector<Made> messages;
  const auto stamp_ns = [](std::uint64_t frame) {
    return kStart_ns + std::int64_t(frame) * 1'000'000;
  };
  for (std::uint64_t frame = 0; frame <= 400; ++frame)
    messages.push_back({"a", frame, stamp_ns(frame)});
  messages.push_back({"b", 25, stamp_ns(400), 0, stamp_ns(25)});
  messages.push_back({"b", 24, stamp_ns(400), 0, stamp_ns(24)});
  std::uint64_t late = 0;
  const auto groups = groups_of(messages, &late);
  EXPECT_EQ(late, 1u);
  ASSERT_EQ(groups.size(), 403u);
  EXPECT_FALSE(groups[401].frame);
  EXPECT_EQ(groups[402].frame, 24u) << "taken for another run's frame";
}

// The messages of a frame have stamps within 2 s; those of another run are further away.
TEST_F(FrameGroupsTest, AFrameSpansLessThanTwoSeconds) {
  for (const std::int64_t span_ns : {1'999'999'999, 2'000'000'000}) {
    std::vector<Made> messages = {{"a", 1, kStart_ns + span_ns}, {"b", 1, kStart_ns}};
    EXPECT_EQ(groups_of(messages).size(), span_ns < 2'000'000'000 ? 1u : 2u);
  }
}

TEST_F(FrameGroupsTest, KeyChangesUnreadableMessagesAndOtherTypesBelongToNoFrame) {
  const auto path = folder_.path / "other.mcap";
  {
    RecordingWriter writer(path, "tests", {});
    const mcap::Id framed = writer.add_channel("a", test::kFramedType, test::kFramedIdl, {});
    const std::vector<std::byte> whole = test::framed(1, 1, kStart_ns);
    writer.add(framed, kStart_ns, kStart_ns, whole);
    writer.add(framed, kStart_ns + 1, kStart_ns, std::span(whole).first(4 + 15));
    writer.add(framed, kStart_ns + 2, kStart_ns, std::span(whole).first(4 + 7));
    writer.add(framed, kStart_ns + 3, kStart_ns + 9, KeyChange::unregistered, whole);
    int number = 0;
    for (const char* fields : {"long long frame; long long capture_stamp_ns;",
                               "unsigned long long frame; unsigned long long capture_stamp_ns;",
                               "unsigned long long count; long long capture_stamp_ns;"}) {
      const std::string type = "Other" + std::to_string(++number);
      const mcap::Id other = writer.add_channel(
          "b", type, "struct " + type + " { " + fields + " unsigned long number; };", {});
      writer.add(other, kStart_ns + 3 + number, kStart_ns, test::framed(1, 1, kStart_ns));
    }
  }
  const Recording recording(path);
  FrameGroups groups(recording, recording.messages(), rank_of);
  std::vector<FrameGroup> all;
  while (auto group = groups.next()) all.push_back(std::move(*group));
  ASSERT_EQ(all.size(), 7u);
  EXPECT_EQ(all[0].frame, 1u);
  for (std::size_t i = 1; i < all.size(); ++i) {
    EXPECT_FALSE(all[i].frame) << i;
    EXPECT_EQ(all[i].log_stamp_ns, kStart_ns + std::int64_t(i));
    EXPECT_EQ(all[i].capture_stamp_ns, 0);
    EXPECT_EQ(all[i].messages.size(), 1u);
  }
  EXPECT_EQ(all[3].messages[0].key_change, KeyChange::unregistered);
  EXPECT_EQ(all[3].messages[0].source_stamp_ns, kStart_ns + 9);
  EXPECT_EQ(groups.late(), 0u);
}

// After a restart of capture_node, frame numbers start at 0 again.
TEST_F(FrameGroupsTest, SeparatesRunsWithEqualFrameNumbers) {
  std::vector<Made> messages;
  for (std::int64_t run = 0; run < 2; ++run)
    for (std::uint64_t frame = 0; frame < 5; ++frame)
      for (const char* topic : {"b", "a"})
        messages.push_back(
            {topic, frame,
             kStart_ns + run * FrameGroups::kMaxFrameSpan_ns + std::int64_t(frame) * kFrame_ns});
  std::uint64_t late = 1;
  const auto groups = groups_of(messages, &late);
  EXPECT_EQ(late, 0u);
  ASSERT_EQ(groups.size(), 10u);
  for (std::size_t i = 0; i < 10; ++i) {
    EXPECT_EQ(groups[i].frame, i % 5);
    ASSERT_EQ(groups[i].messages.size(), 2u);
    EXPECT_EQ(groups[i].messages[0].channel->topic, "a");
    EXPECT_EQ(test::number_of(groups[i].messages[1].cdr), 2 * i);
  }
}

}  // namespace
}  // namespace fivepipe::recording
