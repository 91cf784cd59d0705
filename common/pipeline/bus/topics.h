// The only place that lists each topic with its name, type and delivery.
#pragma once
#include <span>

#include "fivepipe.h"

namespace fivepipe::bus::topics {

// Every topic is reliable. The history lengths are in bus.cpp.
// stream: a short history per key, for readers that exist at the write.
// latched: the newest sample per key, also for readers that join later.
// event: a longer history per key, so that a burst of small messages overwrites none.
enum class Delivery { stream, latched, event };

// The order is that in which the nodes write the messages of a frame. A replay sends the topics in
// this order, so the message that completes a node's inputs follows its other inputs.
#define FIVEPIPE_TOPICS(TOPIC)   \
  TOPIC(ReplaySession, latched)  \
  TOPIC(CameraInfo, latched)     \
  TOPIC(ViewInfo, latched)       \
  TOPIC(Command, event)          \
  TOPIC(HeadPose, stream)        \
  TOPIC(ObjectColour, stream)    \
  TOPIC(ObjectPixelMap, stream)  \
  TOPIC(CollisionResult, stream) \
  TOPIC(VirtualState, stream)    \
  TOPIC(HullComponents, stream)  \
  TOPIC(TileCosts, event)        \
  TOPIC(HullTile, stream)        \
  TOPIC(FrameComposited, event)  \
  TOPIC(FrameTrace, event)       \
  TOPIC(NodeStatus, event)

#define FIVEPIPE_TOPIC(NAME, DELIVERY)                                                      \
  struct NAME {                                                                             \
    using Message = fivepipe_v1_##NAME;                                                     \
    static constexpr const char* name = "fivepipe/v1/" #NAME;                               \
    static constexpr const char* type = "fivepipe::v1::" #NAME;                             \
    static constexpr const dds_topic_descriptor_t* descriptor = &fivepipe_v1_##NAME##_desc; \
    static constexpr Delivery delivery = Delivery::DELIVERY;                                \
  };
FIVEPIPE_TOPICS(FIVEPIPE_TOPIC)
#undef FIVEPIPE_TOPIC

// Description of a topic, for programs that select topics by name.
struct Topic {
  const char *name, *type;
  const dds_topic_descriptor_t* descriptor;
  Delivery delivery;
};
// Returns all topics in the order above. The span is valid until the program ends.
inline std::span<const Topic> all() {
#define FIVEPIPE_TOPIC(NAME, DELIVERY) \
  Topic{NAME::name, NAME::type, NAME::descriptor, NAME::delivery},
  static const Topic topics[] = {FIVEPIPE_TOPICS(FIVEPIPE_TOPIC)};
#undef FIVEPIPE_TOPIC
  return topics;
}

#undef FIVEPIPE_TOPICS

}  // namespace fivepipe::bus::topics
