// Texts that a person or a file may have chosen, made harmless where the report writes them.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace fivepipe::study::report {

// Replaces what is not UTF-8, and control characters except newline and tab, by U+FFFD.
std::string clean_utf8(std::string_view text);

// For text between tags and for values of attributes in double quotes: escapes & < > " '.
std::string html_text(std::string_view text);
// The same in a <bdi> element, so that characters of another writing direction do not reorder the
// text around it.
std::string html_name(std::string_view text);

// JSON for a <script type="application/json"> element: "<", ">" and "&" are \u escapes, so no
// string in it can end the element or open a comment. Replaces what is not UTF-8 by U+FFFD.
std::string script_json(const nlohmann::ordered_json& json);

// A field of a CSV file (RFC 4180), in double quotes. Spreadsheets run a field as a formula if it
// begins with = + - @, tab or a line break, so such a text gets a leading apostrophe (OWASP, CSV
// Injection), also if blanks precede the character, and for the full-width forms of = + - @.
std::string csv_text(std::string_view text);
// A number with at most `decimals` decimals; empty if it is not finite.
std::string csv_number(double value, int decimals);

std::string base64(std::string_view bytes);  // RFC 4648, section 4
// The source expression of a Content-Security-Policy that allows an inline element with this
// content: 'sha256-...'.
std::string csp_hash(std::string_view content);

}  // namespace fivepipe::study::report
