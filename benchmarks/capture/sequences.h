// Synthetic image sequences with their true object pixels: one camera, a person at a table, and one
// disturbance. They measure segmentation against the truth.
#pragma once
#include <array>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "common/hull/object_pixels.h"

namespace fivepipe::capture_bench {

//   noise        sensor noise of kNoise_levels; all others have it too
//   shadow       the object casts a shadow on the table
//   flicker      the brightness changes by up to 6 % from image to image, also while learning
//   drift        the exposure leaves that of the learning images, by 12 % in the last image
//   camouflage   the object has three tenths of its contrast with the background
//   waving       a part of the background moves by up to 6 px, as leaves do, also while learning
//   passers_by   people cross the learning images; each covers a pixel in a tenth of them
enum class Disturbance { noise, shadow, flicker, drift, camouflage, waving, passers_by };
inline constexpr std::array kDisturbances = {
    Disturbance::noise,      Disturbance::shadow, Disturbance::flicker,   Disturbance::drift,
    Disturbance::camouflage, Disturbance::waving, Disturbance::passers_by};
std::string name_of(Disturbance disturbance);
// True if neither background nor light change in the images, and the object has its contrast.
bool is_static(Disturbance disturbance);

// All images are 8-bit BGR of one size.
struct Sequence {
  Disturbance disturbance;
  std::vector<cv::Mat> learning;  // kLearningImages, without the object
  std::vector<cv::Mat> images;    // kImages, over one period of the object's motion
  // By image: the pixels whose centre shows the object.
  std::vector<hull::ObjectPixels> truth;
};

// Renders a sequence. The same arguments give the same bits. The seed determines the camera, the
// textures, the noise, and the course of the disturbance.
Sequence sequence(Disturbance disturbance, std::uint64_t seed, int width_px, int height_px);

inline constexpr int kLearningImages = 60, kImages = 40;
inline constexpr double kNoise_levels = 2.0;  // standard deviation, grey levels of 255

// The settings of every method are chosen with the first seeds (those of fivepipe are its defaults)
// and measured with the second ones.
inline constexpr std::array<std::uint64_t, 3> kTuningSeeds = {101, 102, 103};
inline constexpr std::array<std::uint64_t, 3> kMeasuredSeeds = {201, 202, 203};

}  // namespace fivepipe::capture_bench
