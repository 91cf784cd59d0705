// The real objects of the payload task (paper, section 5.2.2): the pipe, the power cord, the tongs,
// the connector on the table and the stand from which the cord is taken. The axis of the connector
// is the world's z axis.
#pragma once
#include <vector>

#include "capture_node/synthetic/actors/part.h"

namespace fivepipe::capture {

inline constexpr double kPayloadPipeLength_m = 0.14, kPayloadPipeRadius_m = 0.020;
// Heights: of the virtual PMT box in scenes/payload, of the screwed-in pipe's lower end, and of the
// plug's lower end in the outlet.
inline constexpr double kPmtTop_z_m = 0.160, kSeat_z_m = 0.020, kOutlet_z_m = 0.035;
inline constexpr double kTongsLength_m = 0.200, kPlugLength_m = 0.020;
// Where the plug stands at first, and the height of its lower end.
inline const Eigen::Vector3d kStand_world_m(0.36, -0.12, 0.040);

// The outlet in its base, the threaded collar for the pipe, and the stand.
void add_fixtures(std::vector<SyntheticPart>& parts);

// An open pipe of staves, upright.
void add_pipe(std::vector<SyntheticPart>& parts, const Eigen::Vector3d& center_world_m);

// The plug, and the cord from it up and towards the person. plug_world_m: the centre of the plug's
// lower end. A stiff cord keeps upright above the plug; a flexible one lies on the pipe's rim.
void add_cord(std::vector<SyntheticPart>& parts, const Eigen::Vector3d& plug_world_m, bool stiff);

// Upright tongs that hold the plug: their upper end is kPlugLength_m + kTongsLength_m above the
// plug's lower end.
void add_tongs(std::vector<SyntheticPart>& parts, const Eigen::Vector3d& plug_world_m);

}  // namespace fivepipe::capture
