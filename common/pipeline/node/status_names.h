// Names of counts and latencies in NodeStatus that other programs read.
#pragma once

namespace fivepipe::node {

// Counts.
inline constexpr const char* kFramesCaptured = "frames_captured";
inline constexpr const char* kFrameSetsComplete = "frame_sets_complete";
inline constexpr const char* kFramesComposited = "frames_composited";
inline constexpr const char* kSpectatorFrames = "spectator_frames";  // composited for a spectator

// CPU time [us] of the process since its first frame; of it, capture_node's part for finding object
// pixels and cutting out colours, and for publishing. The rest of capture_node's reads images.
inline constexpr const char* kFramesCpu = "cpu_us_frames";
inline constexpr const char* kSegmentationCpu = "cpu_us_segmentation";
inline constexpr const char* kPublishingCpu = "cpu_us_publishing";

// Begins the name of a count: messages that the node refused, by the process that sent them.
// NodeStatus truncates the name to 64 characters, so that 24 remain for the host with every number
// of a process: equal numbers on hosts with names that begin with the same 24 count together.
inline constexpr const char* kRefusedFrom = "refused from ";

// Subject of the diagnostic about a node's preparation before its first frame.
inline constexpr const char* kStart = "start";

// Latencies.
inline constexpr const char* kCaptureToPublished = "capture_to_published";
inline constexpr const char* kCaptureToComposite = "capture_to_composite";
inline constexpr const char* kCaptureToSpectator = "capture_to_spectator";
// Ends the name of a latency between two hosts whose clocks are not compared.
inline constexpr const char* kNotCompared = " (clocks not compared)";
// From the first tile of a frame to its composite. During a replay it replaces the latency since
// the capture, which was long ago.
inline constexpr const char* kArrivalToComposite = "arrival_to_composite";

}  // namespace fivepipe::node
