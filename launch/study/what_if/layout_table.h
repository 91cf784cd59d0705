// A table of layouts (CSV): each row places one or several parts.
//
//     payload_a,bracket.x,bracket.z      payload_a: its spacing. bracket.x, bracket.z: how far it
//     is 18cm,0cm,5cm                       moved from its place, along an axis of the world. Each
//     cell 20cm,-2cm,5cm                      has a unit. Empty lines and lines that begin with #
//     do not
//                                        count.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace fivepipe::study {

struct LayoutTable {
  struct Column {
    std::string part;
    int axis = -1;  // 0, 1 or 2: along x, y or z of the world; -1: the part's spacing
    std::string name() const;
  };
  struct Row {
    int line = 0;                // of the file, from 1
    std::vector<double> cell_m;  // by column
  };
  std::filesystem::path file;
  std::vector<Column> columns;  // at least one; all different
  std::vector<Row> rows;        // at least one
};

// Throws config::ConfigError with each wrong line, or if the file cannot be read, has no row or too
// many of them. A part has its spacing as a column or axes, not both.
LayoutTable read_layout_table(const std::filesystem::path& file);

inline constexpr std::size_t kMaxTableRows = 100'000;
// A longer move is probably a mistake of the unit.
inline constexpr double kMaxTableLength_m = 500;

}  // namespace fivepipe::study
