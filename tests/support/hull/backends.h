// The depth backends of the hull behind one interface, and their comparison with the reference.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "common/hull/gl/gl_hull.h"
#include "common/hull/oracle/reference.h"
#include "common/hull/paper/plane_sweep.h"
#include "tests/support/checked_gl_context.h"
#include "tests/support/hull/scenes.h"

namespace fivepipe::test {

// Returns the depth of one rect by a backend that accepts a list of rects. The plane sweep also
// needs its range.
template <class Backend, class... Range>
hull::DepthTile depth_of(Backend& backend, const hull::PixelRect& rect, const hull::View& view,
                         const Range&... range) {
  return std::move(backend.depth(view, range..., std::span(&rect, 1)).front());
}

// Pieces of the hull along a ray that are shorter than this result from rounding in double at pixel
// borders. A backend may find them or not.
inline constexpr double kTie_m = 1e-9;

// Bound of the difference between a backend's depth and the reference.
struct DepthTolerance {
  double absolute_m = 0, relative = 0;
  bool near(float depth_m, double reference_m) const {
    return std::abs(depth_m - reference_m) <= absolute_m + relative * reference_m;
  }
};
inline constexpr DepthTolerance kCpuTolerance{1e-6, 0};  // a float near 1 m has a unit of 6e-8 m
inline constexpr DepthTolerance kGlTolerance{0, 2e-6};   // rounding of float is 6e-8

// Succeeds if the ray hits in both, at the same depth, or misses in both.
inline ::testing::AssertionResult agree(float depth_m, const std::vector<hull::Interval>& reference,
                                        const DepthTolerance& tolerance) {
  auto first = reference.begin();
  for (; first != reference.end() && first->leave - first->enter <= kTie_m; ++first)
    if (depth_m != hull::kNoHull && tolerance.near(depth_m, first->enter))
      return ::testing::AssertionSuccess();
  if (first == reference.end() ? depth_m == hull::kNoHull : tolerance.near(depth_m, first->enter))
    return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure()
         << "depth " << depth_m << " m, reference "
         << (first == reference.end() ? std::string("none") : std::to_string(first->enter));
}

inline bool no_hull(const hull::DepthTile& tile) {
  return std::all_of(tile.depth_m.begin(), tile.depth_m.end(),
                     [](float d) { return d == hull::kNoHull; });
}

// Compares every step-th ray of the view with the reference. Returns the number of hits.
inline int expect_reference(const hull::DepthTile& tile,
                            std::span<const hull::Silhouette> silhouettes, const hull::View& view,
                            const DepthTolerance& tolerance, int step = 1,
                            const hull::HullRule& rule = {}) {
  int hits = 0;
  for (int i = 0; i < int(tile.rect.area_px()); i += step) {
    const int u = i % tile.rect.width_px(), v = i / tile.rect.width_px();
    const geometry::Ray ray = geometry::ray_through(view.camera, Eigen::Vector2d(u, v));
    EXPECT_TRUE(agree(tile.depth_m[std::size_t(i)],
                      hull::reference_intervals(silhouettes, ray, view.near_m, view.far_m, rule),
                      tolerance))
        << "ray " << u << ", " << v;
    hits += tile.depth_m[std::size_t(i)] != hull::kNoHull;
  }
  return hits;
}

// One backend. Call set_silhouettes() before depth().
struct HullBackend {
  virtual ~HullBackend() = default;
  void set_silhouettes(std::span<const hull::Silhouette> silhouettes) { set(silhouettes, {}); }
  virtual void set(std::span<const hull::Silhouette> silhouettes, const hull::HullRule& rule) = 0;
  virtual std::vector<hull::DepthTile> depth(const hull::View& view,
                                             std::span<const hull::PixelRect> rects) = 0;
  virtual DepthTolerance tolerance() const { return {}; }
};

struct CpuBackend : HullBackend {
  base::WorkerPool pool{2};
  hull::CpuHull hull{pool};
  void set(std::span<const hull::Silhouette> silhouettes, const hull::HullRule& rule) override {
    hull.assign(silhouettes, rule);
  }
  std::vector<hull::DepthTile> depth(const hull::View& view,
                                     std::span<const hull::PixelRect> rects) override {
    std::vector<hull::DepthTile> tiles;
    for (const hull::PixelRect& rect : rects) tiles.push_back(hull.depth(view, rect));
    return tiles;
  }
  DepthTolerance tolerance() const override { return kCpuTolerance; }
};

struct GlBackend : HullBackend {
  hull::GlHull hull;
  void set(std::span<const hull::Silhouette> silhouettes, const hull::HullRule& rule) override {
    hull.set_silhouettes(silhouettes, rule);
  }
  std::vector<hull::DepthTile> depth(const hull::View& view,
                                     std::span<const hull::PixelRect> rects) override {
    return hull.depth(view, rects);
  }
  DepthTolerance tolerance() const override { return kGlTolerance; }
};

// Sweeps the view's whole range with 64 planes.
struct SweepBackend : HullBackend {
  std::vector<hull::Silhouette> silhouettes;
  hull::HullRule rule;
  void set(std::span<const hull::Silhouette> s, const hull::HullRule& r) override {
    silhouettes.assign(s.begin(), s.end());
    rule = r;
  }
  std::vector<hull::DepthTile> depth(const hull::View& view,
                                     std::span<const hull::PixelRect> rects) override {
    hull::PlaneSweep sweep(view.camera.pinhole.width_px, view.camera.pinhole.height_px, 64);
    sweep.set_silhouettes(silhouettes, rule);
    return sweep.depth(view, {view.near_m, view.far_m}, rects);
  }
};

// Backends by name. They and their OpenGL context live until TearDown(), because compiling the
// shaders takes longer than most cases.
class HullBackends : public ::testing::Environment {
 public:
  HullBackend& get(const std::string& name) {
    if (name != "cpu" && !context_) context_ = std::make_unique<gl::GlContext>();
    std::unique_ptr<HullBackend>& backend = name == "cpu" ? cpu_ : name == "gl" ? gl_ : sweep_;
    if (!backend && name == "cpu") backend = std::make_unique<CpuBackend>();
    if (!backend && name == "gl") backend = std::make_unique<GlBackend>();
    if (!backend) backend = std::make_unique<SweepBackend>();
    return *backend;
  }
  void check_errors() const {
    if (context_) expect_no_gl_error();
  }
  void TearDown() override {
    sweep_.reset();
    gl_.reset();
    context_.reset();
  }

 private:
  std::unique_ptr<gl::GlContext> context_;
  std::unique_ptr<HullBackend> cpu_, gl_, sweep_;
};
inline HullBackends* const backends =
    static_cast<HullBackends*>(::testing::AddGlobalTestEnvironment(new HullBackends));

// A test for each backend named by its parameter.
struct ForHullBackends : ::testing::TestWithParam<const char*> {
  void TearDown() override { backends->check_errors(); }
  HullBackend& backend() { return backends->get(GetParam()); }
  hull::DepthTile depth(std::span<const hull::Silhouette> silhouettes, const hull::View& view) {
    backend().set_silhouettes(silhouettes);
    return depth_of(backend(), whole_image(view.camera), view);
  }
  int expect_reference(std::span<const hull::Silhouette> silhouettes, const hull::View& view,
                       int step = 1) {
    return test::expect_reference(depth(silhouettes, view), silhouettes, view,
                                  backend().tolerance(), step);
  }
};
inline std::string backend_name(const ::testing::TestParamInfo<const char*>& info) {
  return info.param;
}

}  // namespace fivepipe::test
