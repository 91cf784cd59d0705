#include "common/recording/files/frame_groups.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "tests/support/recording/synthetic_recordings.h"

namespace fivepipe::recording {
namespace {

constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000, kFrame_ns = 16'000'000;

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
    for (const char* topic : {"a", "b", "b", "b", "c"})
      placed.push_back(
          {100 * (frame + random() % spread) + random() % 100, {topic, 50 + frame, 0}});
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
  constexpr std::uint64_t kFrames = FrameGroups::kReorderWindow_frames + 40;
  std::vector<Made> messages;
  for (std::uint64_t frame = 0; frame < kFrames; ++frame)
    for (const char* topic : {"a", "b"})
      messages.push_back({topic, frame, kStart_ns + std::int64_t(frame) * kFrame_ns});
  const std::size_t at = 2 * (3 + FrameGroups::kReorderWindow_frames + 2);
  messages.insert(messages.begin() + std::ptrdiff_t(at),
                  {"c", 3, messages[at].log_stamp_ns, 0, kStart_ns + 3 * kFrame_ns});
  std::uint64_t late = 0;
  const auto groups = groups_of(messages, &late);
  EXPECT_EQ(late, 1u);
  EXPECT_EQ(groups.size(), kFrames + 1);
  const auto alone = std::find_if(groups.begin(), groups.end(),
                                  [](const FrameGroup& group) { return !group.frame; });
  ASSERT_NE(alone, groups.end());
  EXPECT_EQ(alone->messages.at(0).channel->topic, "c");
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
