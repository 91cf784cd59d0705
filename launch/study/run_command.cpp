#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <iostream>
#include <system_error>

#include "common/base/realtime.h"
#include "common/base/usage_error.h"
#include "launch/study/commands.h"
#include "launch/study/folder/study_folder.h"
#include "launch/study/folder/study_lock.h"
#include "launch/study/questions.h"
#include "launch/supervise/own_files.h"

namespace fivepipe::study {
namespace {

struct RunOptions {
  std::filesystem::path folder;
  std::string participant;
  int resume = 0;  // number of the trial; 0: a new one
  std::string tool;
  AnswerOptions answers;
  bool asks = true;
  std::string duration, domain;  // for `fivepipe up`; empty: its default
};

// Whether each camera of the deployment is synthetic, so that the real objects are scripted.
bool is_scripted(const config::Deployment& deployment) {
  for (const config::Node& node : deployment.nodes)
    if (const auto* capture = std::get_if<config::CaptureConfig>(&node.config))
      for (const auto& [camera, source] : capture->sources)
        if (!std::holds_alternative<config::SyntheticSource>(source)) return false;
  return true;
}

volatile pid_t forwarded_to = 0;
void forward(int signal) {
  if (forwarded_to > 0) kill(forwarded_to, signal);
}

// Runs a program until it ends, with the output of this one. Forwards the signals that end a
// program, each once: a terminal would send them to both.
int run_program(std::vector<std::string> words) {
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  constexpr std::array kSignals{SIGINT, SIGTERM, SIGHUP};
  struct sigaction forwards {};
  forwards.sa_handler = forward;
  std::array<struct sigaction, kSignals.size()> before{};
  const pid_t parent = getpid(), child = fork();
  if (child == 0) {
    setpgid(0, 0);
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != parent) _exit(1);
    execv(argv.front(), argv.data());
    _exit(127);
  }
  if (child < 0) throw std::system_error(errno, std::generic_category(), argv.front());
  forwarded_to = child;
  for (std::size_t i = 0; i < kSignals.size(); ++i) sigaction(kSignals[i], &forwards, &before[i]);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
  forwarded_to = 0;
  for (std::size_t i = 0; i < kSignals.size(); ++i) sigaction(kSignals[i], &before[i], nullptr);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

StoredTrial begun(StudyFolder& study, const RunOptions& options) {
  if (options.resume == 0)
    return study.add_trial(options.participant, is_scripted(study.deployment())
                                                    ? report::ParticipantKind::scripted
                                                    : report::ParticipantKind::human);
  const StoredTrial trial = study.trial(options.resume);
  if (!options.participant.empty() && options.participant != trial.participant)
    throw base::UsageError(
        fmt::format("--resume: trial {} is of another participant", options.resume));
  return trial;
}

// asked: the answers before the trial.
void set_running(StoredTrial& trial, const RunOptions& options, const report::Answers& asked,
                 const std::string& recording) {
  trial.state = TrialState::running;
  trial.discarded_because.clear();
  if (!options.tool.empty()) trial.tool = options.tool;
  take_answers(options.answers, trial.answers);
  if (asked.necessary_before) trial.answers.necessary_before = asked.necessary_before;
  if (asked.allocated_before) trial.answers.allocated_before = asked.allocated_before;
  trial.recordings.push_back(recording);
}

int run_trial(const RunOptions& options) {
  StudyFolder study(options.folder);
  if (options.resume == 0 && options.participant.empty())
    throw base::UsageError("name the participant by a pseudonym: --participant P1");
  report::Answers answers;
  take_answers(options.answers, answers);  // throws before there is a trial
  if (!is_utf8(options.tool)) throw base::UsageError("--tool: the text is not UTF-8");
  const StudyLock lock(study.path(), "run", {StudyPart::run});
  StoredTrial trial = begun(study, options);
  const StoredTrial before = trial;
  const int number = trial.number;
  const auto change = [&](const std::function<void(StoredTrial&)>& what) {
    trial = study.change(number, "run", what);
  };
  const Questions questions(options.asks);
  const int part = int(trial.recordings.size()) + 1;
  const std::string recording = fmt::format("recording_{}.mcap", part);
  const std::filesystem::path folder = study.folder_of(number);
  answers = trial.answers;
  take_answers(options.answers, answers);
  questions.before(answers);
  change([&](StoredTrial& stored) { set_running(stored, options, answers, recording); });
  std::cout << fmt::format("trial {}: the participant may begin; Ctrl-C ends it\n", number)
            << std::flush;

  std::vector<std::string> words{launch::program_folder() / "fivepipe",
                                 "up",
                                 study.deployment_file(),
                                 "--record",
                                 folder / recording,
                                 "--out",
                                 folder / fmt::format("run_{}", part)};
  for (const auto& [key, value] : study.settings().settings)
    words.insert(words.end(), {"--set", key + "=" + value});
  if (!options.duration.empty()) words.insert(words.end(), {"--duration", options.duration});
  if (!options.domain.empty()) words.insert(words.end(), {"--domain", options.domain});
  constexpr int kInterrupted = 130;
  const int code = run_program(words);

  if (!std::filesystem::exists(folder / recording)) {
    std::cerr << fmt::format("trial {}: nothing was recorded\n", number);
    if (before.recordings.empty())
      study.remove(number);
    else
      change([&](StoredTrial& stored) {
        stored.state = before.state;
        stored.discarded_because = before.discarded_because;
        stored.recordings = before.recordings;
      });
    return code == 0 ? 1 : code;
  }
  if (code != 0 && code != kInterrupted)
    std::cerr << fmt::format("trial {}: `fivepipe up` ended with exit code {}, see {}\n", number,
                             code, (folder / fmt::format("run_{}", part)).string());
  // Kept, if Ctrl-C ends the questions.
  change([](StoredTrial& stored) {
    if (stored.state == TrialState::running) stored.state = TrialState::kept;
  });
  questions.after(trial, change);
  std::cout << fmt::format("trial {}: {}\nNext: fivepipe study report {}\n", number,
                           trial.state == TrialState::kept ? "kept" : "discarded",
                           study.path().string());
  return code == kInterrupted ? 0 : code;
}

}  // namespace

void add_run(CLI::App& app, Command& command) {
  const auto options = std::make_shared<RunOptions>();
  CLI::App* const sub = app.add_subcommand(
      "run",
      "Runs a trial: asks the questions of the study, runs and records the deployment until "
      "Ctrl-C, and asks again. Without a terminal it asks nothing");
  sub->footer(
      "Examples:\n"
      "  fivepipe study run spacing --participant P1\n"
      "  fivepipe study run spacing --participant P1 --tool tongs --duration 60\n"
      "  fivepipe study run spacing --resume 3\n"
      "In a second terminal: fivepipe study space 18cm --deployment FILE, fivepipe study edit "
      "spacing --note TEXT\n\n"
      "Exit codes: 0 done, 2 usage or configuration, otherwise that of `fivepipe up`.");
  sub->add_option("folder", options->folder, "folder of the study")->required();
  sub->add_option("--participant", options->participant,
                  "pseudonym; repeat it for another trial of the same person");
  sub->add_option("--resume", options->resume, "number of a trial that is continued")
      ->check(CLI::PositiveNumber);
  sub->add_option("--tool", options->tool, "tool in use");
  add_answer_options(*sub, options->answers);
  sub->add_flag("!--no-questions", options->asks, "asks nothing");
  sub->add_option("--duration", options->duration, "seconds (default: until Ctrl-C)");
  sub->add_option("--domain", options->domain, "DDS domain (default: that of the deployment)");
  sub->callback([=, &command] { command = [=] { return run_trial(*options); }; });
}

}  // namespace fivepipe::study
