// Resolves abbreviated topic names.
#pragma once
#include <string>
#include <vector>

#include "common/base/usage_error.h"

namespace fivepipe::launch {

// Accepts, in this order: the whole name; the part after the last slash ("HullTile"); a regular
// expression that matches a single name, ignoring case ("hullt"). Throws UsageError if no topic or
// several topics match.
std::string resolve_topic(const std::string& text, const std::vector<std::string>& topics);

// The part after the last slash.
std::string base_name(const std::string& topic);

}  // namespace fivepipe::launch
