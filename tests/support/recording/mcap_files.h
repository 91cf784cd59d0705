// Synthetic recordings for tests of MCAP files.
#pragma once
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "common/recording/mcap/file_writer.h"
#include "common/recording/mcap/format/chunk_builder.h"
#include "common/recording/mcap/reader.h"
#include "tests/support/test_folder.h"

namespace fivepipe::test {

// A message that owns its payload.
struct OwnMessage {
  mcap::Id channel;
  std::uint32_t sequence;
  std::uint64_t log_stamp_ns, publish_stamp_ns;
  mcap::Bytes payload;
  bool operator==(const OwnMessage&) const = default;
  mcap::Message view() const {
    return {channel, sequence, log_stamp_ns, publish_stamp_ns, payload};
  }
};

inline OwnMessage own(const mcap::Message& message) {
  return {message.channel, message.sequence, message.log_stamp_ns, message.publish_stamp_ns,
          mcap::Bytes(message.payload.begin(), message.payload.end())};
}

inline std::vector<OwnMessage> all_messages(mcap::Cursor cursor) {
  std::vector<OwnMessage> messages;
  while (const auto message = cursor.next()) messages.push_back(own(*message));
  return messages;
}

inline mcap::Bytes file_bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  const mcap::ByteView bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}
// Truncates a finished file before its DataEnd record, so that a reader must scan it.
inline void remove_summary(const std::filesystem::path& path) {
  const mcap::File file(path);
  const std::uint64_t footer_end = file.size_bytes() - mcap::kMagic.size();
  const mcap::Buffer footer = file.read(footer_end - mcap::kFooterBytes + mcap::kRecordHeaderBytes,
                                        mcap::kFooterBytes - mcap::kRecordHeaderBytes);
  const std::uint64_t summary_start =
      mcap::read_footer({footer.view(), {file.name(), footer_end}}).summary_start;
  std::filesystem::resize_file(path, summary_start - mcap::kDataEndBytes);
}

// Creates a new file: ext4 waits for the disk if an existing file is truncated and written again.
inline void write_file(const std::filesystem::path& path, mcap::ByteView bytes) {
  std::filesystem::remove(path);
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
}

// Channels 1 and 2 have schema 1, channel 3 has none. Timestamps rise by 1..9 ns; payloads have
// 0..299 compressible bytes.
struct Recording {
  std::vector<OwnMessage> messages;     // in the order of the file
  std::vector<std::size_t> chunk_ends;  // message counts, by chunk
  // File offset of the end of each chunk, including its message indexes.
  std::vector<std::uint64_t> chunk_end_bytes;
  mcap::Attachment attachment{5, 6, "rig.yaml", "text/yaml", "cameras: []\n"};
  mcap::Metadata metadata{"recording", {{"machine", "made up"}, {"commit", "0"}}};
  mcap::Schema schema{"made_up::Thing", "omgidl",
                      "module made_up { struct Thing { unsigned long n; }; };"};
};

inline Recording made_up_recording(std::uint32_t seed, std::size_t chunks,
                                   std::size_t messages_a_chunk) {
  std::mt19937 random(seed);
  Recording recording;
  std::uint64_t stamp_ns = 1'000;
  for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
    for (std::size_t i = 0; i < messages_a_chunk; ++i) {
      stamp_ns += 1 + random() % 9;
      OwnMessage message{mcap::Id(1 + random() % 3), std::uint32_t(recording.messages.size()),
                         stamp_ns, stamp_ns - random() % 100, mcap::Bytes(random() % 300)};
      for (std::byte& byte : message.payload) byte = std::byte(random() % 4);
      recording.messages.push_back(std::move(message));
    }
    recording.chunk_ends.push_back(recording.messages.size());
  }
  return recording;
}

// Unless `finishes`, leaves the file as a killed process leaves it.
inline void write(Recording& recording, const std::filesystem::path& path,
                  mcap::Compression compression, bool finishes = true) {
  mcap::ChunkBuilder builder;
  const mcap::Id schema = builder.add_schema(recording.schema);
  builder.add_channel({schema, "things/a", "cdr", {{"qos", "reliable"}}});
  builder.add_channel({schema, "things/b", "cdr", {}});
  builder.add_channel({0, "notes", "json", {}});
  std::filesystem::remove(path);
  mcap::FileWriter writer(path, compression, "fivepipe tests", "made up");
  writer.attach(recording.attachment);
  recording.chunk_end_bytes.clear();
  std::size_t next = 0;
  for (const std::size_t end : recording.chunk_ends) {
    for (; next < end; ++next) builder.add(recording.messages[next].view());
    writer.write(builder.take());
    recording.chunk_end_bytes.push_back(writer.bytes_written());
  }
  writer.add(recording.metadata);
  if (finishes) writer.finish();
}

}  // namespace fivepipe::test
