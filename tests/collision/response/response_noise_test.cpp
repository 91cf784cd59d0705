// Stability of the response under noise in the maps, relative to how far the noise moves the hull.
#include <algorithm>
#include <iostream>

#include "capture_node/segmentation/bit_morphology.h"
#include "tests/support/collision/response.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

constexpr int kTrials = 12;

bool at_border(const hull::ObjectPixels& pixels, int u, int v) {
  for (const auto& [du, dv] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}})
    if (pixels.contains(u + du, v + dv) != pixels.contains(u, v)) return true;
  return false;
}

// Flips each pixel next to the border with this probability: the border moves by at most one pixel.
hull::ObjectPixels jittered(const hull::ObjectPixels& clean, double fraction, Random& random) {
  hull::ObjectPixels noisy = clean;
  for (int v = 1; v + 1 < clean.height_px(); ++v)
    for (int u = 1; u + 1 < clean.width_px(); ++u)
      if (at_border(clean, u, v) && uniform(random, 0, 1) < fraction)
        noisy.set(u, v, !clean.contains(u, v));
  return noisy;
}

hull::ObjectPixels salt_and_pepper(const hull::ObjectPixels& clean, double fraction,
                                   Random& random) {
  hull::ObjectPixels noisy = clean;
  for (int v = 0; v < clean.height_px(); ++v)
    for (int u = 0; u < clean.width_px(); ++u)
      if (uniform(random, 0, 1) < fraction) noisy.set(u, v, !clean.contains(u, v));
  return noisy;
}

class ResponseNoise : public ResponseTest {
 protected:
  // Returns the last exit of the ray from p along v_rec, with the present maps.
  double last_exit_m(const Vector3d& p, const Vector3d& v_rec) const {
    const auto found = query().intervals({p, v_rec}, 0, 0.05);
    return found.empty() ? 0 : found.back().leave;
  }
  // Grows or shrinks the object pixels: the upper bound of noise with this reach.
  static hull::ObjectPixels grown(hull::ObjectPixels pixels, bool larger, int reach_px = 1) {
    if (reach_px > 1) pixels = grown(std::move(pixels), larger, reach_px - 1);
    hull::ObjectPixels result = pixels;
    for (int v = 1; v + 1 < pixels.height_px(); ++v)
      for (int u = 1; u + 1 < pixels.width_px(); ++u)
        if (pixels.contains(u, v) != larger && at_border(pixels, u, v)) result.set(u, v, larger);
    return result;
  }
  std::vector<hull::Silhouette> with(const std::vector<hull::Silhouette>& clean,
                                     const auto& change) const {
    std::vector<hull::Silhouette> changed = clean;
    for (hull::Silhouette& s : changed) s.pixels = change(s.pixels);
    return changed;
  }
  static double lift_m(const collision::Response& response) {
    return (response.clear_distance_m() + response.residual_m) * response.v_rec_world.z();
  }
  struct Jitter {
    double d_rec_m = 0, end_m = 0, normal_deg = 0;
    int recovered = 0, defined = 0;
  };
  // Compares D_rec of the same contact point, and the height of the move of the whole response.
  template <class Noise>
  Jitter measure(const Noise& noise, int reach_px = 1) {
    place(center_m);
    const collision::Response before = respond_by_default();
    EXPECT_EQ(before.status, collision::RecoveryStatus::recovered);
    const auto clean = silhouettes_;
    Jitter worst;
    see(with(clean, [&](const hull::ObjectPixels& p) { return grown(p, false, reach_px); }));
    const double min_m = last_exit_m(before.cp_object_world_m, before.v_rec_world);
    see(with(clean, [&](const hull::ObjectPixels& p) { return grown(p, true, reach_px); }));
    const double max_m = last_exit_m(before.cp_object_world_m, before.v_rec_world);
    bound_m = std::max(max_m - before.d_rec_m, before.d_rec_m - min_m);
    for (int i = 0; i < kTrials; ++i) {
      see(with(clean, noise));
      place(center_m);
      if (!collision_.colliding()) continue;
      collision::ObjectCollision one;
      one.points = {{before.cp_object_world_m, 0}};
      const collision::Response same =
          collision::respond(query(), one, {rp_object_m_, std::nullopt}, requery());
      EXPECT_LE(same.d_rec_m, max_m + 1e-9);
      EXPECT_GE(same.d_rec_m, min_m - 1e-9);
      worst.d_rec_m = std::max(worst.d_rec_m, std::abs(same.d_rec_m - before.d_rec_m));
      const collision::Response after = respond_by_default();
      worst.recovered += after.status == collision::RecoveryStatus::recovered;
      if (!after.has_exit()) continue;
      worst.end_m = std::max(worst.end_m, std::abs(lift_m(after) - lift_m(before)));
      worst.defined += after.closed_form.status == collision::NormalStatus::defined;
      const double turned_rad =
          angle_rad(after.closed_form.normal_world, before.closed_form.normal_world);
      worst.normal_deg = std::max(worst.normal_deg, turned_rad * 180 / std::numbers::pi);
    }
    see(clean);
    std::cout << "D_rec of one point within " << worst.d_rec_m * 1000
              << " mm, the object's end within " << worst.end_m * 1000 << " mm, N_hull within "
              << worst.normal_deg << " degrees; the noise reaches " << bound_m * 1000
              << " mm, a pixel is " << before.pixel_footprint_m * 1000 << " mm; recovered in "
              << worst.recovered << " of " << kTrials << "\n";
    return worst;
  }

