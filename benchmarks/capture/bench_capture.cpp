// fivepipe bench capture: accuracy and speed of segmentation on sequences whose object pixels are
// known, beside other methods.
#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <opencv2/core/utility.hpp>

#include "benchmarks/capture/coverage_report.h"
#include "benchmarks/capture/methods.h"
#include "benchmarks/capture/real_footage.h"
#include "benchmarks/capture/scores.h"
#include "benchmarks/capture/sequences.h"
#include "benchmarks/capture/step_report.h"
#include "benchmarks/support/suite.h"
#include "common/base/result_file.h"
#include "common/base/text_table.h"
#include "common/base/timing.h"
#include "common/base/worker_pool.h"

namespace fivepipe::capture_bench {
namespace {

struct Size {
  int width_px, height_px;
};
constexpr Size kPaperSize{720, 486}, kQuickSize{180, 122};

// One setting and one cleaning of a method.
struct Choice {
  const Method* method;
  std::size_t setting, cleaning;
  std::string text() const {
    return method->settings[setting].text + method->cleanings[cleaning].text();
  }
};

std::vector<Choice> all_choices(const Method& method) {
  std::vector<Choice> choices;
  for (std::size_t setting = 0; setting < method.settings.size(); ++setting)
    for (std::size_t cleaning = 0; cleaning < method.cleanings.size(); ++cleaning)
      choices.push_back({&method, setting, cleaning});
  return choices;
}

// Scores of choices, by their index, on one sequence.
std::vector<Score> scores_of(const std::vector<Choice>& choices, const Sequence& sequence) {
  std::vector<Score> scores(choices.size());
  for (std::size_t first = 0, end; first < choices.size(); first = end) {
    // Choices that differ only in their cleaning share what they have learned.
    const Choice& choice = choices[first];
    for (end = first + 1; end < choices.size() && choices[end].method == choice.method &&
                          choices[end].setting == choice.setting;)
      ++end;
    const auto learned = choice.method->settings[choice.setting].learn(sequence.learning);
    for (std::size_t i = 0; i < sequence.images.size(); ++i) {
      const hull::ObjectPixels raw = learned->segment(sequence.images[i]);
      for (std::size_t c = first; c < end; ++c)
        scores[c].add(cleaned(raw, choice.method->cleanings[choices[c].cleaning]),
                      sequence.truth[i]);
    }
  }
  return scores;
}

// Scores by sequence (disturbance, then seed) and by choice.
template <std::size_t seeds>
std::vector<std::vector<Score>> on_sequences(const std::vector<Choice>& choices,
                                             const std::array<std::uint64_t, seeds>& all_seeds,
                                             const char* what, const bench::Args& args) {
  const std::size_t used = args.quick ? 1 : seeds, count = kDisturbances.size() * used;
  const Size size = args.quick ? kQuickSize : kPaperSize;
  std::vector<std::vector<Score>> scores(count);
  std::mutex mutex;
  std::size_t done = 0;
  base::WorkerPool(args.threads).run(int(count), [&](int i, int) {
    const auto index = std::size_t(i);
    scores[index] =
        scores_of(choices, sequence(kDisturbances[index / used], all_seeds[index % used],
                                    size.width_px, size.height_px));
    const std::lock_guard lock(mutex);
    std::cerr << fmt::format("\rbench capture: {}, {} of {} sequences ", what, ++done, count)
              << std::flush;
  });
  std::cerr << '\n';
  return scores;
}

// The mean over the seeds, by disturbance.
using ByDisturbance = std::array<double, kDisturbances.size()>;
template <class Value>
ByDisturbance by_disturbance(const std::vector<std::vector<Score>>& scores, std::size_t choice,
                             Value value) {
  ByDisturbance means{};
  const std::size_t seeds = scores.size() / means.size();
  for (std::size_t i = 0; i < scores.size(); ++i)
    means[i / seeds] += value(scores[i][choice]) / double(seeds);
  return means;
}
double mean_of(const ByDisturbance& values) {
  return base::mean(std::vector<double>(values.begin(), values.end()));
}

// Returns the choice of each method with the highest mean F1 over the tuning sequences.
std::vector<Choice> tuned(const std::vector<Method>& all, const bench::Args& args) {
  std::vector<Choice> choices;
  for (const Method& method : all)
    for (const Choice& choice : all_choices(method)) choices.push_back(choice);
  const auto scores = on_sequences(choices, kTuningSeeds, "tuning", args);
  std::vector<Choice> best;
  double best_f1 = 0;
  for (std::size_t c = 0; c < choices.size(); ++c) {
    const double f1 =
        mean_of(by_disturbance(scores, c, [](const Score& score) { return score.f1(); }));
    if (best.empty() || best.back().method != choices[c].method) {
      best.push_back(choices[c]);
      best_f1 = f1;
    } else if (f1 > best_f1) {
      best.back() = choices[c];
      best_f1 = f1;
    }
  }
  return best;
}

// The methods alternate after this many consecutive images, as a camera sends them; the first of
// them warms the caches and does not count.
constexpr int kConsecutive = 9;

// Milliseconds per image, by choice; the last row is fivepipe with a lens. One thread.
std::vector<std::vector<double>> times_ms(const std::vector<Choice>& choices,
                                          const bench::Args& args) {
  const Size size = args.quick ? kQuickSize : kPaperSize;
  const Sequence noise =
      sequence(Disturbance::noise, kMeasuredSeeds[0], size.width_px, size.height_px);
  std::vector<std::unique_ptr<Learned>> learned;
  for (const Choice& choice : choices)
    learned.push_back(choice.method->settings[choice.setting].learn(noise.learning));
  learned.push_back(learn_distorted(noise.learning));
  std::vector<std::vector<double>> times(learned.size());
  std::vector<std::size_t> next(learned.size(), 0);
  const int runs = args.quick ? 1 : 25;
  base::time_round_robin(learned.size(), {runs, runs, 0}, [&](std::size_t i, bool counted) {
    double sum_ms = 0;
    for (int k = 0; k < kConsecutive; ++k) {
      const cv::Mat& image = noise.images[next[i]++ % noise.images.size()];
      const auto start = std::chrono::steady_clock::now();
      hull::ObjectPixels pixels = learned[i]->segment(image);
      if (i < choices.size())
        pixels = cleaned(std::move(pixels), choices[i].method->cleanings[choices[i].cleaning]);
      const double ms = 1e3 * base::seconds_since(start);
      if (counted && k > 0) times[i].push_back(ms);
      sum_ms += ms;
    }
    return sum_ms;
  });
  return times;
}

template <class Value>
void print_table(const char* what, const std::vector<Choice>& choices,
                 const std::vector<std::vector<Score>>& scores, int decimals, Value value) {
  std::vector<base::TextTable::Column> columns{{what}};
  for (const Disturbance disturbance : kDisturbances)
    columns.push_back({name_of(disturbance), true});
  columns.push_back({"mean", true});
  base::TextTable table(columns);
  for (std::size_t c = 0; c < choices.size(); ++c) {
    const ByDisturbance values = by_disturbance(scores, c, value);
    std::vector<std::string> cells{choices[c].method->name};
    for (const double v : values) cells.push_back(base::with_decimals(v, decimals));
    cells.push_back(base::with_decimals(mean_of(values), decimals));
    table.add(cells);
  }
  std::cout << table.text() << '\n';
}

void print_times(const std::vector<Choice>& choices,
                 const std::vector<std::vector<double>>& times) {
  const double own_ms = base::percentile(times.back(), 0.5);
  base::TextTable table({{"time of consecutive images, one thread"},
                         {"median ms", true},
                         {"p95 ms", true},
                         {"to fivepipe with a lens", true},
                         {"settings"}});
  for (std::size_t i = 0; i < times.size(); ++i) {
    const bool has_lens = i == choices.size();
    table.add({has_lens ? "fivepipe with a lens" : choices[i].method->name,
               base::with_decimals(base::percentile(times[i], 0.5), 3),
               base::with_decimals(base::percentile(times[i], 0.95), 3),
               base::with_decimals(base::percentile(times[i], 0.5) / own_ms, 1),
               has_lens ? "defaults, distortion removed" : choices[i].text()});
  }
  std::cout << table.text();
}

nlohmann::ordered_json json_of(const std::vector<Choice>& choices,
                               const std::vector<std::vector<Score>>& scores,
                               const std::vector<std::vector<double>>& times) {
  nlohmann::ordered_json results = nlohmann::ordered_json::array();
  for (std::size_t c = 0; c < choices.size(); ++c) {
    nlohmann::ordered_json error;
    const auto add = [&](const char* name, auto value) {
      const ByDisturbance values = by_disturbance(scores, c, value);
      for (std::size_t d = 0; d < values.size(); ++d)
        error[fmt::format("{}_{}", name, name_of(kDisturbances[d]))] = values[d];
    };
    add("one_minus_f1", [](const Score& score) { return 1 - score.f1(); });
    add("one_minus_iou", [](const Score& score) { return 1 - score.iou(); });
    add("boundary_px", [](const Score& score) { return score.boundary_error_px(); });
    results.push_back({{"name", "capture/" + choices[c].method->name},
                       {"time_ms", base::times_json(times[c])},
                       {"error", error},
                       {"settings", choices[c].text()}});
  }
  results.push_back(
      {{"name", "capture/fivepipe_lens"}, {"time_ms", base::times_json(times.back())}});
  return results;
}

constexpr bench::Suite kSuite{
    .name = "capture",
    .description =
        "Measures segmentation, from the camera's image to the packed object pixels, on synthetic "
        "sequences with known object pixels: sensor noise, shadow, flicker, exposure drift, "
        "camouflage, a waving background, and passers-by while the background is learned. Beside "
        "fivepipe: MOG2 and KNN of OpenCV, the difference to one image, and to the median. Each "
        "method has one setting for all sequences: fivepipe its defaults, which were chosen on "
        "other seeds, and each other method the one with the highest mean F1 on those seeds, which "
        "the benchmark searches first. F1 and IoU: 1 is perfect. Boundary: mean distance of "
        "the outlines. Then what each step of segmentation misses and removes, and the depth of "
        "the "
        "hull with and without sub-pixel silhouettes. Takes several minutes.",
    .example = "fivepipe bench capture --footage recordings/seated4cam --json out/capture.json",
    .only_help =
        "only methods whose name contains this text, such as mog2; fivepipe is always "
        "measured",
    .footage_help =
        "folder of the recording seated4cam or balance4cam: compares fivepipe also with "
        "outlines that were drawn by hand in its images; may be repeated"};

void run(const bench::Args& args) {
  cv::setNumThreads(1);
  std::vector<Method> all = methods(args.quick);
  std::erase_if(all, [&](const Method& method) {
    return method.name != "fivepipe" && method.name.find(args.only) == std::string::npos;
  });
  const Size size = args.quick ? kQuickSize : kPaperSize;
  std::cout << base::machine_line("") << '\n'
            << fmt::format("{}x{}, {} learning images, {} images per sequence", size.width_px,
                           size.height_px, kLearningImages, kImages)
            << std::endl;
  nlohmann::ordered_json of_footage = nlohmann::ordered_json::array();
  for (const std::string& folder : args.footage) {
    const nlohmann::ordered_json of_folder = measure_footage(folder);
    of_footage.insert(of_footage.end(), of_folder.begin(), of_folder.end());
  }
  const std::vector<Choice> choices = tuned(all, args);
  const auto scores = on_sequences(choices, kMeasuredSeeds, "measuring", args);
  const auto times = times_ms(choices, args);
  print_table("F1", choices, scores, 4, [](const Score& score) { return score.f1(); });
  print_table("IoU", choices, scores, 4, [](const Score& score) { return score.iou(); });
  print_table("recall", choices, scores, 4, [](const Score& score) { return score.recall(); });
  print_table("boundary, px", choices, scores, 2,
              [](const Score& score) { return score.boundary_error_px(); });
  print_times(choices, times);
  std::cout << '\n';
  const nlohmann::ordered_json of_steps = report_steps(size.width_px, size.height_px, args.threads);
  const nlohmann::ordered_json of_coverage = report_coverage(args.quick);
  if (!args.json_file.empty()) {
    nlohmann::ordered_json results = json_of(choices, scores, times);
    results.insert(results.end(), of_steps.begin(), of_steps.end());
    results.insert(results.end(), of_footage.begin(), of_footage.end());
    results.insert(results.end(), of_coverage.begin(), of_coverage.end());
    base::write_json(args.json_file, base::suite_json("capture", "", results));
  }
}

}  // namespace
}  // namespace fivepipe::capture_bench

int main(int argc, char** argv) {
  return fivepipe::bench::run_suite(fivepipe::capture_bench::kSuite, argc, argv,
                                    fivepipe::capture_bench::run);
}
