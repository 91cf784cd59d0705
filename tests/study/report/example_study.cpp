#include "tests/study/report/example_study.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace fivepipe::test {
namespace {

using collision::SpacingInterval;
using Eigen::Vector3d;
using geometry::Mesh;
using namespace study::report;  // NOLINT: the test names most of its types
using study::Bracket;
using study::LayoutResult;

constexpr double kInfinite = std::numeric_limits<double>::infinity();

Mesh moved(Mesh mesh, const Vector3d& by_m) {
  for (Vector3d& p_m : mesh.vertices_m) p_m += by_m;
  return mesh;
}

void append(Mesh& mesh, const Mesh& more) {
  const auto first = std::uint32_t(mesh.vertices_m.size());
  mesh.vertices_m.insert(mesh.vertices_m.end(), more.vertices_m.begin(), more.vertices_m.end());
  for (const auto& t : more.triangles)
    mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
}

// A tube along z with a wall.
Mesh tube(double outer_m, double inner_m, double height_m, int sides) {
  Mesh mesh;
  for (int i = 0; i < sides; ++i) {
    const double angle = 2 * M_PI * i / sides;
    const Vector3d out(std::cos(angle), std::sin(angle), 0), up(0, 0, height_m);
    for (const Vector3d& p_m : {Vector3d(outer_m * out), Vector3d(outer_m * out + up),
                                Vector3d(inner_m * out + up), Vector3d(inner_m * out)})
      mesh.vertices_m.push_back(p_m);
    const auto a = std::uint32_t(4 * i), b = std::uint32_t(4 * ((i + 1) % sides));
    for (std::uint32_t k = 0; k < 4; ++k) {
      const std::uint32_t next = (k + 1) % 4;
      mesh.triangles.push_back({a + k, b + k, b + next});
      mesh.triangles.push_back({a + k, b + next, a + next});
    }
  }
  return mesh;
}

std::vector<Part> example_parts() {
  Mesh pmt = moved(geometry::box_mesh({0.3, 0.26, 0.16}), {0, 0, 0.08});
  append(pmt, moved(tube(0.035, 0.022, 0.06, 32), {0, 0, 0.16}));
  return {
      {"PMT", pmt, {178, 186, 196}},
      {"payload A",
       moved(geometry::box_mesh({0.12, 0.3, 0.42}), {0.15 + 0.18 + 0.06, 0, 0.21}),
       {214, 158, 74},
       MovableAxis{{1, 0, 0}, 0.18, {0.1, 0.35}}},
      {"payload B", moved(geometry::box_mesh({0.14, 0.3, 0.3}), {-0.34, 0, 0.15}), {120, 160, 120}},
      {"bracket",
       moved(geometry::box_mesh({0.04, 0.04, 0.2}), {0.2, 0.11, 0.26}),
       {196, 110, 130},
       std::nullopt,
       false}};
}

// A lumpy ball that stands for the volume of a hand.
Mesh swept_hand(const Vector3d& center_m, const Vector3d& radius_m, int subdivisions) {
  Mesh mesh = geometry::sphere_mesh(1, subdivisions);
  for (Vector3d& p_m : mesh.vertices_m) {
    const double lump = 1 + 0.08 * std::sin(9 * p_m.x()) * std::cos(7 * p_m.z());
    p_m = center_m + lump * p_m.cwiseProduct(radius_m);
  }
  return mesh;
}

Clearance example_clearance(double least_m, double duration_s) {
  Clearance clearance;
  clearance.cap_m = 0.1;
  clearance.errors = {{"map resolution", 1.3}, {"calibration", 0.6}, {"eps", 0.5}};
  for (double time_s = 0; time_s < duration_s; time_s += 0.1) {
    const double wave = 0.5 + 0.35 * std::sin(0.23 * time_s) + 0.15 * std::sin(0.9 * time_s);
    const double distance_m = std::max(0.0, least_m + 0.14 * wave);
    clearance.times_s.push_back(time_s);
    clearance.distances.push_back(
        distance_m >= 0.1 ? Bracket{0.1, kInfinite}
                          : Bracket{std::max(0.0, distance_m - 0.001), distance_m + 0.001});
  }
  return clearance;
}

PartResult example_result(const std::string& part, double least_m, double duration_s) {
  PartResult result{part, 0, {}, example_clearance(least_m, duration_s)};
  const Clearance& clearance = *result.clearance;
  double start_s = -1;
  for (std::size_t i = 0; i < clearance.times_s.size(); ++i) {
    const bool touches = clearance.distances[i].min_m <= 0;
    if (touches && start_s < 0) start_s = clearance.times_s[i];
    if (!touches && start_s >= 0) {
      const int seed = int(result.events.size()) + int(part.size());
      result.events.push_back({start_s, clearance.times_s[i], Bracket{0.004, 0.0055},
                               example_png(320, 240, seed),
                               "Seen by the viewer; the part is red."});
      result.collision_s += clearance.times_s[i] - start_s;
      start_s = -1;
    }
  }
  return result;
}

// Free above `free_m`, and in a short interval below, where the forearm is behind the part.
WhatIfCurve example_curve(double free_m) {
  WhatIfCurve curve{"payload A", {0.1, 0.35}, {}};
  const SpacingInterval behind{0.112, 0.121};
  curve.result.free = {behind, {free_m, 0.35}};
  for (int i = 0; i <= 50; ++i) {
    LayoutResult layout;
    layout.spacing_m = 0.1 + 0.005 * i;
    const double over_m = layout.spacing_m - free_m;
    const bool is_behind = behind.low_m <= layout.spacing_m && layout.spacing_m <= behind.high_m;
    if (over_m >= 0 || is_behind) {
      const double distance_m = is_behind ? 0.002 : over_m;
      layout.clearance =
          distance_m > 0.1 ? Bracket{0.1, kInfinite} : Bracket{distance_m, distance_m + 0.0008};
    } else if (over_m > -0.003) {
      layout.undecided_frames = 2;
    } else {
      layout.collision_s = 140 * -over_m + 0.8 * std::sin(60 * over_m) * std::sin(60 * over_m);
      layout.colliding_frames = std::size_t(30 * layout.collision_s);
      layout.penetration = {-over_m, -over_m + 0.0012};
    }
    curve.result.layouts.push_back(layout);
  }
  return curve;
}

Trial example_trial(int number, double duration_s, const std::string& tool, double found_m) {
  Trial trial{number, true, "", duration_s, tool};
  trial.notes = {{0.2 * duration_s, "pipe is through, lowering it"},
                 {0.55 * duration_s, tool.empty() ? "cord goes in by hand"
                                                  : "cannot reach the plug, asks for a tool"}};
  trial.layout_changes = {{0, "payload A", 0.14},
                          {0.3 * duration_s, "payload A", 0.5 * (0.14 + found_m)},
                          {0.6 * duration_s, "payload A", found_m}};
  trial.parts = {example_result("PMT", 0.012, duration_s),
                 example_result("payload A", -0.006, duration_s),
                 example_result("payload B", 0.05, duration_s)};
  trial.what_if = {example_curve(found_m - 0.004)};
  trial.scene = 0;
  trial.swept = {{"right hand", swept_hand({0.16, 0.01, 0.34}, {0.09, 0.08, 0.14}, 4)}};
  if (!tool.empty())
    trial.swept.push_back({tool, swept_hand({0.02, 0, 0.24}, {0.02, 0.02, 0.12}, 3)});
  return trial;
}

}  // namespace

