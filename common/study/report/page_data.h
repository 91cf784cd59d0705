// What the scripts of the page draw: charts and the 3D view, as JSON.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "common/study/report/study.h"

namespace fivepipe::study::report {

// Lengths are in cm, rounded to 0.001 cm, times in s. An infinite number is null. Trials are
// numbered in the order of the participants and their trials, as in the page.
nlohmann::ordered_json page_data(const Study& study);

nlohmann::ordered_json curve_json(const WhatIfCurve& curve);
// A length in cm, rounded to 0.001 cm, and a time in s, rounded to 1 ms; null: infinity.
nlohmann::ordered_json json_cm(double length_m);
nlohmann::ordered_json json_s(double time_s);

// Returns {"low_m": [x, y, z], "step_m": [x, y, z], "vertices": n, "triangles": n, "packed": base64
// of zlib}. Unpacked, x of all vertices, then y, then z, are 16-bit numbers of steps from low_m,
// so a position differs by at most half a step: the size of the mesh / 131070. Then follow the
// indices in 32 bits. All are little-endian differences to the number before.
nlohmann::ordered_json packed_mesh(const geometry::Mesh& mesh);

}  // namespace fivepipe::study::report
