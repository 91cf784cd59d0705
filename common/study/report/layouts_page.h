// The page of `fivepipe study what-if`: what the real objects of a recording would have hit with
// parts elsewhere. Curves of each part over its range, and charts of layouts of several parts.
#pragma once
#include <string>
#include <vector>

#include "common/study/report/study.h"

namespace fivepipe::study::report {

// One layout of several parts.
struct PlacedLayout {
  std::string name;              // "line 12"; empty: its places are its name
  std::vector<double> places_m;  // as LayoutsPage::places
  LayoutResult result;
  std::vector<std::string> colliding_parts = {};
};

// Texts may hold anything, as those of a Study.
struct LayoutsPage {
  std::string recording, scene, version;
  std::size_t frames = 0;
  double duration_s = 0;
  std::string limits;  // of the results, sentences
  bool with_distances = true;
  std::vector<WhatIfCurve> curves = {};    // one per part, over its range
  std::vector<std::string> places = {};    // "payload A": what the numbers of a layout are
  std::vector<PlacedLayout> layouts = {};  // in any order
};

// Returns the page. If the layouts are all combinations of at least two values of each of two
// places, it also has maps. Throws std::invalid_argument if a layout has another number of places
// than the page, or if a place or a collision time is not finite.
std::string layouts_page(const LayoutsPage& page);

// The charts show at most this many layouts, at equal distances in the order of their collision
// times, and the page states how many. A larger grid has no map.
inline constexpr std::size_t kMaxDrawnLayouts = 5000;

}  // namespace fivepipe::study::report