std::string example_png(int width_px, int height_px, int seed) {
  cv::Mat picture(height_px, width_px, CV_8UC3, cv::Scalar(62, 52, 46));
  const cv::Point at(width_px / 2 + 7 * (seed % 9) - 30, height_px / 2);
  cv::rectangle(picture, {width_px / 8, height_px / 2}, {width_px / 2, height_px - 10},
                {190, 180, 170}, cv::FILLED);
  cv::rectangle(picture, {at.x + 20, height_px / 6}, {width_px - 20, height_px - 10}, {40, 40, 210},
                cv::FILLED);
  cv::ellipse(picture, at, {width_px / 7, height_px / 5}, 25, 0, 360, {130, 165, 215}, cv::FILLED,
              cv::LINE_AA);
  std::vector<std::uint8_t> bytes;
  cv::imencode(".png", picture, bytes);
  return {bytes.begin(), bytes.end()};
}

Study example_study() {
  Study study{"Photon multiplier tube, cord and pipe",
              "2026-02-03",
              "0.1.0",
              "example: no machine measured this",
              "rigs/ring4",
              "payload",
              "A and PMT"};
  study.remarks = {"Example: the answers are those of the paper, all other numbers are invented."};
  study.scenes = {example_parts()};
  const auto answers = [](Answer necessary, Answer allocated, Answer found, Answer after) {
    return Answers{necessary, allocated, found, after};
  };
  const std::vector<Answers> table = {
      answers({0.14}, {0.21}, {0.15}, {0.18}),
      answers({0.142}, {0.16}, {0.225}, {0.16, std::nullopt, "adjust tool"}),
      answers({0.15, 0.16}, {0.2}, {0.223}, {0.25}), answers({0.15}, {0.15}, {0.23}, {0.23})};
  for (std::size_t i = 0; i < table.size(); ++i) {
    Participant participant{"P" + std::to_string(i + 1), ParticipantKind::human, {}};
    if (i == 1) {
      Trial aborted{1, false, "the cord came off its plug", 12.5, ""};
      aborted.scene = 0;
      aborted.answers.necessary_before = table[i].necessary_before;
      participant.trials.push_back(aborted);
    }
    participant.trials.push_back(example_trial(int(participant.trials.size()) + 1,
                                               42 + 11.0 * double(i), i == 0 ? "" : "tongs",
                                               table[i].found->low_m));
    participant.trials.back().answers = table[i];
    study.participants.push_back(participant);
  }
  return study;
}

