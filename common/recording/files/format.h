// How a fivepipe recording uses MCAP; docs/recording.md documents it for other readers.
//
//   channel           one writer of one topic; metadata: its node, GUIDs and QoS
//   message           `cdr`, the bytes of the wire; log time: when the recorder took it; publish
//                     time: DDS's source timestamp
//   TOPIC/key_state   channel of key changes (disposed, or no writer left), type KeyState
//   attachments       the deployment's files, under deployment/
//   metadata          `recording`: versions and machine; `settings`: the deployment's settings;
//                     `counts_so_far`, every 2 s: message counts by topic; `counts`, written last
#pragma once
#include <string>

namespace fivepipe::recording {

inline constexpr const char* kMessageEncoding = "cdr";
inline constexpr const char* kSchemaEncoding = "omgidl";

inline constexpr const char* kKeyStateSuffix = "/key_state";
inline constexpr const char* kKeyStateType = "fivepipe::recording::KeyState";
// key: the key fields after a 4-byte header, as DDS returns them; Cyclone DDS uses CDR 2 (header
// 0x0007).
inline constexpr const char* kKeyStateIdl =
    "module fivepipe {\n"
    "  module recording {\n"
    "    enum KeyChange { disposed, unregistered };\n"
    "    @final struct KeyState { KeyChange change; sequence<octet> key; };\n"
    "  };\n"
    "};\n";

inline constexpr const char* kRecordingMetadata = "recording";
inline constexpr const char* kSettingsMetadata = "settings";
// Keys: "TOPIC received", "TOPIC written", "TOPIC lost"; if the writers publish send counts, also
// "TOPIC sent" and "TOPIC missing" (sent but never received).
inline constexpr const char* kCountsMetadata = "counts";
// The same keys, and kCountsStampKey. The newest of these records states the losses of a
// recording that was cut off.
inline constexpr const char* kCountsSoFarMetadata = "counts_so_far";
inline constexpr const char* kCountsStampKey = "stamp_ns";    // CLOCK_REALTIME
inline constexpr const char* kLossReasonKey = "loss_reason";  // in `counts`, if messages were lost

inline constexpr const char* kDeploymentFolder = "deployment/";
// Key in the metadata `recording`: path of the deployment file below kDeploymentFolder.
inline constexpr const char* kDeploymentFileKey = "deployment_file";

}  // namespace fivepipe::recording
