// Which topic a person means who does not want to type all of its name.
#pragma once
#include <string>
#include <vector>

#include "common/base/usage_error.h"

namespace fivepipe::launch {

// In this order: the whole name; the part behind the last slash ("HullTile"); a regular expression
// that is found in one name alone, upper and lower case alike ("hullt"). Throws UsageError where
// none or several fit.
std::string resolve_topic(const std::string& asked, const std::vector<std::string>& topics);

// Behind the last slash.
std::string base_name(const std::string& topic);

}  // namespace fivepipe::launch
