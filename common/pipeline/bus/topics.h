// Every topic: its name, type and delivery, once.
#pragma once
#include <span>

#include "fivepipe.h"

namespace fivepipe::bus::topics {

// All reliable. stream: the newest few per key, for who is there when it is written. latched: the
// newest one per key, also for who joins later. event: a longer history, for small messages of
// which none may be overwritten by a burst.
enum class Delivery { stream, latched, event };

// In the order in which a frame's messages are made: what a node needs of a frame stands before
// what it waits for.
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

// For who handles topics by name.
struct Topic {
  const char *name, *type;
  const dds_topic_descriptor_t* descriptor;
  Delivery delivery;
};
inline std::span<const Topic> all() {
#define FIVEPIPE_TOPIC(NAME, DELIVERY) \
  Topic{NAME::name, NAME::type, NAME::descriptor, NAME::delivery},
  static const Topic topics[] = {FIVEPIPE_TOPICS(FIVEPIPE_TOPIC)};
#undef FIVEPIPE_TOPIC
  return topics;
}

#undef FIVEPIPE_TOPICS

}  // namespace fivepipe::bus::topics
