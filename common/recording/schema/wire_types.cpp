#include "common/recording/schema/wire_types.h"

#include "common/recording/schema/embedded_idl.h"

namespace fivepipe::schema {

const Idl& fivepipe_idl() {
  static const Idl idl = parse_idl(kFivepipeIdl);
  return idl;
}

std::string fivepipe_schema(std::string_view scoped_name) {
  return self_contained(fivepipe_idl(), scoped_name);
}

}  // namespace fivepipe::schema
