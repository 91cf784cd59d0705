// Tables of collisions, from collision.json. Results are named method/scene/setting/threads.
#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <stdexcept>

#include "benchmarks/figures/documents.h"
#include "benchmarks/figures/numbers.h"

namespace fivepipe::figures {
namespace {

constexpr const char* kCollision = "collision";

struct DetectionRow {
  std::string text, method, setting;
  std::string setting_of_thin = {};  // finer, because its fingers are 2 mm thick; empty: the same
  bool on_gl = false;                // on the largest number of threads, because OpenGL uses them
};

std::vector<std::string> split(const std::string& name) {
  std::vector<std::string> parts(1);
  for (const char c : name)
    if (c == '/')
      parts.emplace_back();
    else
      parts.back() += c;
  return parts;
}

bool is_detection(const json& result) { return result.contains("query_ms"); }

double median_ms(const json& result, const char* times) {
  return result.at(times).at("median").get<double>();
}

int detection_threads(const Results& results) {
  int threads = 1;
  for (const json& r : results.all(kCollision))
    if (is_detection(r)) threads = std::max(threads, std::stoi(split(r.at("name")).back()));
  return threads;
}

const json* find(const Results& results, const DetectionRow& row, const std::string& scene) {
  const std::string& setting =
      scene == "thin" && !row.setting_of_thin.empty() ? row.setting_of_thin : row.setting;
  return results.find(kCollision, fmt::format("{}/{}/{}/{}", row.method, scene, setting,
                                              row.on_gl ? detection_threads(results) : 1));
}

std::vector<std::string> scenes(const Results& results) {
  std::vector<std::string> names;
  for (const json& r : results.all(kCollision))
    if (is_detection(r))
      if (const std::string scene = split(r.at("name"))[1];
          std::find(names.begin(), names.end(), scene) == names.end())
        names.push_back(scene);
  return names;
}

// Any method's result, for the counts of the reference.
const json& of_scene(const Results& results, const std::string& scene) {
  return results.at(kCollision, "cpuverdict/" + scene + "/eps0.5mm/1");
}
std::string crossing_text(const Results& results, const std::string& scene) {
  return count_text(count_of(of_scene(results, scene), "crossing"));
}
std::string triangles_text(const Results& results, const std::string& scene) {
  return scene + ", " + count_text(count_of(of_scene(results, scene), "triangles"));
}

std::string threads_text(const Results& results) {
  return fmt::format("{} ({} threads)", results.gl_name(), detection_threads(results));
}

std::vector<DetectionRow> all_rows(const Results& results) {
  const std::string gl = threads_text(results);
  return {{"**cpu**, verdict, `eps_m` 0.5 mm", "cpuverdict", "eps0.5mm"},
          {"**cpu**, points 3 mm apart", "cpu", "eps3mm"},
          {"**cpu**, points 0.5 mm apart", "cpu", "eps0.5mm"},
          {"**gl** on " + gl + ", verdict", "glverdict", "eps0.5mm", "", true},
          {"brute force, SIMD, 10x10 samples per triangle", "brute", "10x10"},
          {"brute force, 60x60", "brute", "60x60"},
          {"the paper's 10x10 viewports on " + gl, "paper10", "400", "", true},
          {"the paper's, 40x40", "paper40", "400", "", true},
          {"hull polygonised at 4 mm, FCL", "fcl", "4mm"},
          {"hull polygonised at 2 mm, FCL", "fcl", "2mm"},
          {"hull polygonised at 1 mm (thin: 0.5 mm), FCL", "fcl", "1mm", "0.5mm"}};
}

void add_rows(MarkdownTable& table, const Results& results,
              const std::function<std::string(const json&)>& cell) {
  for (const DetectionRow& row : all_rows(results)) {
    std::vector<std::string> cells{row.text};
    for (const std::string& scene : scenes(results)) {
      const json* result = find(results, row, scene);
      cells.push_back(result ? cell(*result) : "");
    }
    table.add(cells);
  }
}

// What each kind of method prepares once per frame, which all queries of the frame share.
std::vector<DetectionRow> preparations(const Results& results) {
  const std::string gl = threads_text(results);
  return {{"preparation of the maps for **cpu**", "cpuverdict", "eps0.5mm"},
          {"the same for **gl** on " + gl, "glverdict", "eps0.5mm", "", true},
          {"the same for brute force", "brute", "10x10"},
          {"the same for the paper's on " + gl, "paper10", "400", "", true}};
}

std::string preparation_text(const Results& results, const DetectionRow& row,
                             const std::string& scene) {
  const json* r = find(results, row, scene);
  return r ? short_number(median_ms(*r, "maps_ms")) : "";
}

std::string detection_times(const Results& results) {
  std::vector<std::string> head{"ms; triangles"};
  for (const std::string& scene : scenes(results)) head.push_back(triangles_text(results, scene));
  MarkdownTable table(head);
  add_rows(table, results, [](const json& r) { return short_number(time_ms(r)); });
  for (const DetectionRow& row : preparations(results)) {
    std::vector<std::string> cells{row.text};
    for (const std::string& scene : scenes(results))
      cells.push_back(preparation_text(results, row, scene));
    table.add(cells);
  }
  return table.text();
}

std::string missed_text(const json& r) {
  const double missed = count_of(r, "missed");
  return missed == 0 ? "0"
                     : fmt::format("{} ({} mm)", count_text(missed),
                                   short_number(error_of(r, "deepest_missed_mm")));
}

std::string detection_errors(const Results& results) {
  std::vector<std::string> head{"missed (deepest); false"};
  for (const std::string& scene : scenes(results))
    head.push_back(fmt::format("{}, {} collide", scene, crossing_text(results, scene)));
  MarkdownTable table(head);
  add_rows(table, results,
           [](const json& r) { return missed_text(r) + "; " + count_text(count_of(r, "false")); });
  return table.text();
}

const char* const kSummaryScenes[] = {"curtain720", "payload", "dense"};

std::string collision_summary(const Results& results) {
  std::vector<std::string> head{"method"};
  for (const char* scene : kSummaryScenes)
    head.push_back(triangles_text(results, scene) + " triangles, ms");
  std::string of;
  for (const char* scene : kSummaryScenes)
    of += (of.empty() ? "" : " / ") + crossing_text(results, scene);
  head.insert(head.end(), {"missed of " + of, "false alarms"});
  MarkdownTable table(head);
  const std::set<std::string> omitted = {"cpu eps0.5mm", "paper40 400", "fcl 4mm"};
  for (const DetectionRow& row : all_rows(results)) {
    if (omitted.contains(row.method + " " + row.setting)) continue;
    std::vector<std::string> cells{row.text};
    std::string missed, wrong;
    for (const char* scene : kSummaryScenes) {
      const json* r = find(results, row, scene);
      if (!r) throw std::runtime_error("no result of " + row.method + " in " + scene);
      cells.push_back(short_number(time_ms(*r)));
      missed += (missed.empty() ? "" : " / ") + count_text(count_of(*r, "missed"));
      wrong += (wrong.empty() ? "" : " / ") + count_text(count_of(*r, "false"));
    }
    cells.insert(cells.end(), {missed, wrong});
    table.add(cells);
  }
  for (const DetectionRow& row : preparations(results)) {
    std::vector<std::string> cells{row.text};
    for (const char* scene : kSummaryScenes) cells.push_back(preparation_text(results, row, scene));
    cells.insert(cells.end(), {"", ""});
    table.add(cells);
  }
  return table.text();
}

bool is_certified(const std::string& method) {
  return method == "cpu" || method == "cpuverdict" || method == "gl" || method == "glverdict";
}

std::string facts(const Results& results) {
  double missed = 0, wrong = 0, undecided = 0;
  for (const json& r : results.all(kCollision)) {
    if (!is_detection(r) || !is_certified(split(r.at("name"))[0])) continue;
    missed += count_of(r, "missed");
    wrong += count_of(r, "false");
    undecided = std::max(undecided, count_of(r, "undecided"));
  }
  const auto triangles = [](double n) {
    return n == 0 ? std::string("no triangle")
                  : count_text(n) + (n == 1 ? " triangle" : " triangles");
  };
  return wrapped(fmt::format(
      "Over all scenes and settings, cpu and gl together miss {} and report {} falsely. In each "
      "scene they leave at most {} undecided.",
      triangles(missed), triangles(wrong), triangles(undecided)));
}

double with_maps_ms(const json& r) { return time_ms(r) + median_ms(r, "maps_ms"); }

// "0.53 (thin) to 1.7 (full) times", over the scenes of which both are measured.
std::string range_text(const std::vector<std::pair<double, std::string>>& ratios) {
  const auto [smallest, largest] = std::minmax_element(ratios.begin(), ratios.end());
  return fmt::format("{} ({}) to {} ({}) times", short_number(smallest->first), smallest->second,
                     short_number(largest->first), largest->second);
}

// Brute force with 10x10 samples against cpu's verdict.
std::string brute_force_text(const Results& results) {
  std::vector<std::pair<double, std::string>> alone, with_maps;
  std::string faster;
  for (const std::string& scene : scenes(results)) {
    const json &cpu = of_scene(results, scene),
               &brute = results.at(kCollision, "brute/" + scene + "/10x10/1");
    alone.emplace_back(time_ms(brute) / time_ms(cpu), scene);
    with_maps.emplace_back(with_maps_ms(brute) / with_maps_ms(cpu), scene);
    if (with_maps.back().first < 1) faster += (faster.empty() ? "" : ", ") + scene;
  }
  return fmt::format(
      "Brute force with 10x10 samples takes {} the time of cpu's verdict, and misses "
      "parts between its samples. With the preparation of the maps it takes {} the time, and is "
      "faster "
      "in: {}.",
      range_text(alone), range_text(with_maps), faster.empty() ? "no scene" : faster);
}

std::string rates(const Results& results) {
  const json &curtain = of_scene(results, "curtain720"), &dense = of_scene(results, "dense"),
             &payload = of_scene(results, "payload");
  const double triangles = count_of(curtain, "triangles"), ms = with_maps_ms(curtain);
  const auto near_text = [](const json& r) {
    return fmt::format("{} triangles, of which {} are nearer than 5 mm to the hull, take {} ms",
                       count_text(count_of(r, "triangles")), count_text(count_of(r, "near")),
                       short_number(time_ms(r)));
  };
  return bullet(fmt::format("The verdicts on {} triangles in {} ms, with the preparation of the "
                            "maps, are {} million per second; the paper reports 4,320 per second, "
                            "with collision points, on its machine.",
                            count_text(triangles), short_number(ms),
                            short_number(1e-3 * triangles / ms))) +
         bullet("The time does not follow the size of the mesh: in scene dense, " +
                near_text(dense) + "; in scene payload, " + near_text(payload) + ".") +
         bullet(brute_force_text(results));
}

// "median; worst" of the response's error in mm.
std::string d_rec_text(const json& r) {
  const json& e = r.at("response").at("d_rec_error_mm");
  if (e.is_null()) return "";
  return tiny_number(e.at("median")) + "; " + tiny_number(e.at("worst"));
}

// "refit + detection + response" of one frame in ms.
std::string response_time_text(const json& r) {
  if (r.at("response_ms").is_null()) return "";
  const double refit_ms = r.at("refit_ms").is_null() ? 0 : r.at("refit_ms").get<double>();
  const double detect_ms = median_ms(r, "query_ms") - refit_ms;
  return (refit_ms > 0 ? short_number(refit_ms) + " + " : "") + short_number(detect_ms) + " + " +
         short_number(median_ms(r, "response_ms"));
}

std::string responses(const Results& results) {
  const std::vector<DetectionRow> rows = {
      {"**exact rays**, detection at 3 mm", "cpu", "eps3mm"},
      {"the paper's ABC and DAE in windows of 400x400 on " + threads_text(results) +
           ", after its 10x10",
       "paper10", "400", "", true},
      {"hull polygonised at 2 mm, ray against its triangles", "fcl", "2mm"},
      {"hull polygonised at 1 mm (thin: 0.5 mm), the same", "fcl", "1mm", "0.5mm"}};
  std::vector<std::string> head{""};
  for (const std::string& scene : scenes(results)) head.push_back(scene);
  MarkdownTable table(head);
  for (const DetectionRow& row : rows) {
    std::vector<std::string> times{row.text + ": ms"}, errors{"error: mm"};
    for (const std::string& scene : scenes(results)) {
      const json* r = find(results, row, scene);
      times.push_back(r ? response_time_text(*r) : "");
      errors.push_back(r && !r->at("response").is_null() ? d_rec_text(*r) : "");
    }
    if (row.method == "fcl")
      errors.front() = row.text + ": error, mm";  // its response is not timed separately
    else
      table.add(times);
    table.add(errors);
  }
  return table.text();
}

std::string normals(const Results& results) {
  const std::pair<const char*, const char*> curves[] = {{"closed-binary", "binary maps"},
                                                        {"closed-coverage", "8-bit coverage"},
                                                        {"four-points", "the paper's four points"}};
  std::vector<std::string> radii;
  for (const json& r : results.all(kCollision))
    if (const auto parts = split(r.at("name"));
        parts[0] == "normals" && parts[1] == curves[0].first)
      radii.push_back(parts[2]);
  if (radii.empty()) throw std::runtime_error("collision.json has no result normals/");
  std::vector<std::string> head{"radius"};
  for (const std::string& radius : radii)
    head.push_back(radius.substr(0, radius.size() - 2) + " px");
  MarkdownTable table(head);
  for (const auto& [name, text] : curves) {
    std::vector<std::string> cells{text};
    for (const std::string& radius : radii) {
      const json& r = results.at(kCollision, fmt::format("normals/{}/{}/1", name, radius));
      cells.push_back(short_number(error_of(r, "n_hull_median_deg")) + "; " +
                      short_number(error_of(r, "n_hull_p95_deg")));
    }
    table.add(cells);
  }
  return table.text();
}

std::string proximity(const Results& results) {
  MarkdownTable table({"method", "ms", "per 1,000 points, ms", "widest bounds, mm",
                       "error of the mean of the bounds, median; maximum, mm",
                       "distances outside the bounds"});
  std::size_t rows = 0;
  for (const json& r : results.all(kCollision)) {
    if (!r.contains("ms_per_1000")) continue;
    const auto parts = split(r.at("name"));
    if (parts.back() != "1") continue;  // threads
    const std::string tolerance = parts[2].substr(3, parts[2].find("mm-") - 3);
    const std::string method = parts[0] == "edt" ? "voxels, "
                               : parts[0] == "proximitymesh"
                                   ? "**bounds** of vertices and triangles, "
                                   : "**bounds**, ";
    const json& widest = r.at("error").at("bounds_width_widest_mm");
    // A grid of voxels guarantees nothing; its distance is taken as within the tolerance.
    const std::string bounds = parts[0] == "edt"  ? "± " + tolerance + ", not guaranteed"
                               : widest.is_null() ? "none"
                                                  : short_number(widest.get<double>());
    table.add({fmt::format("{}{} mm, {}, {} points", method, tolerance, parts[1],
                           count_text(count_of(r, "points"))),
               short_number(time_ms(r)), short_number(r.at("ms_per_1000").get<double>()), bounds,
               short_number(error_of(r, "distance_median_mm")) + "; " +
                   short_number(error_of(r, "distance_worst_mm")),
               of_text(count_of(r, "violations"), count_of(r, "known"))});
    ++rows;
  }
  if (rows == 0) throw std::runtime_error("collision.json has no result with ms_per_1000");
  return table.text();
}

}  // namespace

std::map<std::string, Block> collision_blocks() {
  return {{"collision summary", collision_summary},
          {"detection times", detection_times},
          {"detection errors", detection_errors},
          {"detection facts", facts},
          {"detection rates", rates},
          {"responses", responses},
          {"normals", normals},
          {"proximity", proximity}};
}

}  // namespace fivepipe::figures
