#include <fmt/format.h>

#include <ctime>
#include <iostream>
#include <thread>

#include "common/base/machine.h"
#include "common/base/process/progress_line.h"
#include "common/base/usage_error.h"
#include "common/base/version.h"
#include "common/study/report/html_sections.h"
#include "common/study/report/page.h"
#include "launch/study/commands.h"
#include "launch/study/folder/study_lock.h"
#include "launch/study/results/scene_parts.h"
#include "launch/study/results/trial_results.h"

namespace fivepipe::study {
namespace {

struct ReportOptions {
  std::filesystem::path folder;
  TrialRequest request;
  bool without_pictures = false, without_swept = false;
};

std::string today() {
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  localtime_r(&now, &local);
  return fmt::format("{:04}-{:02}-{:02}", local.tm_year + 1900, local.tm_mon + 1, local.tm_mday);
}

report::Participant& participant_of(report::Study& shown, const StoredTrial& trial) {
  for (report::Participant& known : shown.participants)
    if (known.pseudonym == trial.participant) return known;
  return shown.participants.emplace_back(report::Participant{trial.participant, trial.kind});
}

// The trials as they are now. A trial that runs, and edits, go on meanwhile.
std::vector<StoredTrial> trials_of(const StudyFolder& study) {
  const StudyLock lock(study.path(), "report", {StudyPart::trials});
  return study.trials();
}

// Certified, so rounded up, as in the page.
std::string min_free_text(const report::WhatIfCurve& curve) {
  const auto least_m = curve.min_free_m();
  return least_m ? report::cm_at_most(*least_m) + " cm" : "none";
}

int run_report(ReportOptions options) {
  const StudyFolder study(options.folder);
  const StudyLock lock(study.path(), "report", {StudyPart::report});
  const std::vector<StoredTrial> trials = trials_of(study);
  if (trials.empty())
    throw base::UsageError(
        fmt::format("{} has no trial yet; run one by: fivepipe study run {} "
                    "--participant P1",
                    options.folder.string(), options.folder.string()));
  options.request.pictures = !options.without_pictures;
  options.request.swept = !options.without_swept;
  const config::Deployment deployment = study.deployment();
  report::Study shown;
  shown.name = study.settings().name;
  shown.date = today();
  shown.version = base::version();
  shown.machine = fmt::format("{}, {} cores", base::cpu_name(), base::core_count());
  shown.rig = deployment.rig.name;
  shown.scene = deployment.scene.name;
  shown.spacing_of = study.settings().spacing_of;
  {
    base::ProgressLine progress("report");
    for (std::size_t i = 0; i < trials.size(); ++i) {
      const StoredTrial& trial = trials[i];
      report::Participant& participant = participant_of(shown, trial);
      const auto of_all = [&](double done) {
        progress((double(i) + done) / double(trials.size()));
      };
      const report::Trial& found = participant.trials.emplace_back(
          trial_results(study, trial, options.request, of_all, shown));
      if (found.scene && !are_equal(shown.scenes[*found.scene], report_parts(deployment.scene)))
        shown.remarks.push_back(
            fmt::format("Trial {}: the study's scene was changed after the trial was recorded. All "
                        "that is shown of the trial is of the recorded scene.",
                        trial.number));
    }
  }
  report::write_report(shown, study.report_folder());
  for (const std::string& remark : shown.remarks) std::cerr << "warning: " << remark << '\n';
  for (const report::Participant& participant : shown.participants)
    for (const report::Trial& trial : participant.trials)
      for (const report::WhatIfCurve& curve : trial.what_if)
        std::cout << fmt::format("trial {}: {}: minimum spacing above which all are free: {}\n",
                                 trial.number, curve.part, min_free_text(curve));
  std::cout << (study.report_folder() / "report.html").string() << '\n';
  return 0;
}

}  // namespace

void add_report(CLI::App& app, Command& command) {
  const auto options = std::make_shared<ReportOptions>();
  options->request.threads = std::max(1, int(std::thread::hardware_concurrency()));
  CLI::App* const sub = app.add_subcommand(
      "report",
      "Computes each trial and writes report/report.html, one page without other files, and "
      "tables (CSV)");
  sub->footer(
      "Examples:\n"
      "  fivepipe study report spacing\n"
      "  fivepipe study report spacing --layouts 100 --no-swept\n\n"
      "A recording that cannot be used is named in the page and on stderr.\n"
      "Exit codes: 0 done, 1 a file cannot be written, 2 usage or configuration.");
  sub->add_option("folder", options->folder, "folder of the study")->required();
  sub->add_option("--layouts", options->request.layouts,
                  "spacings per curve, at equal distances in the range of the part (default 25)")
      ->check(CLI::Range(1, 1000));
  sub->add_flag("--no-pictures", options->without_pictures, "no picture of each collision");
  sub->add_flag("--no-swept", options->without_swept, "no swept volume");
  sub->add_option("--threads", options->request.threads, "threads (default: one per core)")
      ->check(CLI::Range(1, 1024));
  sub->callback([=, &command] { command = [=] { return run_report(*options); }; });
}

}  // namespace fivepipe::study
