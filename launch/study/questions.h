// The questions of a study (paper, section 5.2.3 and Table 1), and their answers as options.
#pragma once
#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "launch/study/folder/stored_trial.h"

namespace fivepipe::study {

// Answers that the command line gives; an empty text is none.
struct AnswerOptions {
  std::string necessary_before, allocated_before, found, allocated_after;
};
void add_answer_options(CLI::App& app, AnswerOptions& options);
// Throws base::UsageError that names the option.
void take_answers(const AnswerOptions& options, report::Answers& answers);

// Asks on the terminal what is not answered yet. An empty line leaves a question open.
class Questions {
 public:
  // asks: false, or no terminal: asks nothing.
  explicit Questions(bool asks);
  void before(report::Answers& answers) const;
  // Also the tool, a note, and whether the trial is kept. After each answer, `change` applies it to
  // the stored trial, which another command may have changed meanwhile.
  using Change = std::function<void(const std::function<void(StoredTrial&)>&)>;
  void after(const StoredTrial& trial, const Change& change) const;

 private:
  std::string line(const std::string& question) const;
  void ask(const std::string& question, std::optional<report::Answer>& answer) const;
  bool asks_;
};

}  // namespace fivepipe::study
