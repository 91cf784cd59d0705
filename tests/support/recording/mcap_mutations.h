// Damages MCAP files at random and checks invariants that hold for every file. The damage test and
// the fuzz driver share it.
#pragma once
#include <algorithm>
#include <optional>

#include "common/recording/mcap/format/records.h"
#include "common/recording/mcap/recover.h"
#include "tests/support/recording/mcap_files.h"

namespace fivepipe::test {

template <typename T>
void put(mcap::Bytes& bytes, std::size_t at, T value) {
  if (at + sizeof value <= bytes.size()) std::memcpy(bytes.data() + at, &value, sizeof value);
}
template <typename T>
T get(const mcap::Bytes& bytes, std::size_t at) {
  T value{};
  if (at + sizeof value <= bytes.size()) std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

// Offsets of the records, up to the first record whose length exceeds the file.
inline std::vector<std::size_t> record_starts(const mcap::Bytes& bytes) {
  std::vector<std::size_t> starts;
  for (std::size_t at = mcap::kMagic.size(); at + mcap::kRecordHeaderBytes <= bytes.size();) {
    starts.push_back(at);
    const auto content_bytes = get<std::uint64_t>(bytes, at + 1);
    if (content_bytes > bytes.size() - at - mcap::kRecordHeaderBytes) break;
    at += mcap::kRecordHeaderBytes + content_bytes;
  }
  return starts;
}

// Corrects the CRCs, so that the damage passes their check as in a hostile file.
inline void make_crcs_fit(mcap::Bytes& bytes) {
  constexpr std::size_t kChunkCrcAt = mcap::kRecordHeaderBytes + 8 + 8 + 8;
  for (const std::size_t at : record_starts(bytes))
    if (mcap::Op(get<std::uint8_t>(bytes, at)) == mcap::Op::chunk)
      put(bytes, at + kChunkCrcAt, std::uint32_t(0));  // 0: not checked
  if (bytes.size() < mcap::kFooterBytes + mcap::kMagic.size()) return;
  const std::size_t footer = bytes.size() - mcap::kMagic.size() - mcap::kFooterBytes,
                    crc_at = footer + mcap::kFooterBytes - 4;
  const auto summary_start = get<std::uint64_t>(bytes, footer + mcap::kRecordHeaderBytes);
  if (summary_start < crc_at)
    put(bytes, crc_at,
        mcap::crc32_of(mcap::ByteView(bytes).subspan(summary_start, crc_at - summary_start)));
}

inline std::uint64_t interesting_number(std::mt19937& random, std::uint64_t file_bytes) {
  switch (random() % 8) {
    case 0: return 0;
    case 1: return ~std::uint64_t(0) - random() % 16;
    case 2: {
      const std::uint64_t power = std::uint64_t(1) << random() % 64;
      return power - random() % 2;
    }
    case 3: return file_bytes - random() % 64;
    case 4: return file_bytes + random() % 64;
    default: return random() % (2 * file_bytes + 1);
  }
}

inline void mutate(mcap::Bytes& bytes, std::mt19937& random) {
  if (bytes.empty()) return;
  const auto any_place = [&] { return std::size_t(random() % bytes.size()); };
  const auto starts = record_starts(bytes);
  const auto any_start = [&] { return starts[random() % starts.size()]; };
  const std::uint64_t number = interesting_number(random, bytes.size());
  switch (random() % 8) {
    case 0: bytes[any_place()] ^= std::byte(1 << random() % 8); break;
    case 1: bytes[any_place()] = std::byte(random()); break;
    case 2: bytes.resize(any_place()); break;
    case 3: put(bytes, any_place(), number); break;
    case 4: put(bytes, any_place(), std::uint32_t(number)); break;
    case 5:  // a record's length
      if (!starts.empty()) put(bytes, any_start() + 1, number);
      break;
    case 6:  // a field near a record's start
      if (!starts.empty()) {
        const std::size_t start = any_start();
        put(bytes, start + mcap::kRecordHeaderBytes + random() % 48, number);
      }
      break;
    default: {  // inserts a piece of the file, or overwrites another piece with it
      const std::size_t from = any_place(),
                        size_bytes = std::min<std::size_t>(random() % 400, bytes.size() - from),
                        to = any_place();
      const mcap::Bytes piece(bytes.begin() + std::ptrdiff_t(from),
                              bytes.begin() + std::ptrdiff_t(from + size_bytes));
      if (random() % 2 == 0)
        bytes.insert(bytes.begin() + std::ptrdiff_t(to), piece.begin(), piece.end());
      else
        std::copy_n(piece.begin(), std::min(piece.size(), bytes.size() - to),
                    bytes.begin() + std::ptrdiff_t(to));
    }
  }
}

// Checks that a cursor returns messages in order and reaches its end despite damaged chunks.
inline std::string read_all(const mcap::Reader& reader, std::vector<OwnMessage>& messages) {
  std::size_t damaged = 0;
  for (mcap::Cursor cursor = reader.messages();;) {
    try {
      const auto message = cursor.next();
      if (!message) break;
      if (!reader.channels().contains(message->channel)) return "a message without a channel";
      if (!messages.empty() && messages.back().log_stamp_ns > message->log_stamp_ns)
        return "messages out of order";
      messages.push_back(own(*message));
    } catch (const mcap::McapError& error) {
      if (!reader.is_finished())
        return std::string("a chunk that a scan accepted is damaged: ") + error.what();
      if (++damaged > reader.chunks().size()) return "the cursor does not skip a damaged chunk";
    }
  }
  return "";
}

// Describes a violated invariant; empty if all hold: the file can be read or throws McapError, and
// its repaired copy has the messages that a scan of the damaged file finds.
inline std::string violated_invariant(const std::filesystem::path& path,
                                      const std::filesystem::path& scratch) {
  std::optional<mcap::Reader> reader;
  try {
    reader.emplace(path);
  } catch (const mcap::McapError&) {
    return "";
  }
  std::vector<OwnMessage> messages;
  if (const std::string broken = read_all(*reader, messages); !broken.empty()) return broken;
  for (const mcap::AttachmentIndex& attachment : reader->attachments()) try {
      reader->read(attachment);
    } catch (const mcap::McapError&) {
    }
  for (const mcap::MetadataIndex& metadata : reader->metadata()) try {
      reader->read(metadata);
    } catch (const mcap::McapError&) {
    }
  if (reader->is_finished()) {
    std::filesystem::copy_file(path, scratch, std::filesystem::copy_options::overwrite_existing);
    remove_summary(scratch);
    std::vector<OwnMessage> scanned;
    return read_all(mcap::Reader(scratch), scanned);
  }
  std::filesystem::remove(scratch);
  try {
    mcap::recover(path, scratch);
  } catch (const mcap::McapError&) {
    const auto& chunks = reader->chunks();
    return std::any_of(chunks.begin(), chunks.end(),
                       [](const mcap::ChunkIndex& chunk) { return chunk.unchunked; })
               ? ""
               : "the file could not be repaired";
  }
  const mcap::Reader repaired(scratch);
  if (!repaired.is_finished())
    return "the repaired file has no valid summary: " + repaired.damage().summary;
  std::vector<OwnMessage> of_repaired;
  if (const std::string broken = read_all(repaired, of_repaired); !broken.empty())
    return "repaired file: " + broken;
  // In the repaired file, messages of a moved chunk follow others with the same timestamp.
  const auto by_all = [](const OwnMessage& a, const OwnMessage& b) {
    return std::tie(a.log_stamp_ns, a.channel, a.sequence, a.publish_stamp_ns, a.payload) <
           std::tie(b.log_stamp_ns, b.channel, b.sequence, b.publish_stamp_ns, b.payload);
  };
  std::sort(messages.begin(), messages.end(), by_all);
  std::sort(of_repaired.begin(), of_repaired.end(), by_all);
  if (messages != of_repaired) return "the repaired file has other messages";
  if (repaired.statistics() != reader->statistics())
    return "the repaired file has other statistics";
  return "";
}

}  // namespace fivepipe::test
