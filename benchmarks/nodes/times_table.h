// The table of times in ms that the benchmarks from recordings print: one row per step or stage.
#pragma once
#include <string>
#include <vector>

#include "common/base/text_table.h"

namespace fivepipe::node_bench {

base::TextTable times_table();  // without rows
void add_times(base::TextTable& table, const std::string& name, const std::vector<double>& time_ms);

}  // namespace fivepipe::node_bench
