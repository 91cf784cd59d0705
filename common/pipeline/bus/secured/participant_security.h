// DDS Security of a participant. Internal to bus.
#pragma once
#include <dds/dds.h>

#include "common/pipeline/security/role_files.h"

namespace fivepipe::bus::detail {

// Sets the properties of a participant that joins a secured domain. They apply also if
// CYCLONEDDS_URI replaces the network profile.
void set_security(dds_qos_t* qos, const security::RoleFiles& files);

}  // namespace fivepipe::bus::detail
