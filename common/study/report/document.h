// A page of HTML that needs no other file and no network.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace fivepipe::study::report {

struct Document {
  std::string title, version;  // of fivepipe
  std::string body;            // HTML: all between the tags, without the data and the scripts
};

// Returns the page with the style, the libraries and the scripts of assets.h. Its
// Content-Security-Policy allows these by their hashes and data URIs as pictures, and nothing else.
// data: what the scripts draw (page_data.h).
std::string html_of(const Document& document, const nlohmann::ordered_json& data);

// The buttons of the theme and of the printer.
extern const char* const kTools;

}  // namespace fivepipe::study::report
