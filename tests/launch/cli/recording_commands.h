// Runs `fivepipe info`, `ls`, `echo` and `hz` as a user does, on small recordings that it writes.
#pragma once
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "common/pipeline/bus/topics.h"
#include "common/recording/files/recording_writer.h"
#include "common/recording/schema/wire_types.h"
#include "tests/support/process/shell.h"
#include "tests/support/recording/mcap_files.h"

namespace fivepipe::launch {

namespace fs = std::filesystem;

using Answer = test::ShellAnswer;
using test::shell;

inline const std::string program = FIVEPIPE_BINARY_DIR "/fivepipe ";
inline Answer fivepipe(const std::string& arguments) {
  return shell("TZ=UTC " + program + arguments + " 2>&1");
}

inline bool holds(const Answer& answer, const std::string& part) {
  return answer.text.find(part) != std::string::npos;
}

inline constexpr std::int64_t start_ns = 1'700'000'000'000'000'000, ms = 1'000'000;

// A FrameComposited payload, little-endian CDR.
inline std::vector<std::byte> frame_cdr(const std::string& key, std::uint64_t frame) {
  std::vector<std::byte> bytes{std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}};
  const auto put = [&](auto value) {
    while ((bytes.size() - 4) % sizeof value) bytes.push_back(std::byte{0});
    const auto* raw = reinterpret_cast<const std::byte*>(&value);
    bytes.insert(bytes.end(), raw, raw + sizeof value);
  };
  put(std::uint32_t(key.size() + 1));
  for (const char c : key) put(c);
  put('\0');
  put(frame);
  put(start_ns);
  put(start_ns + 20 * ms);
  return bytes;
}
inline std::vector<std::byte> key_cdr(const std::string& key) {
  auto bytes = frame_cdr(key, 0);
  bytes.resize(8 + key.size() + 1);
  return bytes;
}

inline constexpr const char* kCompositedType = "fivepipe::v1::FrameComposited";
inline const std::string kCompositedTopic = bus::topics::FrameComposited::name,
                         kHeadTopic = bus::topics::HeadPose::name;

// Writes 100 frames at 100 Hz without frames 17 and 40..42, each received 2 ms after it was sent,
// in chunks of about ten. `last_frame_offset` is added to the number of frame 99.
inline void write_session(const fs::path& file,
                          const recording::WriterOptions& options = {.chunk_bytes = 700},
                          const std::string& schema = schema::fivepipe_schema(kCompositedType),
                          std::uint64_t last_frame_offset = 0) {
  recording::RecordingWriter writer(file, "test", options);
  writer.attach({1, 1, "deployment/demo.yaml", "application/yaml", "name: demo\n"});
  writer.add(mcap::Metadata{
      "recording",
      {{"version", "0.1.0"}, {"commit", "abc"}, {"deployment", "demo"}, {"domain", "3"}}});
  writer.add(mcap::Metadata{"settings", {{"frames", "60"}}});
  const auto render = writer.add_channel(kCompositedTopic, kCompositedType, schema,
                                         {{"node", "render"},
                                          {"writer", "0123"},
                                          {"qos.history", "keep_last 64"},
                                          {"qos.reliability", "reliable, blocks 100 ms"}});
  const auto head =
      writer.add_channel(kHeadTopic, "fivepipe::v1::HeadPose",
                         schema::fivepipe_schema("fivepipe::v1::HeadPose"), {{"node", "capture"}});
  // An empty viewer's name, two 64-bit integers, seven doubles, an empty sequence; all values are 0
  // except the name's length of 1.
  std::vector<std::byte> head_cdr(4 + 8 + 9 * 8 + 4, std::byte{0});
  head_cdr[1] = head_cdr[4] = std::byte{1};
  for (int frame = 0; frame < 100; ++frame) {
    if (frame == 17 || (frame >= 40 && frame <= 42)) continue;
    const std::int64_t sent_ns = start_ns + frame * 10 * ms;
    writer.add(render, sent_ns + 2 * ms, sent_ns,
               frame_cdr("viewer", std::uint64_t(frame) + (frame == 99 ? last_frame_offset : 0)));
    if (frame == 50) writer.add(head, sent_ns + 3 * ms, sent_ns, head_cdr);
  }
  writer.add(render, start_ns + 1000 * ms, start_ns + 999 * ms, recording::KeyChange::unregistered,
             key_cdr("viewer"));
  writer.finish();
}

inline std::size_t longest_line(const std::string& text) {
  std::size_t longest = 0;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) longest = std::max(longest, line.size());
  return longest;
}

inline std::string content_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

class RecordingCommands : public testing::Test {
 protected:
  RecordingCommands() { write_session(session); }
  fs::path cut_session(std::size_t bytes) {
    fs::path cut = folder.path / "cut.mcap";
    fs::copy_file(session, cut, fs::copy_options::overwrite_existing);
    fs::resize_file(cut, bytes);
    return cut;
  }
  const test::TestFolder folder;
  const fs::path session = folder.path / "session.mcap";
};

}  // namespace fivepipe::launch
