#include "common/config/collision_requests_reader.h"

#include <fmt/format.h>

#include <algorithm>

namespace fivepipe::config {
namespace {

constexpr Range kHeight_m{1e-4, 10};
constexpr Range kAngle_deg{0.1, 179.9};
constexpr Range kCap_m{1e-3, 10};
constexpr Range kTolerance_m{1e-5, 1};
constexpr Range kContacts{0, 64};
constexpr Range kTime_s{1e-3, 3600};
constexpr Range kCell_m{5e-4, 1};
constexpr Range kWindow{3, 240};
// Minimum ratio of tolerance to cap: the cost of a search grows with its inverse.
constexpr double kMinToleranceFraction = 1e-3;
constexpr Range kSpeed_m_s{0.01, 1000};

ResponseRequests read_response(YamlMap map) {
  ResponseRequests requests;
  requests.search = map.choice<RecoverySearch>("search",
                                               {{"from_reference", RecoverySearch::from_reference},
                                                {"outward", RecoverySearch::outward},
                                                {"sampled", RecoverySearch::sampled}},
                                               requests.search);
  requests.height_m = map.number("height_m", kHeight_m, requests.height_m);
  requests.apex_angle_rad =
      kDegree_rad * map.number("apex_angle_deg", kAngle_deg, requests.apex_angle_rad / kDegree_rad);
  requests.v_rec_world = map.direction("v_rec");
  requests.four_points = map.flag("four_point_normal", requests.four_points);
  requests.closed_form = map.flag("closed_form_normal", requests.closed_form);
  requests.local_minimum_translation =
      map.flag("local_minimum_translation", requests.local_minimum_translation);
  map.finish();
  return requests;
}

// Reads cap_m and tolerance_m; the values passed in are the defaults.
void read_cap(YamlMap& map, double& cap_m, double& tolerance_m) {
  cap_m = map.number("cap_m", kCap_m, cap_m);
  tolerance_m = map.number("tolerance_m", kTolerance_m, std::min(tolerance_m, cap_m));
  if (!(tolerance_m <= cap_m))
    map.problem_at("tolerance_m", fmt::format("tolerance_m must be at most cap_m ({}), is {}",
                                              cap_m, tolerance_m));
  if (tolerance_m < kMinToleranceFraction * cap_m)
    map.problem_at("tolerance_m",
                   fmt::format("tolerance_m must be at least cap_m / 1000 ({}), is {}: a smaller "
                               "one makes a query take seconds",
                               kMinToleranceFraction * cap_m, tolerance_m));
}

ProximityRequests read_proximity(YamlMap map) {
  ProximityRequests requests;
  requests.of = map.choice<ProximityOf>(
      "of", {{"vertices", ProximityOf::vertices}, {"triangles", ProximityOf::triangles}},
      requests.of);
  read_cap(map, requests.cap_m, requests.tolerance_m);
  map.finish();
  return requests;
}

}  // namespace

CollisionRequests read_collision_requests(YamlMap map) {
  CollisionRequests requests;
  requests.triangles = map.flag("triangles", requests.triangles);
  if (map.has("response")) requests.response = read_response(map.map("response"));
  requests.contacts = map.integer("contacts", kContacts, requests.contacts);
  if (map.has("proximity")) requests.proximity = read_proximity(map.map("proximity"));
  requests.first_contact = map.flag("first_contact", requests.first_contact);
  map.finish();
  return requests;
}

Warming read_warming(YamlMap map) {
  Warming warming;
  read_cap(map, warming.cap_m, warming.tolerance_m);
  warming.heating_s = map.number("heating_s", kTime_s, warming.heating_s);
  warming.cooling_s = map.number("cooling_s", kTime_s, warming.cooling_s);
  warming.colour_rgb = map.rgb("colour_rgb", warming.colour_rgb);
  map.finish();
  return warming;
}

HistoryRequests read_history_requests(YamlMap map) {
  HistoryRequests requests;
  requests.cell_m = map.number("cell_m", kCell_m, requests.cell_m);
  requests.window_frames = map.integer("window_frames", kWindow, requests.window_frames);
  requests.max_speed_m_s = map.number("max_speed_m_s", kSpeed_m_s, requests.max_speed_m_s);
  map.finish();
  return requests;
}

}  // namespace fivepipe::config
