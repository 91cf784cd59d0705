// The report of a study: one HTML page that needs no other file and no network, and CSV files.
#pragma once
#include <filesystem>
#include <string>

#include "common/study/report/study.h"

namespace fivepipe::study::report {

// Returns the page. Its Content-Security-Policy allows its own scripts and style by their hashes
// and data URIs as pictures, and nothing else. Throws as check() does.
//
// The page takes about 0.7 MB for its libraries, 4/3 of the size of the pictures, and some 5 to 10
// bytes per triangle; meshes of at most 100,000 triangles are smooth to turn. Without JavaScript it
// has all tables and pictures, but no charts and no 3D view.
std::string report_page(const Study& study);

// Writes report.html, trials.csv, events.csv, clearance.csv and what-if.csv (csv.h) to the folder,
// which is created if it does not exist. Throws as report_page() does, before it writes anything,
// and std::runtime_error if a file cannot be written.
void write_report(const Study& study, const std::filesystem::path& folder);

}  // namespace fivepipe::study::report
