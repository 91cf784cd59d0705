#include "launch/supervise/spacing/spacing_pipe.h"

#include <gtest/gtest.h>

#include "common/pipeline/messages/wire_conversions.h"
#include "tests/support/process.h"
#include "tests/support/test_domain.h"

namespace fivepipe::launch {
namespace {

using namespace std::chrono_literals;

fivepipe_v1_ObjectSpacing message_of(const std::string& object, double spacing_m, bool requested) {
  fivepipe_v1_ObjectSpacing message{};
  messages::set_text(message.object, object);
  message.spacing_m = spacing_m;
  message.requested = requested;
  return message;
}

// A sim_node that this process did not start has lost the spacing.
TEST(SpacingPipe, RequestsALostSpacingAndKnowsTheNewest) {
  config::Scene scene;
  scene.objects.resize(2);
  scene.objects[0].name = "part";
  scene.objects[0].spacing = config::Spacing{.low_m = 0, .high_m = 0.5};
  scene.objects[1].name = "still";
  bus::Bus bus({test::own_domain()});
  auto spacings = bus.writer<bus::topics::ObjectSpacing>();
  auto requests = bus.reader<bus::topics::SpacingRequest>();
  SpacingPipe pipe(bus, scene);
  ASSERT_TRUE(test::eventually(bus, 10s, [&] { return spacings.readers() == 1; }));
  for (const auto& message :
       {message_of("part", 0.4, true), message_of("part", 0.6, true), message_of("still", 1, true),
        message_of("unknown", 1, true), message_of("part", 0.1, false)}) {
    spacings.write(message);
    ASSERT_TRUE(spacings.wait_for_delivery(10s));
  }
  std::string object;
  double spacing_m = 0;
  EXPECT_TRUE(test::eventually(bus, 10s, [&] {
    pipe.step();
    for (const auto& sample : requests.take()) {
      object = sample->object;
      spacing_m = sample->spacing_m;
    }
    return !object.empty();
  }));
  EXPECT_EQ(object, "part");
  EXPECT_EQ(spacing_m, 0.4);
  EXPECT_EQ(pipe.for_start(), (std::map<std::string, double>{{"part", 0.4}}));
}

}  // namespace
}  // namespace fivepipe::launch
