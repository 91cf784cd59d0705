#include "launch/study/recorded/recorded_spacings.h"

#include <algorithm>
#include <cmath>

#include "common/base/realtime.h"
#include "common/pipeline/bus/topics.h"
#include "common/recording/schema/cdr_cursor.h"

namespace fivepipe::study {
namespace {

// Bound of ObjectSpacing.object.
constexpr std::uint32_t kMaxName = 64;

void add_spacing(std::span<const std::byte> cdr, const std::string& part, std::int64_t start_ns,
                 std::vector<RecordedSpacing>& spacings) {
  schema::CdrCursor cursor(cdr);
  if (cursor.take_string(kMaxName) != part) return;
  cursor.take<std::uint64_t>();  // frame
  const auto stamp_ns = cursor.take<std::int64_t>();
  const auto spacing_m = cursor.take<double>();
  if (std::isfinite(spacing_m))
    spacings.push_back({std::max(0.0, base::difference_s(stamp_ns, start_ns)), spacing_m});
}

}  // namespace

std::vector<RecordedSpacing> recorded_spacings(const recording::Recording& recording,
                                               const std::string& part) {
  std::set<mcap::Id> channels;
  for (const recording::RecordedChannel& channel : recording.channels())
    if (channel.topic == bus::topics::ObjectSpacing::name && !channel.key_states)
      channels.insert(channel.id);
  std::vector<RecordedSpacing> spacings;
  if (channels.empty() || !recording.type_differences(channels).empty()) return spacings;
  auto messages = recording.messages(recording.start_ns(), recording.end_ns(), channels);
  for (;;) try {
      const auto message = messages.next();
      if (!message) return spacings;
      if (!message->key_change) add_spacing(message->cdr, part, recording.start_ns(), spacings);
    } catch (const mcap::McapError&) {  // RecordedFrames reports damaged chunks
    } catch (const schema::CdrFault&) {
    }
}

}  // namespace fivepipe::study
