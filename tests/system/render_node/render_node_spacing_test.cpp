// The keys in the window of a real render_node move parts of the scene.
#include "tests/support/optional_package.h"
#include "tests/support/virtual_display.h"
#include "tests/system/render_node/render_node_fixture.h"

namespace fivepipe::test {
namespace {

struct Requested {
  std::string object;
  double spacing_m;
};

TEST_F(RenderNode, KeysInItsWindowRequestSpacings) {
  const VirtualDisplay display;
  if (display.display().empty()) FIVEPIPE_SKIP_WITHOUT_PACKAGE("Xvfb is not installed");
  scene_ = replaced(kScene, "{name: touched,",
                    "{name: touched, spacing: {axis: [1, 0, 0], at_m: 0.1, range_m: [0, 0.2]},");
  auto spacings = bus_.writer<bus::topics::ObjectSpacing>();
  Collected<bus::topics::SpacingRequest, Requested> requests{
      bus_, [](const bus::Sample<bus::topics::SpacingRequest>& sample) {
        return Requested{sample->object, sample->spacing_m};
      }};
  start_with(", video: false, window: true", false);
  wait_for_readers(spacings);
  ASSERT_TRUE(holds([&] { return requests.writers() > 0; })) << said();
  fivepipe_v1_ObjectSpacing spacing{};
  messages::set_text(spacing.object, "touched");
  spacing.spacing_m = 0.15;
  deliver(spacings, spacing);
  Keyboard keyboard;
  // Several times, because the node may take the first key before the spacing.
  ASSERT_TRUE(holds([&] {
    if (requests.take().empty()) keyboard.send(Keyboard::kPress, 0xff54);  // XK_Down
    return !requests.all().empty();
  })) << said();
  EXPECT_EQ(requests.all().front().object, "touched");
  EXPECT_NEAR(requests.all().front().spacing_m, 0.145, 1e-12);
  EXPECT_EQ(ended().drops, (std::map<std::string, std::uint64_t>{}));
}

}  // namespace
}  // namespace fivepipe::test
