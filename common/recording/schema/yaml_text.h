// Formats a decoded message as YAML.
#pragma once
#include <nlohmann/json.hpp>
#include <string>

namespace fivepipe::schema {

// Returns one document that begins with "---". Each field takes a line; a value without nested
// structures ({x: 1.0, y: 2.0}) takes one line. NaN is .nan, infinity .inf. Bytes of strings that
// are not UTF-8 become U+FFFD.
std::string to_yaml(const nlohmann::ordered_json& message);

}  // namespace fivepipe::schema
