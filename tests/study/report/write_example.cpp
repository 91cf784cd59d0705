// Writes the report of the example study to a folder, to look at it: write_example_report FOLDER
#include <cstdio>

#include "common/study/report/page.h"
#include "tests/study/report/example_study.h"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "Usage: write_example_report FOLDER\n");
    return 2;
  }
  fivepipe::study::report::write_report(fivepipe::test::example_study(), argv[1]);
  std::printf("wrote %s/report.html\n", argv[1]);
}