  Vector3d center_m{0.001, 0.002, kRealRadius_m + kVirtualRadius_m - 0.006};
  double bound_m = 0;
};

TEST_F(ResponseNoise, OnePixelJitterMovesTheResponseByAtMostItsProjection) {
  Random random(91);
  for (const double fraction : {0.1, 0.5, 1.0}) {
    const Jitter jitter =
        measure([&](const hull::ObjectPixels& clean) { return jittered(clean, fraction, random); });
    EXPECT_EQ(jitter.recovered, kTrials);
    EXPECT_LE(jitter.d_rec_m, bound_m + 1e-9);
    EXPECT_LE(jitter.end_m,
              1.01 * bound_m);  // CP_obj may be another, slightly nearer sample of the contact
  }
}

// The capture node cleans its maps by an opening of one pixel by default, and a closing on request.
TEST_F(ResponseNoise, SaltAndPepperAfterOpenAndCloseMovesTheResponseByAtMostAPixel) {
  Random random(92);
  const auto cleaned = [](const hull::ObjectPixels& p) {
    return capture::closed(capture::opened(p, 1), 1);
  };
  see(with(silhouettes_, cleaned));
  const Jitter jitter = measure([&](const hull::ObjectPixels& clean) {
    return cleaned(salt_and_pepper(clean, 0.01, random));
  });
  EXPECT_EQ(jitter.recovered, kTrials);
  EXPECT_LE(jitter.d_rec_m, bound_m + 1e-9);
  EXPECT_LE(jitter.end_m, bound_m);
}

TEST_F(ResponseNoise, SaltAndPepperAfterOpenMovesTheObjectByLessThanAPixel) {
  Random random(92);
  see(with(silhouettes_, [](const hull::ObjectPixels& p) { return capture::opened(p, 1); }));
  // The opening removes the 3x3 neighbourhood of a missing pixel next to the border.
  const Jitter jitter = measure(
      [&](const hull::ObjectPixels& clean) {
        return capture::opened(salt_and_pepper(clean, 0.01, random), 1);
      },
      3);
  EXPECT_EQ(jitter.recovered, kTrials);
  EXPECT_LE(jitter.d_rec_m, bound_m + 1e-9);
  EXPECT_LE(jitter.end_m, kFootprint_m);
}

TEST_F(ResponseNoise, FlickeringContactMovesTheObjectByAtMostTwoPixels) {
  // At the hull's border the object collides in some frames only. The response then moves it by at
  // most the size of the noise.
  Random random(93);
  const auto clean = silhouettes_;
  see(with(clean, [](const hull::ObjectPixels& p) { return grown(p, true); }));
  // Lowers the virtual ball until it just touches the largest hull.
  center_m.z() = kRealRadius_m + kVirtualRadius_m + 0.004;
  do {
    center_m.z() -= 1e-4;
    place(center_m);
  } while (!collision_.colliding());
  // The diagonal of two pixels: one to either side.
  const double bound = 2 * std::numbers::sqrt2 * kFootprint_m * (1 + kRealRadius_m);
  center_m.z() -= 0.5 * bound;
  int colliding = 0, free = 0;
  double max_m = 0;
  for (int i = 0; i < kTrials; ++i) {
    see(with(clean, [&](const hull::ObjectPixels& p) { return jittered(p, 0.5, random); }));
    place(center_m);
    (collision_.colliding() ? colliding : free) += 1;
    if (!collision_.colliding()) {
      EXPECT_EQ(respond_by_default().status, collision::RecoveryStatus::no_collision_point);
      continue;
    }
    const collision::Response response = respond_by_default();
    EXPECT_EQ(response.status, collision::RecoveryStatus::recovered);
    max_m = std::max(max_m, response.clear_distance_m() + response.residual_m);
  }
  std::cout << "colliding in " << colliding << " frames, free in " << free << ", largest move "
            << max_m * 1000 << " mm\n";
  EXPECT_GT(colliding, 0);
  EXPECT_LE(max_m, bound);
}

}  // namespace
}  // namespace fivepipe::test
