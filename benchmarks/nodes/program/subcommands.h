// The benchmarks of the program fivepipe_measure. Each function takes the words after its name and
// returns the exit code.
#pragma once
#include <string>
#include <vector>

namespace fivepipe::measure {

int bench_node(const std::string& node, const std::vector<std::string>& words);
int bench_pipeline(const std::vector<std::string>& words);
int bench_compare(const std::vector<std::string>& words);

}  // namespace fivepipe::measure
