// Lengths with units, as people write them: 18cm, 0.18 m, 180mm.
#pragma once
#include <optional>
#include <string>
#include <string_view>

namespace fivepipe::study {

// Returns the length [m], or nullopt if the text is not a finite number and one of mm, cm, m, in. A
// number without a unit is no length.
std::optional<double> length_m(std::string_view text);
// Returns "18.0 cm"; "none" if the length is infinite.
std::string text_of_length(double length_m);

}  // namespace fivepipe::study
