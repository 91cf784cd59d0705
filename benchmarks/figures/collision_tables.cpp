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
  bool on_gl = false;                // on all threads, because OpenGL uses them
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

std::string table_of(const Results& results, const std::vector<std::string>& head,
                     const std::function<std::string(const json&)>& cell) {
  MarkdownTable table(head);
  for (const DetectionRow& row : all_rows(results)) {
    std::vector<std::string> cells{row.text};
    for (const std::string& scene : scenes(results)) {
      const json* result = find(results, row, scene);
      cells.push_back(result ? cell(*result) : "");
    }
    table.add(cells);
  }
  return table.text();
}

std::string detection_times(const Results& results) {
  std::vector<std::string> head{"ms; triangles"};
  for (const std::string& scene : scenes(results)) head.push_back(triangles_text(results, scene));
  return table_of(results, head, [](const json& r) { return short_number(time_ms(r)); });
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
  return table_of(results, head, [](const json& r) {
    return missed_text(r) + "; " + count_text(count_of(r, "false"));
  });
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

std::string rates(const Results& results) {
  const json &curtain = of_scene(results, "curtain720"), &dense = of_scene(results, "dense");
  return bullet(fmt::format(
             "{} triangles in {} ms are {} million per second; the paper reports 4,320 per second.",
             count_text(count_of(curtain, "triangles")), short_number(time_ms(curtain)),
             short_number(1e-6 * curtain.at("triangles_per_s").get<double>()))) +
         bullet(fmt::format("The time grows with the contact, not with the mesh: {} triangles, of "
                            "which {} are nearer than 5 mm to the hull, take {} ms.",
                            count_text(count_of(dense, "triangles")),
                            count_text(count_of(dense, "near")), short_number(time_ms(dense))));
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
  const double detect_ms = r.at("query_ms").at("best").get<double>() - refit_ms;
  return (refit_ms > 0 ? short_number(refit_ms) + " + " : "") + short_number(detect_ms) + " + " +
         short_number(r.at("response_ms").at("best").get<double>());
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
