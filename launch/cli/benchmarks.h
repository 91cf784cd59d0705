// `fivepipe bench NODE --from FILE`, `bench pipeline --from FILE`, `bench compare A B`: each gets
// the words that follow its name. Exit codes as everywhere.
#pragma once
#include <string>
#include <vector>

namespace fivepipe::launch {

int bench_node(const std::string& node, const std::vector<std::string>& words);
int bench_pipeline(const std::vector<std::string>& words);
int bench_compare(const std::vector<std::string>& words);

}  // namespace fivepipe::launch
