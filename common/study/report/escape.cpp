#include "common/study/report/escape.h"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <vector>

namespace fivepipe::study::report {
namespace {

using nlohmann::ordered_json;

constexpr std::string_view kReplacement = "\uFFFD";

std::string json_text(const ordered_json& json) {
  return json.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

bool is_run_as_formula(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
  for (const std::string_view start :
       {"=", "+", "-", "@", "\t", "\r", "\n", "\uFF1D", "\uFF0B", "\uFF0D", "\uFF20"})
    if (text.starts_with(start)) return true;
  return false;
}

}  // namespace

std::string clean_utf8(std::string_view text) {
  const auto valid = ordered_json::parse(json_text(std::string(text))).get<std::string>();
  std::string clean;
  for (const char c : valid) {
    const bool is_control = (std::uint8_t(c) < 0x20 && c != '\n' && c != '\t') || c == 0x7F;
    if (is_control)
      clean += kReplacement;
    else
      clean += c;
  }
  return clean;
}

std::string html_text(std::string_view text) {
  std::string escaped;
  for (const char c : clean_utf8(text)) switch (c) {
      case '&': escaped += "&amp;"; break;
      case '<': escaped += "&lt;"; break;
      case '>': escaped += "&gt;"; break;
      case '"': escaped += "&quot;"; break;
      case '\'': escaped += "&#39;"; break;
      default: escaped += c;
    }
  return escaped;
}

std::string html_name(std::string_view text) { return "<bdi>" + html_text(text) + "</bdi>"; }

std::string script_json(const ordered_json& json) {
  std::string escaped;
  for (const char c : json_text(json)) {
    if (c == '<' || c == '>' || c == '&')
      escaped += fmt::format("\\u{:04x}", unsigned(c));
    else
      escaped += c;
  }
  return escaped;
}

std::string csv_text(std::string_view text) {
  // A carriage return is a control character for clean_utf8, so the original decides.
  std::string field = is_run_as_formula(text) ? "\"'" : "\"";
  for (const char c : clean_utf8(text)) {
    if (c == '"') field += c;
    field += c;
  }
  return field + '"';
}

std::string csv_number(double value, int decimals) {
  if (!std::isfinite(value)) return "";
  std::string text = fmt::format("{:.{}f}", value, decimals);
  if (text.find('.') != std::string::npos) {
    text.erase(text.find_last_not_of('0') + 1);
    if (text.ends_with('.')) text.pop_back();
  }
  return text == "-0" ? "0" : text;
}

std::string base64(std::string_view bytes) {
  std::vector<unsigned char> text((bytes.size() + 2) / 3 * 4 + 1);
  EVP_EncodeBlock(text.data(), reinterpret_cast<const unsigned char*>(bytes.data()),
                  int(bytes.size()));
  return {text.begin(), text.end() - 1};
}

std::string csp_hash(std::string_view content) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned length = 0;
  if (EVP_Digest(content.data(), content.size(), digest.data(), &length, EVP_sha256(), nullptr) !=
      1)
    throw std::runtime_error("OpenSSL cannot compute SHA-256");
  return "'sha256-" + base64({reinterpret_cast<const char*>(digest.data()), length}) + "'";
}

}  // namespace fivepipe::study::report
