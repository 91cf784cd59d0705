#include <gtest/gtest.h>

#include "common/schema/idl.h"
#include "common/schema/wire_types.h"

namespace fivepipe::schema {
namespace {

TEST(SchemaIdl, EveryStructOfThisBuildIsWrittenSelfContained) {
  for (const Struct& type : fivepipe_idl().structs) {
    const std::string text = fivepipe_schema(type.name);
    const Idl parsed = parse_idl(text);
    EXPECT_EQ(difference(parsed, fivepipe_idl(), type.name), "");
    EXPECT_EQ(self_contained(parsed, type.name), text);
    EXPECT_EQ(parsed.structs.back().name, type.name);
  }
}

}  // namespace
}  // namespace fivepipe::schema
