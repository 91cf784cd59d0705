#include "common/study/report/page.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "common/base/result_file.h"
#include "common/study/report/csv.h"
#include "common/study/report/document.h"
#include "common/study/report/escape.h"
#include "common/study/report/html_sections.h"
#include "common/study/report/page_data.h"

namespace fivepipe::study::report {
namespace {

std::string title_block(const Study& study) {
  std::string text = fmt::format(
      "<header>\n{}<p class=\"kind\">Payload spacing study</p>\n<h1>{}</h1>\n"
      "<dl class=\"meta\">\n",
      kTools, html_name(study.name));
  for (const auto& [name, value] :
       std::vector<std::pair<std::string, std::string>>{{"Date", study.date},
                                                        {"Scene", study.scene},
                                                        {"Rig", study.rig},
                                                        {"fivepipe", study.version},
                                                        {"Machine", study.machine}})
    if (!value.empty())
      text += fmt::format("<div><dt>{}</dt><dd>{}</dd></div>\n", name, html_name(value));
  return text + "</dl>\n</header>\n";
}

std::string contents(const Study& study) {
  std::string text =
      "<nav aria-label=\"Contents\"><ul>\n<li><a href=\"#summary\">Summary</a></li>\n"
      "<li><a href=\"#table-1\">Answers and space found</a></li>\n"
      "<li><a href=\"#limits\">How to read the numbers</a></li>\n";
  std::size_t index = 0;
  for (const Participant& participant : study.participants)
    for (const Trial& trial : participant.trials)
      text += fmt::format("<li><a href=\"#trial-{}\">{}, trial {}</a></li>\n", index++,
                          html_name(participant.pseudonym), trial.number);
  return text + "</ul></nav>\n";
}

std::string trials(const Study& study) {
  std::string text;
  std::size_t index = 0;
  for (const Participant& participant : study.participants)
    for (const Trial& trial : participant.trials)
      text += trial_section(participant, trial, index++);
  return text.empty() ? "" : "<section id=\"trials\">\n<h2>Trials</h2>\n" + text + "</section>\n";
}

}  // namespace

std::string report_page(const Study& study) {
  check(study);
  const std::string body =
      "<a class=\"skip\" href=\"#summary\">Skip to the summary</a>\n" + title_block(study) +
      contents(study) + "<main>\n" + summary_section(study) + answers_section(study) +
      limits_section(study) + trials(study) +
      "</main>\n<footer><p>Written by fivepipe. All data are in this file, which loads nothing "
      "from elsewhere. The same numbers are in trials.csv, events.csv, clearance.csv and "
      "what-if.csv. Charts: uPlot; 3D view: three.js; both under the MIT licence, which is in "
      "the source of this page.</p></footer>\n";
  return html_of({"Spacing study: " + study.name, study.version, body}, page_data(study));
}

void write_report(const Study& study, const std::filesystem::path& folder) {
  const std::string page = report_page(study);
  base::write_file(folder / "report.html", page);
  base::write_file(folder / "trials.csv", trials_csv(study));
  base::write_file(folder / "events.csv", events_csv(study));
  base::write_file(folder / "clearance.csv", clearance_csv(study));
  base::write_file(folder / "what-if.csv", what_if_csv(study));
}

}  // namespace fivepipe::study::report
