#include "benchmarks/collision/paper_model_fits.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <iostream>
#include <numbers>
#include <random>

#include "benchmarks/collision/baselines/brute_force.h"
#include "benchmarks/collision/methods.h"
#include "common/base/timing.h"
#include "common/collision/detection/paper/paper_detection.h"
#include "common/collision/response/response.h"

namespace fivepipe::collision_bench {
namespace {

using Eigen::Vector3d;

constexpr int kWindow_px = 400;
constexpr int kViewports_px[] = {5, 10, 20, 40};

struct Measurement {
  Eigen::VectorXd terms;
  double ms;
};

double best_ms(int runs, const std::function<void()>& work) {
  work();
  double best = timed_ms(work);
  for (int i = 1; i < runs; ++i) best = std::min(best, timed_ms(work));
  return best;
}

// Returns the least-squares fit of the relative residuals. While a coefficient is negative, the fit
// drops the term with the smallest one and repeats.
Eigen::VectorXd fitted(const std::vector<Measurement>& measured) {
  const Eigen::Index terms = measured.front().terms.size();
  std::vector<Eigen::Index> kept;
  for (Eigen::Index t = 0; t < terms; ++t) kept.push_back(t);
  Eigen::VectorXd coefficients = Eigen::VectorXd::Zero(terms);
  while (!kept.empty()) {
    Eigen::MatrixXd a(Eigen::Index(measured.size()), Eigen::Index(kept.size()));
    for (std::size_t i = 0; i < measured.size(); ++i)
      for (std::size_t k = 0; k < kept.size(); ++k)
        a(Eigen::Index(i), Eigen::Index(k)) = measured[i].terms[kept[k]] / measured[i].ms;
    const Eigen::VectorXd x = a.colPivHouseholderQr().solve(Eigen::VectorXd::Ones(a.rows()));
    Eigen::Index min = 0;
    if (x.minCoeff(&min) >= 0) {
      for (std::size_t k = 0; k < kept.size(); ++k) coefficients[kept[k]] = x[Eigen::Index(k)];
      break;
    }
    kept.erase(kept.begin() + min);
  }
  return coefficients;
}

std::vector<double> residuals(const std::vector<Measurement>& measured,
                              const Eigen::VectorXd& coefficients) {
  std::vector<double> off;
  for (const Measurement& m : measured)
    off.push_back(std::abs(m.terms.dot(coefficients) / m.ms - 1));
  return off;
}

// The terms are n m, n m u u / 2, the pixels read back, the points found, and 1.
std::vector<Measurement> measured_cost(const CollisionScene& scene, bool quick) {
  std::vector<Measurement> measured;
  for (const int viewport_px : kViewports_px) {
    collision::TriangleVolumeQuery query(kWindow_px, viewport_px);
    for (const std::size_t cameras : {1, 2, 3}) {
      query.set_silhouettes(std::span(scene.silhouettes).first(cameras));
      for (const std::size_t m :
           quick ? std::vector<std::size_t>{180, 720} : std::vector<std::size_t>{180, 720, 2880}) {
        std::vector<collision::Triangle> triangles;
        while (triangles.size() < m)
          triangles.push_back(
              scene.objects_world_m[0][triangles.size() % scene.objects_world_m[0].size()]);
        std::size_t points = 0;
        const double ms =
            best_ms(quick ? 2 : 9, [&] { points = query.query(triangles).points.size(); });
        const double rows = std::ceil(double(m) / (kWindow_px / viewport_px)),
                     nm = double(cameras * m);
        measured.push_back(
            {Eigen::Vector<double, 5>(nm, 0.5 * nm * viewport_px * viewport_px,
                                      rows * viewport_px * kWindow_px, double(points), 1),
             ms});
      }
    }
  }
  return measured;
}

CostFit fit_cost(std::vector<Measurement> measured, Eigen::Index terms) {
  for (Measurement& m : measured) m.terms = m.terms.head(terms).eval();
  const Eigen::VectorXd x = fitted(measured);
  Eigen::VectorXd all = Eigen::VectorXd::Zero(5);
  all.head(terms) = x;
  const auto off = residuals(measured, x);
  return {1e6 * all[0],
          1e6 * all[1],
          1e6 * all[2],
          1e6 * all[3],
          all[4],
          base::percentile(off, 0.5),
          base::percentile(off, 1),
          int(measured.size())};
}

// Measures the block that the hand intersects, with several windows and cameras. The terms are 1
// and x x n (by_area) or x n.
ResponseFit fit_response(const CollisionScene& scene, bool by_area, bool quick) {
  std::vector<Measurement> measured;
  collision::TriangleVolumeQuery query(kWindow_px, 10);
  for (const std::size_t cameras : {2, 3, 4}) {
    query.set_silhouettes(std::span(scene.silhouettes).first(cameras));
    base::WorkerPool pool(1);
    hull::CpuHull hull(pool, query.silhouettes());
    const hull::HullQuery hull_query(hull);
    const collision::Detection detection = collision::detect(query, scene.objects_world_m);
    const auto hit =
        std::find_if(detection.objects.begin(), detection.objects.end(),
                     [](const collision::ObjectCollision& o) { return o.colliding(); });
    if (hit == detection.objects.end()) continue;
    const std::size_t object = std::size_t(hit - detection.objects.begin());
    for (const int window_px : {100, 200, 400, 800}) {
      const collision::ResponseConfig config{.search = collision::HullSearch::sampled,
                                             .window_px = window_px};
      const collision::ResponseRequest request{
          .rp_object_world_m =
              scene.objects[object].world_from_mesh.translation() - Vector3d(0, 0, 0.01),
          .v_rec_world = std::nullopt,
          .normals = {.four_points = true, .closed_form = false}};
      const collision::Requery requery = [&](const Vector3d& move_world_m) {
        std::vector<collision::Triangle> moved = scene.objects_world_m[object];
        for (collision::Triangle& t : moved)
          for (Vector3d& v : t) v += move_world_m;
        return collision::detect(query, std::vector<std::vector<collision::Triangle>>{moved})
            .objects.front();
      };
      const double ms = best_ms(
          quick ? 2 : 15, [&] { collision::respond(hull_query, *hit, request, requery, config); });
      measured.push_back(
          {Eigen::Vector2d(1, double(window_px) * double(cameras) * (by_area ? window_px : 1)),
           ms});
    }
  }
  if (measured.empty()) return {};
  const Eigen::VectorXd x = fitted(measured);
  return {x[0], 1e6 * x[1], base::percentile(residuals(measured, x), 1)};
}

// Returns triangles of all sizes that the hull of a small ball intersects, or nearly.
std::vector<collision::Triangle> pierced_triangles(int count) {
  std::mt19937 random(9);
  const auto between = [&](double low, double high) {
    return low + (high - low) * double(random()) / double(std::mt19937::max());
  };
  std::vector<collision::Triangle> triangles;
  for (int i = 0; i < count; ++i) {
    const Eigen::Quaterniond turn =
        Eigen::Quaterniond(between(-1, 1), between(-1, 1), between(-1, 1), between(-1, 1))
            .normalized();
    const double base_m = std::pow(10, between(-1.7, -0.2)), height_m = base_m * between(0.4, 0.86),
                 apex = between(0.3, 0.7);
    // The origin projects to (b, h) of the triangle and is off_m from its plane.
    const double h = between(0.15, 0.6), b = h * apex + (1 - h) * between(0.15, 0.85),
                 off_m = between(-0.008, 0.008);
    const auto corner = [&](double x, double y) {
      return Vector3d(turn * Vector3d((x - b) * base_m, (y - h) * height_m, off_m));
    };
    triangles.push_back({corner(0, 0), corner(1, 0), corner(apex, 1)});
  }
  return triangles;
}

struct Section {
  double width_m;    // diameter of the disc with the same area
  double spacing_m;  // with a viewport of one pixel: sqrt(x y)
};

std::vector<Section> sections_of(const std::vector<collision::Triangle>& triangles,
                                 std::span<const hull::Silhouette> silhouettes) {
  constexpr int kAcross = 400;
  base::WorkerPool pool(1);
  baselines::BruteForce brute(kAcross);
  brute.set_silhouettes(silhouettes);
  const auto found = brute.detect(std::vector<std::vector<collision::Triangle>>{triangles}, pool);
  std::vector<double> samples(triangles.size());
  for (const collision::CollisionPoint& p : found[0].points) ++samples[p.triangle];
  std::vector<Section> sections;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const double base_m = (triangles[i][1] - triangles[i][0]).norm(),
                 area_m2 = 0.5 * (triangles[i][1] - triangles[i][0])
                                     .cross(triangles[i][2] - triangles[i][0])
                                     .norm();
    sections.push_back(
        {std::sqrt(4 / std::numbers::pi * area_m2 * samples[i] / (0.5 * kAcross * kAcross)),
         std::sqrt(base_m * 2 * area_m2 / base_m)});
  }
  return sections;
}

// Finds the width, in spacings, that best separates the found sections from the missed ones.
AccuracyFit::Viewport fit_viewport(int viewport_px, const std::vector<Section>& sections,
                                   const std::vector<char>& found) {
  std::vector<std::pair<double, bool>> widths;
  AccuracyFit::Viewport v{viewport_px, 0, 0, 0, 0};
  for (std::size_t i = 0; i < sections.size(); ++i) {
    if (!(sections[i].width_m > 0)) continue;
    widths.emplace_back(sections[i].width_m / (sections[i].spacing_m / viewport_px), found[i] != 0);
    (found[i] ? v.found : v.missed)++;
    if (!found[i]) v.widest_missed = std::max(v.widest_missed, widths.back().first);
  }
  std::sort(widths.begin(), widths.end());
  int wrong = v.missed, fewest = wrong;  // with threshold 0, every missed section is wrong
  for (const auto& [width, was_found] : widths) {
    wrong += was_found ? 1 : -1;
    if (wrong < fewest) fewest = wrong, v.found_from = width;
  }
  return v;
}

AccuracyFit fit_accuracy(bool quick) {
  const std::vector<hull::Capsule> ball{{Vector3d::Zero(), Vector3d::Zero(), 0.006}};
  std::vector<hull::Silhouette> silhouettes;
  for (const Vector3d& eye :
       {Vector3d(1, 0, 0.3), Vector3d(-0.5, 0.9, 0.5), Vector3d(-0.3, -0.8, 0.9)}) {
    const geometry::Camera camera{geometry::pinhole_from_fov(200, 200, 0.05),
                                  geometry::look_at(eye, Vector3d::Zero())};
    silhouettes.push_back(
        {camera, hull::true_object_pixels(ball, camera, hull::PixelRule::touched)});
  }
  const std::vector<collision::Triangle> triangles = pierced_triangles(quick ? 300 : 3000);
  const std::vector<Section> sections = sections_of(triangles, silhouettes);
  AccuracyFit fit;
  double sum_of_logs = 0;
  for (const int viewport_px : kViewports_px) {
    collision::TriangleVolumeQuery query(kWindow_px, viewport_px);
    query.set_silhouettes(silhouettes);
    std::vector<char> found(triangles.size());
    for (const collision::CollisionPoint& p : query.query(triangles).points) found[p.triangle] = 1;
    fit.viewports.push_back(fit_viewport(viewport_px, sections, found));
    sum_of_logs += std::log(fit.viewports.back().found_from);
  }
  fit.found_from = std::exp(sum_of_logs / double(fit.viewports.size()));
  for (const auto& v : fit.viewports)
    fit.worst_off = std::max(fit.worst_off, std::abs(v.found_from / fit.found_from - 1));
  return fit;
}

}  // namespace

