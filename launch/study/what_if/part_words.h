// The words of the command line that describe a part of what-if.
#pragma once
#include <string>
#include <vector>

#include "launch/study/what_if/what_if.h"

namespace fivepipe::study {

// What follows one --part; empty: absent.
struct PartWords {
  std::string part = {}, axis = {}, at = {}, range = {}, mesh = {}, position = {}, rotation = {};
};

// An option of a part and its value: {"--axis", "z"}.
using PartWord = std::pair<std::string, std::string>;
// Groups the options by the --part before them. Those before the first --part belong to it. Throws
// base::UsageError if a part is named or has an option twice, or an option has no part.
std::vector<PartWords> parts_of_words(const std::vector<PartWord>& words);

// Throws base::UsageError with the option, if a word is wrong.
WhatIfPart part_from(const PartWords& words);

}  // namespace fivepipe::study
