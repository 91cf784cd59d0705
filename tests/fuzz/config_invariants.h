// Invariants of every configuration that the reader accepts (docs/configuration.md). Each function
// describes the first broken one. It returns an empty text if none is broken.
#pragma once
#include <filesystem>
#include <string>

#include "common/config/deployment.h"

namespace fivepipe::fuzz {

std::string broken_invariant(const config::Rig& rig);
std::string broken_invariant(const config::Scene& scene);
std::string broken_invariant(const config::Deployment& deployment);
std::string broken_invariant(const geometry::Mesh& mesh);

// A problem needs a text, and a location inside its file, or none.
std::string broken_invariant(const config::ConfigError& error);

}  // namespace fivepipe::fuzz
