// Every topic: its name, type and delivery, once.
#pragma once
#include "fivepipe.h"

namespace fivepipe::topics {

// All reliable. stream: the newest few per key, for who is there when it is written. latched: the newest one per key, also for
// who joins later. event: a longer history, for small messages of which none may be overwritten by a burst.
enum class Delivery { stream, latched, event };

#define FIVEPIPE_TOPIC(NAME, DELIVERY)                                                             \
  struct NAME {                                                                                    \
    using Message = fivepipe_v1_##NAME;                                                            \
    static constexpr const char* name = "fivepipe/v1/" #NAME;                                      \
    static constexpr const dds_topic_descriptor_t* descriptor = &fivepipe_v1_##NAME##_desc;        \
    static constexpr Delivery delivery = Delivery::DELIVERY;                                       \
  }

FIVEPIPE_TOPIC(CameraInfo, latched);
FIVEPIPE_TOPIC(ObjectPixelMap, stream);
FIVEPIPE_TOPIC(ObjectColour, stream);
FIVEPIPE_TOPIC(ViewInfo, latched);
FIVEPIPE_TOPIC(HeadPose, stream);
FIVEPIPE_TOPIC(HullTile, stream);
FIVEPIPE_TOPIC(TileCosts, event);
FIVEPIPE_TOPIC(VirtualState, stream);
FIVEPIPE_TOPIC(CollisionResult, stream);
FIVEPIPE_TOPIC(HullParts, stream);
FIVEPIPE_TOPIC(FrameComposited, event);
FIVEPIPE_TOPIC(FrameTrace, event);
FIVEPIPE_TOPIC(ReplaySession, latched);
FIVEPIPE_TOPIC(Command, event);
FIVEPIPE_TOPIC(NodeStatus, event);

#undef FIVEPIPE_TOPIC

}  // namespace fivepipe::topics
