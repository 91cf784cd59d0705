#include "common/base/process/optional_module.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace fivepipe::base {
namespace {

TEST(OptionalModule, ErrorStatesWhatToInstall) {
  const OptionalModule absent{"fivepipe_absent.so", "Aravis", "libaravis-dev"};
  EXPECT_FALSE(exists(absent));
  try {
    function_of(absent, "fivepipe_absent_function");
    FAIL() << "no exception";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "this build has no Aravis: install libaravis-dev and build again");
  }
}

}  // namespace
}  // namespace fivepipe::base
