// Segmentation of the recordings seated4cam and balance4cam against outlines drawn by hand.
#pragma once
#include <filesystem>
#include <nlohmann/json.hpp>

namespace fivepipe::capture_bench {

// Segments the frames that have outlines with the settings of the recording's deployment, prints a
// table with the IoU in each camera and, of balance4cam, the volume of the hull, and returns
// results. data: the folder of the recording, which has its name. Throws if a file is missing.
nlohmann::ordered_json measure_footage(const std::filesystem::path& data);

}  // namespace fivepipe::capture_bench
