// Reads the sources of particles of a scene file.
#pragma once
#include "common/config/objects/particle_source.h"
#include "common/config/yaml/yaml_reader.h"

namespace fivepipe::config {

// Reports every problem at its key.
ParticleSource read_particle_source(YamlMap map);

}  // namespace fivepipe::config
