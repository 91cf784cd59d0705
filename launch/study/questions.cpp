#include "launch/study/questions.h"

#include <unistd.h>

#include <iostream>

#include "common/base/realtime.h"
#include "common/base/usage_error.h"

namespace fivepipe::study {

void add_answer_options(CLI::App& app, AnswerOptions& options) {
  app.add_option("--necessary-before", options.necessary_before,
                 "answer before the trial: how much space is necessary? 15cm, 15-16cm");
  app.add_option("--allocated-before", options.allocated_before,
                 "answer before the trial: how much space would you allocate?");
  app.add_option("--found", options.found, "the space that was found necessary in the environment");
  app.add_option("--allocated-after", options.allocated_after,
                 "answer after the trial: how much space would you allocate now?");
}

void take_answers(const AnswerOptions& options, report::Answers& answers) {
  const auto take = [](const char* option, const std::string& text,
                       std::optional<report::Answer>& answer) {
    if (text.empty()) return;
    try {
      answer = answer_from(text);
    } catch (const base::UsageError& error) {
      throw base::UsageError(std::string(option) + ": " + error.what());
    }
  };
  take("--necessary-before", options.necessary_before, answers.necessary_before);
  take("--allocated-before", options.allocated_before, answers.allocated_before);
  take("--found", options.found, answers.found);
  take("--allocated-after", options.allocated_after, answers.allocated_after);
}

Questions::Questions(bool asks) : asks_(asks && isatty(STDIN_FILENO) == 1) {}

std::string Questions::line(const std::string& question) const {
  for (;;) {
    std::cout << question << ' ' << std::flush;
    std::string text;
    if (!std::getline(std::cin, text)) std::cout << '\n';
    if (is_utf8(text)) return text;
    std::cout << "the text is not UTF-8\n";
  }
}

void Questions::ask(const std::string& question, std::optional<report::Answer>& answer) const {
  while (asks_ && !answer && std::cin) {
    const std::string text = line(question);
    if (text.empty()) return;
    try {
      answer = answer_from(text);
    } catch (const base::UsageError& error) {
      std::cout << error.what() << '\n';
    }
  }
}

void Questions::before(report::Answers& answers) const {
  ask("How much space is necessary?", answers.necessary_before);
  ask("How much space would you allocate?", answers.allocated_before);
}

void Questions::after(const StoredTrial& trial, const Change& change) const {
  if (!asks_) return;
  report::Answers answers = trial.answers;
  ask("How much space was found necessary in the environment?", answers.found);
  change([&](StoredTrial& stored) {
    if (answers.found) stored.answers.found = answers.found;
  });
  ask("How much space would you allocate now?", answers.allocated_after);
  change([&](StoredTrial& stored) {
    if (answers.allocated_after) stored.answers.allocated_after = answers.allocated_after;
  });
  if (trial.tool.empty()) {
    const std::string tool = line("Which tool was in use (empty: none)?");
    change([&](StoredTrial& stored) {
      if (!tool.empty()) stored.tool = tool;
    });
  }
  if (const std::string note = line("A note (empty: none)?"); !note.empty())
    change([&](StoredTrial& stored) { stored.notes.push_back({base::now_realtime_ns(), note}); });
  const std::string reason = line("Why is the trial discarded (empty: keep it)?");
  if (reason.empty()) return;
  change([&](StoredTrial& stored) {
    stored.state = TrialState::discarded;
    stored.discarded_because = reason;
  });
}

}  // namespace fivepipe::study
