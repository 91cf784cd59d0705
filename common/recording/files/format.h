// What fivepipe puts where in an MCAP file: docs/recording.md tells it to others.
//
//   a channel of MCAP     one writer of one topic; its metadata say which, on which node, with
//   which QoS messages              `cdr`, to the byte as on the wire; log time: taken by the
//   recorder; publish time: DDS's source time stamp
//   .. of TOPIC/key_state changes of a key's state (its writer disposed it, or none is left), as
//   KeyState attachments           the deployment's files, under deployment/ metadata `recording`
//   versions, where from; `settings`: the deployment's; `counts`, last: by topic
#pragma once
#include <string>

namespace fivepipe::recording {

inline constexpr const char* kMessageEncoding = "cdr";
inline constexpr const char* kSchemaEncoding = "omgidl";

inline constexpr const char* kKeyStateSuffix = "/key_state";
inline constexpr const char* kKeyStateType = "fivepipe::recording::KeyState";
// key: the key's fields with 4 bytes of header, as DDS hands it out: from Cyclone DDS as CDR 2
// (header 0x0007).
inline constexpr const char* kKeyStateIdl =
    "module fivepipe {\n"
    "  module recording {\n"
    "    enum KeyChange { disposed, unregistered };\n"
    "    @final struct KeyState { KeyChange change; sequence<octet> key; };\n"
    "  };\n"
    "};\n";

inline constexpr const char* kRecordingMetadata = "recording";
inline constexpr const char* kSettingsMetadata = "settings";
// By "TOPIC received", "TOPIC written", "TOPIC lost"; where the writers told it, "TOPIC sent",
// "TOPIC missing" (sent, and never received).
inline constexpr const char* kCountsMetadata = "counts";
inline constexpr const char* kLossReasonKey =
    "loss_reason";  // in `counts`, where anything was lost

inline constexpr const char* kDeploymentFolder = "deployment/";
inline constexpr const char* kDeploymentFileKey =
    "deployment_file";  // in the metadata `recording`: which of them is the deployment

}  // namespace fivepipe::recording
