// A decoded message as text for people that is YAML as well.
#pragma once
#include <nlohmann/json.hpp>
#include <string>

namespace fivepipe::schema {

// One document, begun by "---"; a line per field, what is flat ({x: 1.0, y: 2.0}) on one.
// Not-a-number is .nan, infinity .inf; bytes of strings that are not UTF-8 become U+FFFD.
std::string to_yaml(const nlohmann::ordered_json& message);

}  // namespace fivepipe::schema
