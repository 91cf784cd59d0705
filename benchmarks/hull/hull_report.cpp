#include "benchmarks/hull/hull_report.h"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <sstream>

#include "common/base/result_file.h"
#include "common/base/timing.h"

namespace fivepipe::hull_bench {
namespace {

double best(const Result& r) { return base::percentile(r.time_ms, 0); }

}  // namespace

std::string Result::name() const {
  return method + "/" + scene + "/" + std::to_string(width_px) + "x" + std::to_string(height_px) +
         "/" + std::to_string(threads);
}

std::uint64_t checksum(std::span<const float> depths) {  // FNV-1a over the bits
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const float d : depths) {
    std::uint32_t bits;
    std::memcpy(&bits, &d, sizeof bits);
    for (int shift = 0; shift < 32; shift += 8)
      hash = (hash ^ (bits >> shift & 0xff)) * 0x100000001b3;
  }
  return hash;
}

void print(const std::vector<Result>& results) {
  std::printf("%-34s %8s %8s %8s %4s | %9s %9s %9s %9s %9s %5s %5s %6s %6s | %8s %8s\n",
              "method/scene/view/threads", "ms best", "median", "p99", "runs", "mm mean", "median",
              "p99", "p99.9", "max", "+hit", "-hit", "-piece", "other", "surface", "footpr.");
  for (const Result& r : results) {
    const Errors& e = r.errors;
    std::printf(
        "%-34s %8.3f %8.3f %8.3f %4zu | %9.5f %9.5f %9.5f %9.5f %9.5f %5d %5d %6d %6d | %8.3f "
        "%8.3f\n",
        r.name().c_str(), best(r), base::percentile(r.time_ms, 0.5),
        base::percentile(r.time_ms, 0.99), r.time_ms.size(), base::mean(e.depth_mm),
        base::percentile(e.depth_mm, 0.5), base::percentile(e.depth_mm, 0.99),
        base::percentile(e.depth_mm, 0.999), base::percentile(e.depth_mm, 1), e.wrong_hits,
        e.wrong_misses, e.wrong_pieces, e.other_pixels, base::percentile(e.surface_mm, 0.5),
        r.footprint_mm);
  }
  std::puts(
      "mm: depth against the exact hull of the same maps, by the independent reference on seeded "
      "rays; +hit -hit: rays that hit or miss wrongly; -piece: rays that pass\n"
      "through the hull's first piece and hit one further behind (in none of the figures); other: "
      "pixels of the whole view with another verdict than backend cpu's (exact\n"
      "methods); surface: median against the hull of the true silhouettes, beside the width of a "
      "map's pixel at the object. Everything from packed maps to depth is timed.");
}

void print_ratios(const std::vector<Result>& results) {
  struct Baseline {
    const char* prefix;
    bool only_fair;
  };
  std::printf(
      "\n%-30s %10s | times as long as cpu: best setting with mean error <= %g mm (best of runs)\n",
      "scene/view/threads", "cpu ms", kFairError_mm);
  for (const Result& ours : results) {
    if (ours.method != "cpu") continue;
    std::string line;
    for (const auto& [prefix, only_fair] : {Baseline{"ibvh", false},
                                            {"cpusweep", true},
                                            {"plainsweep", true},
                                            {"carve", true},
                                            {"glsweep", true},
                                            {"gl", false}}) {
      const Result* cheapest = nullptr;
      for (const Result& r : results) {
        const bool of_kind =
            r.method.starts_with(prefix) && !(std::strcmp(prefix, "gl") == 0 && r.method != "gl");
        if (!of_kind || r.scene != ours.scene || r.width_px != ours.width_px ||
            r.threads != ours.threads)
          continue;
        if (only_fair && base::mean(r.errors.depth_mm) > kFairError_mm) continue;
        if (!cheapest || best(r) < best(*cheapest)) cheapest = &r;
      }
      if (!cheapest) continue;
      char text[64];
      std::snprintf(text, sizeof text, "  %s %.2f", cheapest->method.c_str(),
                    best(*cheapest) / best(ours));
      line += text;
    }
    if (!line.empty())
      std::printf("%-30s %10.3f |%s\n", ours.name().substr(4).c_str(), best(ours), line.c_str());
  }
}

std::string json_of(const std::vector<Result>& results, const std::string& renderer) {
  std::vector<std::string> lines;
  for (const Result& r : results) {
    const Errors& e = r.errors;
    std::ostringstream out;
    out << "  {\"name\": " << base::quoted(r.name())
        << ", \"time_ms\": " << base::times_json(r.time_ms)
        << ",\n   \"error\": {\"depth_mean_mm\": " << base::mean(e.depth_mm)
        << ", \"depth_median_mm\": " << base::percentile(e.depth_mm, 0.5)
        << ", \"depth_p99_mm\": " << base::percentile(e.depth_mm, 0.99)
        << ", \"depth_p999_mm\": " << base::percentile(e.depth_mm, 0.999)
        << ", \"depth_max_mm\": " << base::percentile(e.depth_mm, 1)
        << ", \"depth_any_piece_p99_mm\": " << base::percentile(e.all_mm, 0.99)
        << ", \"other_depth_relative\": " << e.other_depth
        << ", \"surface_median_mm\": " << base::percentile(e.surface_mm, 0.5)
        << ", \"surface_p95_mm\": " << base::percentile(e.surface_mm, 0.95)
        << ", \"pixel_footprint_mm\": " << r.footprint_mm
        << "},\n   \"counts\": {\"cameras\": " << r.cameras << ", \"hits\": " << r.hits
        << ", \"reference_rays\": " << e.rays << ", \"reference_hits\": " << e.reference_hits
        << ", \"wrong_hits\": " << e.wrong_hits << ", \"wrong_misses\": " << e.wrong_misses
        << ", \"wrong_pieces\": " << e.wrong_pieces << ", \"other_pixels\": " << e.other_pixels
        << ", \"maps_covered_percent\": " << 100 * r.maps_covered << "}, \"checksum\": \""
        << std::hex << r.checksum << "\"}";
    lines.push_back(out.str());
  }
  return base::suite_json("hull", renderer, lines);
}

}  // namespace fivepipe::hull_bench
