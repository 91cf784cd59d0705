// The error of shadow edges, with a shadow in another place.
#include "benchmarks/render/errors/shadow_error.h"

#include "tests/benchmarks/render/small_view.h"

namespace fivepipe::render_bench {
namespace {

namespace plate = render::plate_shadow;

class ShadowError : public SmallView {};

TEST_F(ShadowError, IsBelowAPixelOfTheShadowMapForAnObject) {
  const ShadowErrors errors = shadow_errors(viewer_);
  EXPECT_LT(errors.of_object.mean_px, 0.6 * plate::map_pixel_px(image_.pinhole));
  EXPECT_LT(errors.of_object.worst_px, 3);
  EXPECT_LT(errors.of_hull.mean_px, 2);
  EXPECT_GT(errors.of_hull.mean_px, 0);
}

// A hull that is moved along x displaces two of the four edges.
TEST_F(ShadowError, OfAShadowInAnotherPlaceIsItsDisplacement) {
  const double moved_m = 0.04,
               grown = (plate::kWall_m - plate::kLight_m.y()) /
                       (plate::kOccluder_m - plate::kLight_m.y()),
               moved_px = moved_m * grown * image_.pinhole.fx_px / plate::kWall_m;
  const ShadowErrors errors = shadow_errors(viewer_, {moved_m, 0, 0});
  EXPECT_NEAR(errors.of_hull.worst_px, moved_px, 1.5);
  EXPECT_NEAR(errors.of_hull.mean_px, 0.5 * moved_px, 1);
  EXPECT_LT(errors.of_object.worst_px, 3);
}

}  // namespace
}  // namespace fivepipe::render_bench
