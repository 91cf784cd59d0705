#include <cmath>
#include <span>

#include "capture_node/synthetic/actors/actors.h"
#include "capture_node/synthetic/actors/payload_objects.h"
#include "capture_node/synthetic/actors/tool_hand.h"
#include "capture_node/synthetic/actors/working_hand.h"

namespace fivepipe::capture {
namespace {

using Eigen::Vector3d;

constexpr double kTask_s = 16.5;  // duration of the keys below
const Vector3d kPipeTaskShoulder_world_m(0.30, -0.75, 0.36);

// Radii of a rod around which the fingers would be: they hold the pipe, slide along it in the shaft
// and above it, and are clear of it; hold the cord and are clear of it; hold the tongs.
constexpr double kPipe = kPayloadPipeRadius_m, kPipeInShaft = 0.022, kPipeLoose = 0.026,
                 kPipeFree = 0.034, kCord = 0.0040, kCordFree = 0.016, kTongs = 0.010;

// Heights in this file are above the PMT box. The pipe's heights are those of its centre, the
// plug's those of its lower end.
//
// The pipe moves between the payloads with its lower end 1 cm above the PMT box. The hand lowers it
// in two strokes; at the second one, it is higher on the pipe. Then it pushes it down from above
// and screws it in.
constexpr double kCarried_m = 0.080, kDown_m = -0.070;
const Vector3d kPlugAtStand_m = kStand_world_m - Vector3d(0, 0, kPmtTop_z_m);
const HandKey kPipeKeys[] = {
    {0.0, {0.24, -0.26, 0.093}, 0, kPipe, 0, 0, {0.24, -0.26, kCarried_m}, kPlugAtStand_m},
    {0.6, {0.24, -0.26, 0.093}, 0, kPipe, 0, 0, {0.24, -0.26, kCarried_m}, kPlugAtStand_m},
    {2.4, {0, 0, 0.093}, 0, kPipe, 0, 0, {0, 0, kCarried_m}, kPlugAtStand_m},
    {2.8, {0, 0, 0.093}, 0, kPipe, 0, 0, {0, 0, kCarried_m}, kPlugAtStand_m},
    {3.6, {0, 0, 0.052}, 0, kPipe, 0, 0, {0, 0, 0.039}, kPlugAtStand_m},
    {3.8, {0, 0, 0.052}, 0, kPipeLoose, 0, 0, {0, 0, 0.039}, kPlugAtStand_m},
    {4.3, {0, 0, 0.092}, 0, kPipeLoose, 0, 0, {0, 0, 0.039}, kPlugAtStand_m},
    {4.5, {0, 0, 0.092}, 0, kPipe, 0, 0, {0, 0, 0.039}, kPlugAtStand_m},
    {5.2, {0, 0, 0.052}, 0, kPipe, 0, 0, {0, 0, -0.001}, kPlugAtStand_m},
    {5.5, {0.006, 0, 0.052}, 0, kPipeLoose, 1, 0, {0, 0, -0.001}, kPlugAtStand_m},
    {5.9, {0.070, -0.010, 0.060}, 0, kPipeFree, 1, 0, {0, 0, -0.001}, kPlugAtStand_m},
    {6.4, {0.110, -0.010, 0.046}, 1, kPipeFree, 0, 0, {0, 0, -0.001}, kPlugAtStand_m},
    {6.9, {0, 0, 0.044}, 1, kPipeFree, 0, 0, {0, 0, -0.001}, kPlugAtStand_m},
    {7.1, {0, 0, 0.044}, 1, kPipe, 0, 0, {0, 0, -0.001}, kPlugAtStand_m},
    {7.9, {0, 0, -0.025}, 1, kPipe, 0, 0.5, {0, 0, kDown_m}, kPlugAtStand_m},
    {8.1, {0, 0, -0.025}, 1, kPipeInShaft, 0, 0.5, {0, 0, kDown_m}, kPlugAtStand_m},
    {8.4, {0, 0, -0.025}, 1, kPipeInShaft, 0, -0.2, {0, 0, kDown_m}, kPlugAtStand_m},
    {8.6, {0, 0, -0.025}, 1, kPipe, 0, -0.2, {0, 0, kDown_m}, kPlugAtStand_m},
    {9.0, {0, 0, -0.025}, 1, kPipe, 0, 0.4, {0, 0, kDown_m}, kPlugAtStand_m},
    {9.1, {0, 0, -0.025}, 1, kPipeInShaft, 0, 0.4, {0, 0, kDown_m}, kPlugAtStand_m},
    {9.5, {0, 0, 0.012}, 1, kPipeInShaft, 0, 0, {0, 0, kDown_m}, kPlugAtStand_m},
    {9.6, {0, 0, 0.020}, 1, kPipeFree, 0, 0, {0, 0, kDown_m}, kPlugAtStand_m},
    {9.9, {0.12, -0.05, 0.040}, 1, kPipeFree, 0, 0, {0, 0, kDown_m}, kPlugAtStand_m}};

// Feeds the stiff cord down the pipe in three strokes, the fingertips above the pipe's rim.
const HandKey kStiffCordKeys[] = {
    {10.5, {0.36, -0.12, -0.035}, 1, kCordFree, 0, 0, {0, 0, kDown_m}, kPlugAtStand_m},
    {10.8, {0.36, -0.12, -0.075}, 1, kCordFree, 0, 0, {0, 0, kDown_m}, kPlugAtStand_m},
    {11.0, {0.36, -0.12, -0.075}, 1, kCord, 0, 0, {0, 0, kDown_m}, kPlugAtStand_m},
    {12.0, {0.30, -0.10, 0.050}, 1, kCord, 0, 0, {0, 0, kDown_m}, {0.30, -0.10, 0.005}},
    {12.8, {0, 0, 0.050}, 1, kCord, 0, 0, {0, 0, kDown_m}, {0, 0, 0.005}},
    {13.4, {0, 0, 0.007}, 1, kCord, 0, 0, {0, 0, kDown_m}, {0, 0, -0.038}},
    {13.5, {0, 0, 0.007}, 1, kCordFree, 0, 0, {0, 0, kDown_m}, {0, 0, -0.038}},
    {13.8, {0, 0, 0.050}, 1, kCordFree, 0, 0, {0, 0, kDown_m}, {0, 0, -0.038}},
    {13.9, {0, 0, 0.050}, 1, kCord, 0, 0, {0, 0, kDown_m}, {0, 0, -0.038}},
    {14.4, {0, 0, 0.007}, 1, kCord, 0, 0, {0, 0, kDown_m}, {0, 0, -0.081}},
    {14.5, {0, 0, 0.007}, 1, kCordFree, 0, 0, {0, 0, kDown_m}, {0, 0, -0.081}},
    {14.8, {0, 0, 0.050}, 1, kCordFree, 0, 0, {0, 0, kDown_m}, {0, 0, -0.081}},
    {14.9, {0, 0, 0.050}, 1, kCord, 0, 0, {0, 0, kDown_m}, {0, 0, -0.081}},
    {15.4, {0, 0, 0.006}, 1, kCord, 0, 0, {0, 0, kDown_m}, {0, 0, -0.125}},
    {15.6, {0, 0, 0.006}, 1, kCordFree, 0, 0, {0, 0, kDown_m}, {0, 0, -0.125}},
    {15.9, {0.06, 0, 0.020}, 1, kCordFree, 0, 0, {0, 0, kDown_m}, {0, 0, -0.125}},
    {16.4, {0.22, -0.20, 0.060}, 1, kCordFree, 0, 0, {0, 0, kDown_m}, {0, 0, -0.125}},
    {16.5, {0.22, -0.20, 0.060}, 1, kCordFree, 0, 0, {0, 0, kDown_m}, {0, 0, -0.125}}};

// Lowers the plug of the flexible cord with tongs. The hand is around their upper end, its middle
// 5 cm below it.
constexpr double kHeld_m = kPlugLength_m + kTongsLength_m - 0.050;
const HandKey kTongsKeys[] = {
    {10.5, {0.44, -0.13, 0.050}, 0, kTongs, 1, 0, {0, 0, kDown_m}, kPlugAtStand_m},
    {10.9, {0.366, -0.12, 0.050}, 0, kTongs, 1, 0, {0, 0, kDown_m}, kPlugAtStand_m},
    {11.1, {0.36, -0.12, 0.050}, 0, kTongs, 0, 0, {0, 0, kDown_m}, kPlugAtStand_m},
    {12.0, {0.33, -0.11, 0.005 + kHeld_m}, 0, kTongs, 0, 0, {0, 0, kDown_m}, {0.33, -0.11, 0.005}},
    {13.0, {0, 0, 0.005 + kHeld_m}, 0, kTongs, 0, 0, {0, 0, kDown_m}, {0, 0, 0.005}},
    {13.3, {0, 0, 0.005 + kHeld_m}, 0, kTongs, 0, 0, {0, 0, kDown_m}, {0, 0, 0.005}},
    {14.6, {0, 0, -0.125 + kHeld_m}, 0, kTongs, 0, 0, {0, 0, kDown_m}, {0, 0, -0.125}},
    {15.0, {0, 0, -0.125 + kHeld_m}, 0, kTongs, 0, 0, {0, 0, kDown_m}, {0, 0, -0.125}},
    {15.3, {0.006, 0, 0.055}, 0, kTongs, 1, 0, {0, 0, kDown_m}, {0, 0, -0.125}},
    {15.7, {0.08, 0, 0.055}, 0, kTongs, 1, 0, {0, 0, kDown_m}, {0, 0, -0.125}},
    {16.4, {0.22, -0.20, 0.060}, 0, kTongs, 1, 0, {0, 0, kDown_m}, {0, 0, -0.125}},
    {16.5, {0.22, -0.20, 0.060}, 0, kTongs, 1, 0, {0, 0, kDown_m}, {0, 0, -0.125}}};

std::vector<HandKey> keys_of(bool with_tongs) {
  std::vector<HandKey> keys(std::begin(kPipeKeys), std::end(kPipeKeys));
  const std::span<const HandKey> rest =
      with_tongs ? std::span<const HandKey>(kTongsKeys) : std::span<const HandKey>(kStiffCordKeys);
  keys.insert(keys.end(), rest.begin(), rest.end());
  for (HandKey& key : keys)
    for (Vector3d* place : {&key.grip_world_m, &key.first_world_m, &key.second_world_m})
      place->z() += kPmtTop_z_m;
  return keys;
}

}  // namespace

std::vector<SyntheticPart> pipe_task(double turn, double hand_length_m, bool with_tongs) {
  static const std::vector<HandKey> kByHand = keys_of(false), kWithTongs = keys_of(true);
  const double t_s = kTask_s * (1 - std::abs(2 * turn - 1));
  const HandKey key = key_at(with_tongs ? kWithTongs : kByHand, t_s);
  std::vector<SyntheticPart> parts;
  add_fixtures(parts);
  add_pipe(parts, key.first_world_m);
  add_cord(parts, key.second_world_m, !with_tongs);
  if (with_tongs) add_tongs(parts, key.second_world_m);
  add_tool_hand(parts, key, hand_length_m / kHandLength_m, kPipeTaskShoulder_world_m,
                {0.15, 0, -0.25});
  return parts;
}

}  // namespace fivepipe::capture
