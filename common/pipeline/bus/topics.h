// The only place that lists each topic with its name, type, delivery and maximum keys.
#pragma once
#include <cstdint>
#include <span>

#include "fivepipe.h"

namespace fivepipe::bus::topics {

// Every topic is reliable. The history lengths are in bus.cpp.
// stream: a short history per key, for readers that exist at the write.
// latched: the newest sample per key, also for readers that join later.
// event: a longer history per key, so that a burst of small messages overwrites none.
enum class Delivery { stream, latched, event };

// A reader accepts at most this many keys from one writer (key_limit.h): more than a deployment has
// cameras, objects, viewers and nodes. HullTile has a key for each tile of a view.
inline constexpr std::uint32_t kMaxKeys = 1024, kMaxTiles = 4096;

// Columns: name, delivery, maximum keys. The order is that in which the nodes write the messages of
// a frame. A replay sends the topics in this order, so the message that completes a node's inputs
// follows its other inputs.
#define FIVEPIPE_TOPICS(TOPIC)               \
  TOPIC(ReplaySession, latched, kMaxKeys)    \
  TOPIC(CameraInfo, latched, kMaxKeys)       \
  TOPIC(ViewInfo, latched, kMaxKeys)         \
  TOPIC(Command, event, kMaxKeys)            \
  TOPIC(SpacingRequest, event, kMaxKeys)     \
  TOPIC(ObjectSpacing, latched, kMaxKeys)    \
  TOPIC(HeadPose, stream, kMaxKeys)          \
  TOPIC(ObjectColour, stream, kMaxKeys)      \
  TOPIC(ObjectCoverage, stream, kMaxKeys)    \
  TOPIC(ObjectPixelMap, stream, kMaxKeys)    \
  TOPIC(CollisionResult, stream, kMaxKeys)   \
  TOPIC(Particles, stream, kMaxKeys)         \
  TOPIC(VirtualState, stream, kMaxKeys)      \
  TOPIC(HullComponents, stream, kMaxKeys)    \
  TOPIC(SimulationMetrics, stream, kMaxKeys) \
  TOPIC(TileCosts, event, kMaxKeys)          \
  TOPIC(HullTile, stream, kMaxTiles)         \
  TOPIC(FrameComposited, event, kMaxKeys)    \
  TOPIC(FrameTrace, event, kMaxKeys)         \
  TOPIC(HostStatus, event, kMaxKeys)         \
  TOPIC(NodeStatus, event, kMaxKeys)

#define FIVEPIPE_TOPIC(NAME, DELIVERY, MAX_KEYS)                                            \
  struct NAME {                                                                             \
    using Message = fivepipe_v1_##NAME;                                                     \
    static constexpr const char* name = "fivepipe/v1/" #NAME;                               \
    static constexpr const char* type = "fivepipe::v1::" #NAME;                             \
    static constexpr const dds_topic_descriptor_t* descriptor = &fivepipe_v1_##NAME##_desc; \
    static constexpr Delivery delivery = Delivery::DELIVERY;                                \
    static constexpr std::uint32_t max_keys = MAX_KEYS;                                     \
  };
FIVEPIPE_TOPICS(FIVEPIPE_TOPIC)
#undef FIVEPIPE_TOPIC

// Description of a topic, for programs that select topics by name.
struct Topic {
  const char *name, *type;
  const dds_topic_descriptor_t* descriptor;
  Delivery delivery;
  std::uint32_t max_keys;
};
template <class T>
Topic described() {
  return {T::name, T::type, T::descriptor, T::delivery, T::max_keys};
}
// Returns all topics in the order above. The span is valid until the program ends.
inline std::span<const Topic> all() {
#define FIVEPIPE_TOPIC(NAME, DELIVERY, MAX_KEYS) described<NAME>(),
  static const Topic topics[] = {FIVEPIPE_TOPICS(FIVEPIPE_TOPIC)};
#undef FIVEPIPE_TOPIC
  return topics;
}

#undef FIVEPIPE_TOPICS

}  // namespace fivepipe::bus::topics
