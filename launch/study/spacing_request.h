// Which part an experimenter moves, and to which spacing.
#pragma once
#include <string>
#include <vector>

#include "common/config/scene.h"

namespace fivepipe::study {

// Returns the object of this name, or the only one with a spacing if the name is empty; `scene`
// must outlive it. Throws base::UsageError if there is no such object, it has no spacing, or the
// name is empty and several have one.
const config::SceneObject& movable_part(const config::Scene& scene, const std::string& name);

// Returns the objects of the scene with a spacing. Throws base::UsageError if there is none.
std::vector<const config::SceneObject*> movable_parts(const config::Scene& scene);

// Throws base::UsageError if `text` is no spacing for requested_spacing_m(), whatever the part.
void check_spacing_text(const std::string& text);
// Returns the spacing [m] that the text states: "18cm", a step from before_m with a sign ("+5mm",
// "-1cm"), or a spacing with a sign after '=' ("=-3cm"). Throws base::UsageError if it states none,
// or the part's range does not contain it.
double requested_spacing_m(const std::string& text, double before_m,
                           const config::SceneObject& part);

std::string text_of_range(const config::Spacing& spacing);  // "0.0 cm to 40.0 cm"

}  // namespace fivepipe::study