PaperModelFits fit_paper_models(bool quick) {
  const CollisionScene curtain = curtain720(), boxes = blocks();
  const std::vector<Measurement> cost = measured_cost(curtain, quick);
  return {fit_cost(cost, 3), fit_cost(cost, 5), fit_response(boxes, true, quick),
          fit_response(boxes, false, quick), fit_accuracy(quick)};
}

void print(const PaperModelFits& fits) {
  std::cout << fmt::format(
      "\nThe paper's cost model, fitted to its backend here (n cameras, m triangles, viewports "
      "u x u, {} measurements):\n",
      fits.cost.measurements);
  for (const CostFit* c : {&fits.cost, &fits.extended_cost})
    std::cout << fmt::format(
        "  {:.1f} ns n m + {:.3f} ns n m u u / 2 + {:.3f} ns per pixel read back + {:.1f} ns per "
        "point confirmed + {:.3f} ms; residuals {:.0f} % (median), {:.0f} % (worst){}\n",
        c->ns_per_transform, c->ns_per_fill, c->ns_per_read, c->ns_per_point, c->fixed_ms,
        100 * c->median_off, 100 * c->worst_off, c == &fits.cost ? "; the paper's terms only" : "");
  std::cout << fmt::format(
      "  response by area, as in the paper: {:.3f} ms + {:.4f} ns x y n, worst residual {:.0f} %; "
      "by lines, as implemented: {:.3f} ms + {:.2f} ns x n, worst residual {:.0f} %\n",
      fits.response_by_area.fixed_ms, fits.response_by_area.ns_per_unit,
      100 * fits.response_by_area.worst_off, fits.response_by_lines.fixed_ms,
      fits.response_by_lines.ns_per_unit, 100 * fits.response_by_lines.worst_off);
  std::cout << fmt::format(
      "The paper's accuracy law, extent / u: sections of the hull are found from a width of {:.2f} "
      "sqrt(x y) / u; single viewports deviate by at most {:.0f} %:\n",
      fits.accuracy.found_from, 100 * fits.accuracy.worst_off);
  for (const auto& v : fits.accuracy.viewports)
    std::cout << fmt::format(
        "  {:2}x{:<2} found from {:.2f} spacings; widest missed {:.2f}; {} missed, {} found\n",
        v.px, v.px, v.found_from, v.widest_missed, v.missed, v.found);
}

}  // namespace fivepipe::collision_bench
