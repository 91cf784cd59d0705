// fivepipe bench security: what signing and encryption of messages cost.
#include <fmt/format.h>

#include <cstdlib>
#include <ctime>
#include <iostream>
#include <nlohmann/json.hpp>

#include "benchmarks/nodes/security/message_cost.h"
#include "benchmarks/support/suite.h"
#include "common/base/result_file.h"
#include "common/base/text_table.h"
#include "common/base/timing.h"
#include "launch/keys/make_keys.h"
#include "launch/supervise/hosts/free_domain.h"

namespace fivepipe::security_bench {
namespace {

namespace fs = std::filesystem;

// An object-pixel map of few and of many pixels, and a colour image.
constexpr std::size_t kSizes_bytes[] = {1'000, 40'000, 1'000'000};

class KeyFolder {  // temporary
 public:
  KeyFolder() {
    std::string pattern = (fs::temp_directory_path() / "fivepipe-bench-XXXXXX").string();
    if (!mkdtemp(pattern.data())) throw std::runtime_error("cannot make a folder " + pattern);
    path_ = pattern;
  }
  ~KeyFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  KeyFolder(const KeyFolder&) = delete;
  KeyFolder& operator=(const KeyFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

struct Method {
  std::string name;
  fs::path keys;  // empty: without security
};

std::vector<Method> methods_in(const fs::path& folder, std::uint32_t domain) {
  std::vector<Method> methods{{"none", ""}};
  for (const auto protection : {security::Protection::sign, security::Protection::encrypt}) {
    methods.push_back({name_of(protection), folder / name_of(protection)});
    keys::make_keys({.folder = methods.back().keys,
                     .deployment = "bench",
                     .domain = domain,
                     .protection = protection,
                     .days = 1,
                     .now_s = std::time(nullptr)});
  }
  return methods;
}

void add(Cost& sum, const Cost& cost) {
  sum.latency_ms.insert(sum.latency_ms.end(), cost.latency_ms.begin(), cost.latency_ms.end());
  sum.sender_cpu_s += cost.sender_cpu_s;
  sum.receiver_cpu_s += cost.receiver_cpu_s;
  sum.sent += cost.sent;
}

constexpr bench::Suite kSuite{
    .name = "security",
    .description =
        "Measures messages from one process to another at 60 Hz over the loopback interface, "
        "without security, signed and encrypted: the latency from the call of write() until the "
        "reader has the message, and the processor time of both processes.",
    .example = "fivepipe bench security --json out/security.json",
    .only_help = "only results whose name contains this text, such as encrypt or 1000000"};

void run(const bench::Args& args) {
  std::cout << base::machine_line("") << std::endl;
  const KeyFolder folder;
  const std::uint32_t domain = launch::free_domain();
  const std::vector<Method> methods = methods_in(folder.path(), domain);
  const int rounds = args.quick ? 1 : 5, messages = args.quick ? 60 : 240;
  std::map<std::string, Cost> cost_of;
  const auto name_of_result = [](const Method& method, std::size_t size_bytes) {
    return fmt::format("security/{}/{}", size_bytes, method.name);
  };
  const auto is_wanted = [&](const std::string& name) {
    return name.find(args.only) != std::string::npos;
  };
  // Round-robin, so that changes of the machine's load affect all methods.
  for (int round = 0; round < rounds; ++round)
    for (const std::size_t size_bytes : kSizes_bytes)
      for (const Method& method : methods)
        if (const std::string name = name_of_result(method, size_bytes); is_wanted(name)) {
          std::cerr << fmt::format("bench security: {}, round {} of {}\n", name, round + 1, rounds);
          add(cost_of[name], measure(domain, method.keys, size_bytes, messages));
        }
  base::TextTable table({{"bytes", true},
                         {"protection"},
                         {"latency p50, ms", true},
                         {"p99", true},
                         {"CPU, us per message", true},
                         {"CPU, ms per MB", true},
                         {"lost", true}});
  nlohmann::ordered_json entries = nlohmann::ordered_json::array();
  for (const std::size_t size_bytes : kSizes_bytes)
    for (const Method& method : methods) {
      const std::string name = name_of_result(method, size_bytes);
      if (!is_wanted(name)) continue;
      const Cost& cost = cost_of.at(name);
      const double cpu_s = cost.sender_cpu_s + cost.receiver_cpu_s,
                   megabytes = 1e-6 * double(size_bytes) * cost.sent;
      const int lost = cost.sent - int(cost.latency_ms.size());
      table.add({std::to_string(size_bytes), method.name,
                 base::with_decimals(base::percentile(cost.latency_ms, 0.5), 2),
                 base::with_decimals(base::percentile(cost.latency_ms, 0.99), 2),
                 base::with_decimals(1e6 * cpu_s / cost.sent, 0),
                 base::with_decimals(1e3 * cpu_s / megabytes, 2), std::to_string(lost)});
      entries.push_back({{"name", name},
                         {"time_ms", base::times_json(cost.latency_ms)},
                         {"error", {{"lost", lost}}},
                         {"counts",
                          {{"cpu_us_per_message", 1e6 * cpu_s / cost.sent},
                           {"cpu_ms_per_mb", 1e3 * cpu_s / megabytes}}}});
    }
  std::cout << table.text();
  if (!args.json_file.empty())
    base::write_json(args.json_file, base::suite_json("security", "", entries));
}

}  // namespace
}  // namespace fivepipe::security_bench

int main(int argc, char** argv) {
  using namespace fivepipe;
  if (argc == 6 && (std::string(argv[1]) == "send" || std::string(argv[1]) == "receive")) try {
      return security_bench::run_process({argv + 1, argv + argc});
    } catch (const std::exception& error) {
      std::cerr << error.what() << '\n';
      return 1;
    }
  return bench::run_suite(security_bench::kSuite, argc, argv, security_bench::run);
}
