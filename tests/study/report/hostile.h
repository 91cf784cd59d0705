// Texts that break a report which does not escape them.
#pragma once
#include <string>
#include <vector>

namespace fivepipe::test {

inline const std::vector<std::string>& hostile_texts() {
  static const std::vector<std::string> texts{
      "../../etc/passwd",
      "=HYPERLINK(\"http://127.0.0.1:9/\",\"x\")",
      "@SUM(1+1)*cmd|' /C calc'!A0",
      "</script><script>window.attacked = true</script>",
      "<img src=x onerror=\"window.attacked = true\">",
      "\" onmouseover=\"window.attacked = true",
      "<!--<script>",
      "]]>&lt;b&gt;&#39;",
      "two\nlines, \"quoted\"",
      "\U0001F468\u200D\U0001F680 \u202Etext to the left \u05D0\u05D1",
      "\xFF\xC0\x80 no UTF-8",
      std::string("a\0b", 3),
      std::string(1000, 'W')};
  return texts;
}

}  // namespace fivepipe::test
