#include "benchmarks/capture/step_report.h"

#include <fmt/format.h>

#include <iostream>
#include <vector>

#include "capture_node/segmentation/segmentation.h"
#include "common/base/result_file.h"
#include "common/base/text_table.h"
#include "common/base/timing.h"
#include "common/base/worker_pool.h"

namespace fivepipe::capture_bench {
namespace {

struct Variant {
  const char* name;
  config::SegmentationConfig config;
};

std::vector<Variant> variants() {
  std::vector<Variant> all;
  const auto add = [&](const char* name, auto change) {
    all.push_back({name, {}});
    change(all.back().config);
  };
  using Config = config::SegmentationConfig;
  add("the defaults", [](Config&) {});
  add("gain_compensation: false", [](Config& c) { c.gain_compensation = false; });
  add("jitter_px: 0", [](Config& c) { c.jitter_px = 0; });
  add("moving_boxes: 0", [](Config& c) { c.moving_boxes = 0; });
  add("shadow_min_brightness: 1", [](Config& c) { c.shadow_min_brightness = 1; });
  add("hysteresis: 1", [](Config& c) { c.hysteresis = 1; });
  add("min_object_px: 0", [](Config& c) { c.min_object_px = 0; });
  add("max_hole_px: 0", [](Config& c) { c.max_hole_px = 0; });
  add("opening_px: 2", [](Config& c) { c.opening_px = 2; });
  add("conservative: true", [](Config& c) { c.conservative = true; });
  return all;
}

// The value of each sequence as "MEAN (WORST in SEQUENCE)".
template <class Value>
std::string mean_and_worst(const std::vector<PixelErrors>& errors, int decimals, Value value) {
  std::size_t worst = 0;
  double sum = 0;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    sum += value(errors[i]);
    if (value(errors[i]) > value(errors[worst])) worst = i;
  }
  return fmt::format("{} ({} in {})", base::with_decimals(sum / double(errors.size()), decimals),
                     base::with_decimals(value(errors[worst]), decimals),
                     name_of(kDisturbances[worst]));
}

}  // namespace

PixelErrors errors_of(const config::SegmentationConfig& config, const Sequence& sequence) {
  capture::Segmenter segmenter(
      capture::learn_background(sequence.learning, capture::learning_settings(config)), config);
  double true_px = 0, found_px = 0, both_px = 0;
  for (std::size_t i = 0; i < sequence.images.size(); ++i) {
    const hull::ObjectPixels found = segmenter.segment(sequence.images[i])->object;
    true_px += double(sequence.truth[i].count());
    found_px += double(found.count());
    both_px += double(found.count_common(sequence.truth[i]));
  }
  return {1 - both_px / true_px, (found_px - both_px) / double(sequence.images.size())};
}

nlohmann::ordered_json report_steps(int width_px, int height_px, int threads) {
  const std::vector<Variant> all = variants();
  // By variant and disturbance.
  std::vector<std::vector<PixelErrors>> errors(all.size(),
                                               std::vector<PixelErrors>(kDisturbances.size()));
  base::WorkerPool(threads).run(int(kDisturbances.size()), [&](int i, int) {
    const Sequence images =
        sequence(kDisturbances[std::size_t(i)], kMeasuredSeeds[0], width_px, height_px);
    for (std::size_t v = 0; v < all.size(); ++v)
      errors[v][std::size_t(i)] = errors_of(all[v].config, images);
  });
  nlohmann::ordered_json results = nlohmann::ordered_json::array();
  base::TextTable table({{"step of segmentation"},
                         {"missed object pixels, %", true},
                         {"false pixels per image", true}});
  for (std::size_t v = 0; v < all.size(); ++v) {
    table.add({all[v].name,
               mean_and_worst(errors[v], 2,
                              [](const PixelErrors& of) { return 100 * of.missed_fraction; }),
               mean_and_worst(errors[v], 0, [](const PixelErrors& of) { return of.false_px; })});
    nlohmann::ordered_json error;
    for (std::size_t d = 0; d < kDisturbances.size(); ++d) {
      error["missed_" + name_of(kDisturbances[d])] = errors[v][d].missed_fraction;
      error["false_px_" + name_of(kDisturbances[d])] = errors[v][d].false_px;
    }
    results.push_back({{"name", std::string("capture/steps/") + all[v].name},
                       {"time_ms", base::times_json({})},
                       {"error", error}});
  }
  std::cout << table.text() << '\n';
  return results;
}

}  // namespace fivepipe::capture_bench
