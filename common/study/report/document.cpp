#include "common/study/report/document.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "common/study/report/assets.h"
#include "common/study/report/escape.h"

namespace fivepipe::study::report {

const char* const kTools =
    "<div class=\"tools\"><button type=\"button\" id=\"theme\" hidden>Theme: auto</button><button "
    "type=\"button\" id=\"print\" hidden>Print</button></div>\n";

std::string html_of(const Document& document, const nlohmann::ordered_json& data) {
  const std::string script = fmt::format("(() => {{\n\"use strict\";\n{}}})();\n", kScripts);
  const std::string policy = fmt::format(
      "default-src 'none'; script-src {} {}; style-src {}; img-src data:; base-uri 'none'; "
      "form-action 'none'",
      csp_hash(kLibraries), csp_hash(script), csp_hash(kStyles));
  return fmt::format(
             "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
             "<meta http-equiv=\"Content-Security-Policy\" content=\"{}\">\n"
             "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
             "<meta name=\"generator\" content=\"fivepipe {}\">\n<title>{}</title>\n"
             "<style>{}</style>\n</head>\n",
             policy, html_text(document.version), html_text(document.title), kStyles) +
         "<body>\n" + document.body +
         "<div id=\"error\" role=\"alert\" hidden></div>\n"
         "<script type=\"application/json\" id=\"data\">" +
         script_json(data) + "</script>\n<script>" + kLibraries + "</script>\n<script>" + script +
         "</script>\n</body>\n</html>\n";
}

}  // namespace fivepipe::study::report
