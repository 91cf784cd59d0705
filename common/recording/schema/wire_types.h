// The message types of this build: idl/fivepipe.idl, embedded at compile time.
#pragma once
#include <string>
#include <string_view>

#include "common/recording/schema/idl.h"

namespace fivepipe::schema {

const Idl& fivepipe_idl();  // parsed at the first call
// Self-contained IDL of a type such as "fivepipe::v1::HullTile". Throws IdlError.
std::string fivepipe_schema(std::string_view scoped_name);

}  // namespace fivepipe::schema