Study study_of(std::size_t count, ParticipantKind kind) {
  Study study;
  study.name = "study";
  for (std::size_t i = 0; i < count; ++i) {
    Participant participant{"P" + std::to_string(i + 1), kind, {Trial{}}};
    participant.trials[0].answers = {Answer{0.14}, Answer{0.16}, Answer{0.2 + 0.001 * double(i)},
                                     Answer{0.21}};
    study.participants.push_back(participant);
  }
  return study;
}

LayoutsPage example_layouts() {
  LayoutsPage page{.recording = "session.mcap",
                   .scene = "payload",
                   .version = "0.1.0",
                   .frames = 1800,
                   .duration_s = 60,
                   .limits = "The visual hull is larger than the objects."};
  page.curves = {example_curve(0.24), example_curve(0.2)};
  page.curves[1].part = "payload B";
  page.places = {"payload A", "payload B"};
  for (int a = 0; a < 13; ++a)
    for (int b = 0; b < 9; ++b) {
      PlacedLayout layout{"", {0.12 + 0.01 * a, 0.1 + 0.02 * b}, {}};
      const double over_a_m = layout.places_m[0] - 0.18, over_b_m = layout.places_m[1] - 0.165,
                   least_m = std::min(over_a_m, over_b_m + 0.01 * a - 0.06);
      LayoutResult& result = layout.result;
      if (b == 0 && a >= 12) {
        result.undecided_frames = 3;
        result.clearance = {0, 0.0008};
      } else if (least_m < 0) {
        result.collision_s = -60 * least_m;
        result.colliding_frames = std::size_t(1 + 30 * result.collision_s);
        result.penetration = {-least_m, 0.0008 - least_m};
        layout.colliding_parts = {over_a_m < 0 ? "payload A" : "payload B"};
      } else {
        result.clearance = {least_m, least_m + 0.0008};
      }
      page.layouts.push_back(layout);
    }
  return page;
}

}  // namespace fivepipe::test
