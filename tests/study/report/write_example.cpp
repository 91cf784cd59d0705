// Writes the report of the example study, and the page of example layouts, to a folder, to look at
// them: write_example_report FOLDER
#include <cstdio>

#include "common/base/result_file.h"
#include "common/study/report/page.h"
#include "tests/study/report/example_study.h"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "Usage: write_example_report FOLDER\n");
    return 2;
  }
  fivepipe::study::report::write_report(fivepipe::test::example_study(), argv[1]);
  fivepipe::base::write_file(std::string(argv[1]) + "/layouts.html",
                             layouts_page(fivepipe::test::example_layouts()));
  std::printf("wrote %s/report.html and %s/layouts.html\n", argv[1], argv[1]);
}
