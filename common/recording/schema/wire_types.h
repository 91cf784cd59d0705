// The message types of this build: idl/fivepipe.idl, embedded when it was compiled.
#pragma once
#include <string>
#include <string_view>

#include "common/recording/schema/idl.h"

namespace fivepipe::schema {

const Idl& fivepipe_idl();                                  // parsed once
std::string fivepipe_schema(std::string_view scoped_name);  // "fivepipe::v1::HullTile": its
                                                            // self-contained IDL; throws IdlError

}  // namespace fivepipe::schema
