// The picture of a frame in the video that render_node wrote while the session was recorded.
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "common/recording/files/recording.h"

namespace fivepipe::study {

class EventPictures {
 public:
  // The recording states which frames were composited; the video has one picture for each frame
  // from the first to the last one, except in gaps of more than a second. Pictures that the encoder
  // dropped shift it.
  EventPictures(const recording::Recording& recording, const std::filesystem::path& video);
  ~EventPictures();

  // Why there are no pictures; empty: there are.
  const std::string& why_none() const { return why_none_; }
  // Returns the picture of the frame as PNG file, at most 320 px wide; that of an earlier frame if
  // it is at most a second older; else empty.
  std::string png_of(std::uint64_t frame) const;

 private:
  struct Video;
  std::unique_ptr<Video> video_;
  std::map<std::uint64_t, int> index_of_frame_;
  double rate_hz_ = 0;
  std::string why_none_;
};

}  // namespace fivepipe::study
