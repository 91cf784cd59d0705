#include <fmt/format.h>

#include <algorithm>
#include <iostream>

#include "common/base/realtime.h"
#include "common/base/text_table.h"
#include "common/base/usage_error.h"
#include "launch/study/commands.h"
#include "launch/study/folder/study_folder.h"
#include "launch/study/questions.h"
#include "launch/units/length.h"

namespace fivepipe::study {
namespace {

struct EditOptions {
  std::filesystem::path folder;
  int trial = 0;  // 0: the newest one
  AnswerOptions answers;
  std::optional<std::string> tool;
  std::vector<std::string> notes;
  std::optional<std::string> discard;
  bool keep = false;
};

int run_edit(const EditOptions& options) {
  const StudyFolder study(options.folder);
  std::vector<std::string> texts = options.notes;
  texts.push_back(options.tool.value_or(""));
  texts.push_back(options.discard.value_or(""));
  if (!std::ranges::all_of(texts, is_utf8)) throw base::UsageError("a text is not UTF-8");
  if (options.discard && options.discard->empty())
    throw base::UsageError("--discard: state the reason");
  const std::vector<StoredTrial> trials = study.trials();
  if (trials.empty()) throw base::UsageError(options.folder.string() + " has no trial yet");
  const int number = options.trial == 0 ? trials.back().number : options.trial;
  study.change(number, "edit", [&](StoredTrial& trial) {
    take_answers(options.answers, trial.answers);
    if (options.tool) trial.tool = *options.tool;
    const std::int64_t now_ns = base::now_realtime_ns();
    if (options.tool && trial.state == TrialState::running)
      trial.notes.push_back({now_ns, "tool: " + (options.tool->empty() ? "none" : *options.tool)});
    for (const std::string& note : options.notes) trial.notes.push_back({now_ns, note});
    if (options.discard) {
      trial.state = TrialState::discarded;
      trial.discarded_because = *options.discard;
    } else if (options.keep) {
      trial.state = TrialState::kept;
      trial.discarded_because.clear();
    }
  });
  std::cout << fmt::format("trial {} is changed\n", number);
  return 0;
}

std::string text_of(const std::optional<report::Answer>& answer) {
  if (!answer) return "-";
  const std::string low = text_of_length(answer->low_m);
  return answer->high_m ? low + " to " + text_of_length(*answer->high_m) : low;
}

int run_list(const std::filesystem::path& folder) {
  const StudyFolder study(folder);
  base::TextTable table({{"trial", true},
                         {"participant"},
                         {"state"},
                         {"tool"},
                         {"necessary", true},
                         {"allocated", true},
                         {"found", true},
                         {"allocated after", true}});
  for (const StoredTrial& trial : study.trials())
    table.add({std::to_string(trial.number), base::printable(trial.participant),
               trial.state == TrialState::kept        ? "kept"
               : trial.state == TrialState::discarded ? "discarded"
                                                      : "running or interrupted",
               trial.tool.empty() ? "-" : base::printable(trial.tool),
               text_of(trial.answers.necessary_before), text_of(trial.answers.allocated_before),
               text_of(trial.answers.found), text_of(trial.answers.allocated_after)});
  std::cout << base::printable(study.settings().name) << '\n' << table.text();
  return 0;
}

int run_forget(const std::filesystem::path& folder, const std::string& participant) {
  StudyFolder study(folder);
  const Forgotten forgotten = study.forget(participant);
  std::cout << (forgotten.trials == 0
                    ? fmt::format("{} has no trial of the participant\n", folder.string())
                    : fmt::format("removed: {} trials with their recordings, and the report; make "
                                  "it again by: fivepipe study report {}\n",
                                  forgotten.trials, folder.string()));
  for (const std::filesystem::path& file : forgotten.mentioned_in)
    std::cerr << fmt::format("{} still has the text {} in its name or content\n", file.string(),
                             base::printable(participant));
  for (const std::filesystem::path& file : forgotten.unknown)
    std::cerr << fmt::format(
        "{} is not of the study and may hold frames of the participant: look at it, and remove "
        "it\n",
        file.string());
  return forgotten.mentioned_in.empty() && forgotten.unknown.empty() ? 0 : 1;
}

}  // namespace

void add_edit(CLI::App& app, Command& command) {
  const auto options = std::make_shared<EditOptions>();
  CLI::App* const sub = app.add_subcommand(
      "edit", "Changes a trial, also while it runs: answers, tool, notes, discarded or kept");
  sub->footer(
      "Examples:\n"
      "  fivepipe study edit spacing --note \"asks for more space\"\n"
      "  fivepipe study edit spacing --trial 3 --found 22.5cm --tool tongs\n"
      "  fivepipe study edit spacing --trial 2 --discard \"a camera was covered\"\n\n"
      "Exit codes: 0 done, 2 usage.");
  sub->add_option("folder", options->folder, "folder of the study")->required();
  sub->add_option("--trial", options->trial, "number of the trial (default: the newest one)")
      ->check(CLI::PositiveNumber);
  add_answer_options(*sub, options->answers);
  sub->add_option("--tool", options->tool, "tool in use from now on; empty: none");
  sub->add_option("--note", options->notes, "adds a note with the present time")
      ->allow_extra_args(false);
  CLI::Option* const discard =
      sub->add_option("--discard", options->discard, "discards the trial, for this reason");
  sub->add_flag("--keep", options->keep, "keeps a trial that was discarded or interrupted")
      ->excludes(discard);
  sub->callback([=, &command] { command = [=] { return run_edit(*options); }; });
}

void add_list(CLI::App& app, Command& command) {
  const auto folder = std::make_shared<std::filesystem::path>();
  CLI::App* const sub = app.add_subcommand("list", "Lists the trials of a study");
  sub->footer("Example:\n  fivepipe study list spacing");
  sub->add_option("folder", *folder, "folder of the study")->required();
  sub->callback([=, &command] { command = [=] { return run_list(*folder); }; });
}

void add_forget(CLI::App& app, Command& command) {
  const auto folder = std::make_shared<std::filesystem::path>();
  const auto participant = std::make_shared<std::string>();
  CLI::App* const sub = app.add_subcommand(
      "forget", "Removes a participant's trials and recordings from the study, and the report");
  sub->footer(
      "Example:\n  fivepipe study forget spacing --participant P1\n\n"
      "Exit codes: 0 done, 1 another file still has the pseudonym or may hold the participant's "
      "frames, 2 usage.");
  sub->add_option("folder", *folder, "folder of the study")->required();
  sub->add_option("--participant", *participant, "pseudonym")->required();
  sub->callback([=, &command] { command = [=] { return run_forget(*folder, *participant); }; });
}

}  // namespace fivepipe::study
