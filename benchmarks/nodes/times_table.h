// The table of times that benchmarks from recordings print: a row for each stage, [ms].
#pragma once
#include <string>
#include <vector>

namespace fivepipe::node_bench {

void print_times_header();
void print_times(const std::string& name, const std::vector<double>& time_ms);

}  // namespace fivepipe::node_bench
