// Checks of a STEP file that Open CASCADE has loaded. Part of the module fivepipe_step.so.
#pragma once
#include <STEPControl_Reader.hxx>
#include <optional>
#include <string>

namespace fivepipe::config {

// Returns why the shape of the file would have a wrong size or form, or an empty text: no unit of
// length, which Open CASCADE would take to be a millimetre; another unit than unit_m [m]; a part
// that its placement scales or mirrors, which Open CASCADE ignores.
std::string why_wrong_shape(const STEPControl_Reader& loaded, std::optional<double> unit_m);

// Returns why a part of the shape is missing after its conversion, or an empty text.
std::string why_incomplete(const STEPControl_Reader& converted);

}  // namespace fivepipe::config
