// What the report of a study shows: its trials, their measurements and the geometry.
//
// Lengths are in metres and times in seconds since the start of the trial, if no other unit is
// stated. Positions are in the world frame of the scene. Texts are UTF-8 and may hold anything that
// a person types: the report escapes them.
#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "common/geometry/mesh.h"
#include "common/study/spacing_study.h"

namespace fivepipe::study::report {

// An answer about the space that the task needs, as in the paper's Table 1: "15.0-16.0", "16.0
// adjust tool".
struct Answer {
  double low_m = 0;
  std::optional<double> high_m = std::nullopt;  // of an answer that is a range; >= low_m
  std::string remark = {};
  double middle_m() const { return high_m ? 0.5 * (low_m + *high_m) : low_m; }
};

// The four rows of the paper's Table 1. nullopt: not answered.
struct Answers {
  std::optional<Answer> necessary_before;  // how much space is necessary?
  std::optional<Answer> allocated_before;  // how much space would you allocate?
  std::optional<Answer> found;             // actual space required, determined in the environment
  std::optional<Answer> allocated_after;   // how much space would you allocate now?
};

struct Note {
  double time_s;
  std::string text;
};

// The part stands at this spacing from this time on. The first entry of a part, at 0 s, is where
// the trial began.
struct LayoutChange {
  double time_s;
  std::string part;
  double spacing_m;
};

// A period in which a part collides.
struct Event {
  double start_s, end_s;  // start_s <= end_s
  // Of the deepest frame; nullopt: not computed. max_m may be infinite.
  std::optional<Bracket> penetration = std::nullopt;
  std::string picture_png = {};    // the bytes of a PNG file; empty: no picture
  std::string picture_shows = {};  // alternative text, such as "seen by the viewer at 3.2 s"
};

// A source of error of the clearance: at most `bound_mm` to either side.
struct ErrorSource {
  std::string name;                // "map resolution", "calibration", "eps"
  std::optional<double> bound_mm;  // nullopt: not known
};

// Distance between the part and the hull over time.
struct Clearance {
  std::vector<double> times_s;     // ascends strictly
  std::vector<Bracket> distances;  // one per time; {cap_m, infinity}: at least the cap
  double cap_m = 0;                // larger clearances are not measured
  std::vector<ErrorSource> errors;
  // Sum of the known bounds, which no combination of these errors exceeds.
  double error_m() const;
};

struct PartResult {
  std::string part;
  double collision_s = 0;     // duration of the frames in which it collides
  std::vector<Event> events;  // ascending by start_s
  std::optional<Clearance> clearance = std::nullopt;
  // Of the frames in which it is neither known to collide nor certified free.
  double undecided_s = 0;
};

// Other spacings of a part, computed from the recording of the trial.
struct WhatIfCurve {
  std::string part;
  collision::SpacingInterval range;
  LineResult result;                         // layouts ascend; none: only the intervals are known
  bool with_distances = true;                // whether clearance and penetration were computed
  std::optional<double> min_free_m() const;  // see min_free_spacing_m(); nullopt: none
};

// The volume that something swept in the trial. Positions in the world frame.
struct SweptVolume {
  std::string of;  // "right hand", "tongs"
  geometry::Mesh mesh;
};

struct Trial {
  int number = 1;
  bool is_kept = true;  // false: discarded, and left out of Table 1
  std::string discarded_because = {};
  double duration_s = 0;
  std::string tool = {};  // in use; empty: none
  Answers answers = {};
  std::vector<Note> notes = {};
  std::vector<LayoutChange> layout_changes = {};  // ascending by time
  std::vector<PartResult> parts = {};
  std::vector<WhatIfCurve> what_if = {};
  std::vector<SweptVolume> swept = {};
  // Position in Study::scenes; nullopt: no recording of the trial can be used, so that its parts
  // are not known.
  std::optional<std::size_t> scene = std::nullopt;
};

enum class ParticipantKind { human, scripted };

struct Participant {
  std::string pseudonym;
  ParticipantKind kind = ParticipantKind::human;
  std::vector<Trial> trials = {};  // ascending numbers
};

struct MovableAxis {
  Eigen::Vector3d direction;         // unit vector, towards larger spacings
  double mesh_spacing_m;             // the spacing at which `Part::mesh` stands
  collision::SpacingInterval range;  // of the slider
};

// A virtual part. A mesh that is not drawn may be empty.
struct Part {
  std::string name;  // unique in its scene
  geometry::Mesh mesh;
  std::array<std::uint8_t, 3> colour_rgb = {128, 128, 128};  // sRGB
  std::optional<MovableAxis> axis = std::nullopt;
  bool was_in_recording = true;  // false: only in what-if
};

struct Study {
  std::string name, date, version, machine;  // of the report: date "2026-02-03"
  std::string rig, scene;
  std::string spacing_of;                 // the two parts of the table's head: "A and PMT"
  std::vector<std::string> remarks = {};  // further limits of the results, one sentence each
  // The parts of each scene that was recorded. Trials differ if the scene was changed between them.
  std::vector<std::vector<Part>> scenes = {};
  std::vector<Participant> participants = {};  // unique pseudonyms
};

// Throws std::invalid_argument that lists each value that is not as declared above: NaN, infinity,
// wrong order, a triangle with an index out of range, a picture that is no PNG file.
void check(const Study& study);

}  // namespace fivepipe::study::report
