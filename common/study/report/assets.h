// The style and the scripts of the page, which the build embeds (embed_assets.cmake).
#pragma once

namespace fivepipe::study::report {

extern const char* const kStyles;     // of the libraries and of the page
extern const char* const kLibraries;  // libraries/libraries.min.js: the global `libraries`
extern const char* const kScripts;    // page/*.js, without a function around them

}  // namespace fivepipe::study::report
