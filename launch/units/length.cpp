#include "launch/units/length.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <utility>

namespace fivepipe::study {

std::optional<double> length_m(std::string_view text) {
  while (text.starts_with(' ')) text.remove_prefix(1);
  while (text.ends_with(' ')) text.remove_suffix(1);
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || !std::isfinite(number)) return std::nullopt;
  text.remove_prefix(std::size_t(end - text.data()));
  while (text.starts_with(' ')) text.remove_prefix(1);
  for (const auto& [unit, unit_m] :
       {std::pair{"mm", 1e-3}, {"cm", 1e-2}, {"m", 1.0}, {"in", 0.0254}})
    if (text == unit) return number * unit_m;
  return std::nullopt;
}

std::string text_of_length(double length_m) {
  return std::isfinite(length_m) ? fmt::format("{:.1f} cm", 100 * length_m) : "none";
}

}  // namespace fivepipe::study
